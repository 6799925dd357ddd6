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
    angle = np.linspace(-_FREE_RAD, theta_rad + half_window, _SAMPLES)
    spacing = angle[1] - angle[0]
    sigma = noise_Nmm * np.sqrt(spacing**-1 / (rate_Hz / speed))  # of a sample of this grid
    touch = _touch_weights(angle, max(WINDOW_RAD, speed * WINDOW_S))
    moment = _moment_weights(angle, theta_rad, half_window)
    return StrokeNoise(
        float(sigma * np.linalg.norm(touch)),
        float(sigma * np.linalg.norm(moment)),
        float(sigma**2 * (touch @ moment)),
    )


def _touch_weights(angle, window_rad):
    """Return the weights (n,) of samples at angles in the rise that is drawn back to touch."""
    is_rise = (angle > GUARD_RAD) & (angle <= window_rad)
    return noise.line_weights(angle, is_rise, 0.0) - _level_weights(angle)


def _moment_weights(angle, theta_rad, half_window_rad):
    """Return the weights (n,) of samples at angles in the moment at θ."""
    is_at_theta = np.abs(angle - theta_rad) <= half_window_rad
    return noise.line_weights(angle, is_at_theta, theta_rad) - _level_weights(angle)


def _level_weights(angle):
    """Return the weights (n,) of samples at angles in the level of the free stroke."""
    return noise.mean_weights(angle < -GUARD_RAD)
