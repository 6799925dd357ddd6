"""The noise of touch and moments by that of one sample, through the weights with which the
estimators read a stroke."""

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
    """Noise of a stroke's readings above the level of its free part.

    touch_Nmm: sigma of the rise, drawn back to touch; over the rise's slope it is touch's own sigma.
    moment_Nmm: sigma of the moment at θ. shared_Nmm2: their covariance, (N·mm)².
    """

    touch_Nmm: float
    moment_Nmm: float
    shared_Nmm2: float


@lru_cache(maxsize=4096)
def stroke_noise(
    theta_rad: float, noise_Nmm: float, rate_Hz: float, speed_deg_s: float
) -> StrokeNoise:
    """Compute the noise of a stroke that ends with the window about θ.

    noise_Nmm: sigma of a sample of each channel, white.
    """
    speed = np.radians(speed_deg_s)
    half_window = min(max(HALF_WINDOW_RAD, speed * HUM_PERIOD_S / 2), 0.9 * theta_rad)
    rise_window = max(WINDOW_RAD, speed * WINDOW_S)
    angle = np.linspace(-_FREE_RAD, theta_rad + half_window, _SAMPLES)
    spacing = angle[1] - angle[0]
    sigma = noise_Nmm * np.sqrt(spacing**-1 / (rate_Hz / speed))  # of a sample of this grid
    level = noise.mean_weights(angle < -GUARD_RAD)
    is_rise = (angle > GUARD_RAD) & (angle <= rise_window)
    touch = noise.line_weights(angle, is_rise, 0.0) - level
    is_at_theta = np.abs(angle - theta_rad) <= half_window
    moment = noise.line_weights(angle, is_at_theta, theta_rad) - level
    return StrokeNoise(
        float(sigma * np.linalg.norm(touch)),
        float(sigma * np.linalg.norm(moment)),
        float(sigma**2 * (touch @ moment)),
    )
