"""A bar that does not stand still: where it is in each frame, by a few parameters of the fit (moving objects)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from vision.geometry.contact import axis_frame


@dataclass(frozen=True, eq=False)
class Told:
    """What is said beforehand of a bar that moves at constant speed, mm/s in the rig frame (3,), with one sigma each
    way; time_s: at which it is where the bar's axis is counted from."""

    velocity_mm_s: np.ndarray
    sigma_mm_s: float
    time_s: float


@dataclass(frozen=True)
class Gives:
    """A bar that stands until it is touched and then gives way: motor angle of touch, how far the motor goes on from
    there, rad, and how far the bar comes, mm. Before anything is known, touch is never."""

    touch_rad: float = np.inf
    span_rad: float = 1.0
    most_mm: float = 0.0


@dataclass(frozen=True, eq=False)
class Motion:
    """Where the bar is in each of f frames, mm from where its axis is counted: told_mm (f, 3), and per_unit (k, f, 3)
    of each of k parameters beside it, whose sigma (k,) is known beforehand."""

    told_mm: np.ndarray
    per_unit: np.ndarray
    sigma: np.ndarray

    from_touch: ClassVar = False

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


@dataclass(frozen=True, eq=False)
class Yielding:
    """Where a bar that gives way is in each of f frames, at motor_rad (f,): in its place up to touch, then across its
    direction (3,) by powers of the pushing angle. Parameters are by how much touch is later than said, degrees, and mm
    at the end of the push, of each way and power."""

    gives: Gives
    motor_rad: np.ndarray
    direction: np.ndarray

    from_touch: ClassVar = True

    def __len__(self) -> int:
        return 1 + 2 * _POWERS

    @property
    def sigma(self) -> np.ndarray:
        """Of the parameters (k,), beforehand: nothing is believed of them."""
        return np.array([_ANY_TOUCH_DEG, *[_ANYWHERE_MM] * (2 * _POWERS)])

    @property
    def told_mm(self) -> np.ndarray:
        """Where it is in each frame (f, 3) before anything is seen: in its place."""
        return np.zeros((len(self.motor_rad), 3))

    def shift_mm(self, values: np.ndarray) -> np.ndarray:
        """How far (…, f, 3) the bar is from its place, by parameters (…, k)."""
        ways = values[..., 1:].reshape(*values.shape[:-1], 2, _POWERS)
        return np.einsum(
            "...fp,...wp,wi->...fi", self._powers(values[..., :1]), ways, axis_frame(self.direction)
        )

    def values(self, shift_mm: np.ndarray) -> np.ndarray:
        """Parameters (k,) that meet shifts (f, 3) best, with touch as said."""
        ways = np.linalg.lstsq(
            self._powers(np.zeros(1)), shift_mm @ axis_frame(self.direction).T, rcond=None
        )[0]
        return np.append(0.0, ways.T)

    def by_values(self, values: np.ndarray) -> np.ndarray:
        """What shifts change by with each parameter, (k, f, 3)."""
        moved = self.shift_mm(values + _STEP * np.eye(len(self)))
        return (moved - self.shift_mm(values)) / _STEP

    def _powers(self, later_deg: np.ndarray) -> np.ndarray:
        pushed = np.maximum(self.motor_rad - self.gives.touch_rad - np.radians(later_deg), 0.0)
        return (pushed / self.gives.span_rad)[..., None] ** np.arange(1, _POWERS + 1)


# [terms] Force, and so the way that a spring gives, over the pushing angle: in proportion, and
# what large bending and friction add to that. Study: soft.py.
_POWERS = 3
# [mm, deg] Nothing is believed of how far a bar gives way, nor of when. Stated.
_ANYWHERE_MM, _ANY_TOUCH_DEG = 50.0, 50.0
# [mm, deg] Of differences: far above rounding, far below what curves. Derived.
_STEP = 1e-5
# [mm/s] A velocity that is stated as exact: a prior that is none would leave the fit no parameter
# to move. Study: chosen.
_EXACT_MM_S = 1e-6


def between(motor_rad: np.ndarray, shift_mm: np.ndarray, at_rad: np.ndarray) -> np.ndarray:
    """Shifts (…, 3) at motor angles (…), by those of frames (…, f, 3) at motor_rad (f,), which rise: the motor goes as
    steadily as the bar does."""
    first = np.clip(np.searchsorted(motor_rad, at_rad) - 1, 0, len(motor_rad) - 2)
    part = ((at_rad - motor_rad[first]) / (motor_rad[first + 1] - motor_rad[first]))[..., None]
    before, after = (
        np.take_along_axis(shift_mm, k[..., None, None], axis=-2)[..., 0, :]
        for k in (first, first + 1)
    )
    return (1.0 - part) * before + part * after
