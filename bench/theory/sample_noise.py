"""What the noise of one sample does to touch and moments, by the weights with which the estimators read a stroke."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from estimator import noise
from estimator.onset import GUARD_RAD, WINDOW_RAD, WINDOW_S
from estimator.signal import HALF_WINDOW_RAD, HUM_PERIOD_S

_FREE_RAD = np.radians(1.5)  # rad: free stroke before touch, of the rig's protocols
_SAMPLES = 1200  # of the grid over a stroke; the sums are those of integrals


@dataclass(frozen=True)
class StrokeNoise:
    """Standard deviations, N·mm, of the rise where it is drawn back to touch, and of the moment at θ, both above the
    free stroke's level; their covariance, (N·mm)². Over the rise's slope the first is touch's own sigma."""

    touch_Nmm: float
    moment_Nmm: float
    shared_Nmm2: float


@lru_cache(maxsize=4096)
def stroke_noise(
    theta_rad: float, noise_Nmm: float, rate_Hz: float, speed_deg_s: float
) -> StrokeNoise:
    """For white noise of `noise_Nmm` a sample of each channel, on a stroke that ends with the window about θ."""
    speed = np.radians(speed_deg_s)
    half = min(max(HALF_WINDOW_RAD, speed * HUM_PERIOD_S / 2), 0.9 * theta_rad)
    window = max(WINDOW_RAD, speed * WINDOW_S)
    angle = np.linspace(-_FREE_RAD, theta_rad + half, _SAMPLES)
    per_sample = noise_Nmm * np.sqrt((angle[1] - angle[0]) ** -1 / (rate_Hz / speed))
    level = noise.mean_weights(angle < -GUARD_RAD)
    rise = noise.line_weights(angle, (angle > GUARD_RAD) & (angle <= window), 0.0) - level
    at = noise.line_weights(angle, np.abs(angle - theta_rad) <= half, theta_rad) - level
    spreads = (float(per_sample * np.linalg.norm(weights)) for weights in (rise, at))
    return StrokeNoise(*spreads, float(per_sample**2 * (rise @ at)))
