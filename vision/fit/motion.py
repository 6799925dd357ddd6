"""A bar that does not stand still: where it is in each frame, by a few parameters of the fit (moving objects)."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Told:
    """What is said beforehand of a bar that moves at constant speed, mm/s in the rig frame (3,), with one sigma each
    way; time_s: at which it is where the bar's axis is counted from."""

    velocity_mm_s: np.ndarray
    sigma_mm_s: float
    time_s: float


@dataclass(frozen=True, eq=False)
class Motion:
    """Where the bar is in each of f frames, mm from where its axis is counted: told_mm (f, 3), and per_unit (k, f, 3)
    of each of k parameters beside it, whose sigma (k,) is known beforehand."""

    told_mm: np.ndarray
    per_unit: np.ndarray
    sigma: np.ndarray

    @classmethod
    def steady(cls, told: Told, time_s: np.ndarray) -> "Motion":
        """At constant velocity, frames at time_s (f,): parameters are what the velocity is off by, mm/s."""
        since = (time_s - told.time_s)[:, None]
        sigma = np.full(3, max(told.sigma_mm_s, _EXACT_MM_S))
        return cls(since * told.velocity_mm_s, since * np.eye(3)[:, None], sigma)

    def __len__(self) -> int:
        return len(self.sigma)

    def shift_mm(self, values: np.ndarray) -> np.ndarray:
        """How far (…, f, 3) the bar is from where its axis is counted, by parameters (…, k)."""
        return self.told_mm + np.einsum("...k,kfi->...fi", values, self.per_unit)


_EXACT_MM_S = 1e-6  # a prior that is none would leave the fit no parameter to move


def between(motor_rad: np.ndarray, shift_mm: np.ndarray, at_rad: np.ndarray) -> np.ndarray:
    """Shifts (…, 3) at motor angles (…), by those of frames (…, f, 3) at motor_rad (f,), which rise: the motor goes as
    steadily as the bar does."""
    first = np.clip(np.searchsorted(motor_rad, at_rad) - 1, 0, len(motor_rad) - 2)
    part = ((at_rad - motor_rad[first]) / (motor_rad[first + 1] - motor_rad[first]))[..., None]
    before, after = (np.take_along_axis(shift_mm, k[..., None, None], axis=-2)[..., 0, :] for k in (first, first + 1))
    return (1.0 - part) * before + part * after
