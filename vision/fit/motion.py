"""A bar that does not stand still: where it is in each frame, by a few parameters of the fit."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from vision.geometry.contact import axis_frame

# [terms] Force, and so the way that a spring gives, over the pushing angle: in proportion, and
# what large bending and friction add to that. Study: soft.py.
_POWERS = 3
# [mm] Prior sigma of how far a bar gives way: nothing is believed of it. Stated.
_ANYWHERE_MM = 50.0
# [deg] Prior sigma of when it begins to: nothing is believed of it. Stated.
_ANY_TOUCH_DEG = 50.0
# [mm, deg] Of differences: far above rounding, far below what curves. Derived.
_STEP = 1e-5
# [mm/s] A velocity that is stated as exact: a prior that is none would leave the fit no parameter
# to move. Study: chosen.
_EXACT_MM_S = 1e-6


@dataclass(frozen=True, eq=False)
class StatedVelocity:
    """The velocity stated beforehand of a bar that moves at constant speed.

    velocity_mm_s (3,) in the rig frame, with one sigma in each direction. time_s: at which the bar
    is where its axis is counted from.
    """

    velocity_mm_s: np.ndarray
    sigma_mm_s: float
    time_s: float


@dataclass(frozen=True)
class Gives:
    """A bar that stands until it is touched and then gives way.

    touch_rad: motor angle of touch; before anything is known, it is never. span_rad: how far the
    motor goes on from there. most_mm: how far the bar comes.
    """

    touch_rad: float = np.inf
    span_rad: float = 1.0
    most_mm: float = 0.0


@dataclass(frozen=True, eq=False)
class Motion:
    """Where a moving bar is in each of f frames, mm from where its axis is counted.

    expected_mm (f, 3): before anything is seen. per_unit (k, f, 3): the change by each of k
    parameters, whose prior has standard deviations sigma (k,).
    """

    expected_mm: np.ndarray
    per_unit: np.ndarray
    sigma: np.ndarray

    from_touch: ClassVar = False

    @classmethod
    def steady(cls, stated: StatedVelocity, time_s: np.ndarray) -> "Motion":
        """Return the motion at constant velocity in frames at time_s (f,): parameters are what the
        stated velocity is off by, mm/s."""
        since = (time_s - stated.time_s)[:, None]
        sigma = np.full(3, max(stated.sigma_mm_s, _EXACT_MM_S))
        return cls(since * stated.velocity_mm_s, since * np.eye(3)[:, None], sigma)

    def __len__(self) -> int:
        """Return the number of parameters."""
        return len(self.sigma)

    def shift_mm(self, values: np.ndarray) -> np.ndarray:
        """Return how far (…, f, 3) the bar is from where its axis is counted, by parameters
        (…, k).
        """
        return self.expected_mm + np.einsum("...k,kfi->...fi", values, self.per_unit)


@dataclass(frozen=True, eq=False)
class Yielding:
    """Where a bar that gives way is in each of f frames, at motor_rad (f,).

    It stands up to touch, then moves across its direction (3,) by powers of the pushing angle.
    Parameters: by how many degrees touch is later than `gives` states; then, for each direction
    across and each power, how far the bar has moved at the end of the push, mm.
    """

    gives: Gives
    motor_rad: np.ndarray
    direction: np.ndarray

    from_touch: ClassVar = True

    def __len__(self) -> int:
        """Return the number of parameters."""
        return 1 + 2 * _POWERS

    @property
    def sigma(self) -> np.ndarray:
        """Return the prior's standard deviations (k,) of the parameters: nothing is believed of
        them.
        """
        return np.array([_ANY_TOUCH_DEG, *[_ANYWHERE_MM] * (2 * _POWERS)])

    @property
    def expected_mm(self) -> np.ndarray:
        """Return where the bar is in each frame (f, 3) before anything is seen: in its place."""
        return np.zeros((len(self.motor_rad), 3))

    def shift_mm(self, values: np.ndarray) -> np.ndarray:
        """Return how far (…, f, 3) the bar is from its place, by parameters (…, k)."""
        across = axis_frame(self.direction)
        ways_mm = values[..., 1:].reshape(*values.shape[:-1], 2, _POWERS)
        return np.einsum("...fp,...wp,wi->...fi", self._powers(values[..., :1]), ways_mm, across)

    def values(self, shift_mm: np.ndarray) -> np.ndarray:
        """Fit parameters (k,) to shifts (f, 3), with touch as `gives` states."""
        across_mm = shift_mm @ axis_frame(self.direction).T
        ways_mm = np.linalg.lstsq(self._powers(np.zeros(1)), across_mm, rcond=None)[0]
        return np.append(0.0, ways_mm.T)

    def by_values(self, values: np.ndarray) -> np.ndarray:
        """Return derivatives (k, f, 3) of the shifts by the parameters (k,)."""
        moved = self.shift_mm(values + _STEP * np.eye(len(self)))
        return (moved - self.shift_mm(values)) / _STEP

    def _powers(self, later_deg: np.ndarray) -> np.ndarray:
        """Return powers (…, f, p) of the pushing angle over the span, by how much later (…, 1)
        touch is.
        """
        pushed = np.maximum(self.motor_rad - self.gives.touch_rad - np.radians(later_deg), 0.0)
        return (pushed / self.gives.span_rad)[..., None] ** np.arange(1, _POWERS + 1)


def between(motor_rad: np.ndarray, shift_mm: np.ndarray, at_rad: np.ndarray) -> np.ndarray:
    """Interpolate shifts (…, 3) at motor angles at_rad (…) from those of frames (…, f, 3) at
    motor_rad (f,).

    The motor angles rise: the motor turns as steadily as the bar moves.
    """
    last = np.clip(np.searchsorted(motor_rad, at_rad), 1, len(motor_rad) - 1)
    first = last - 1
    part = (at_rad - motor_rad[first]) / (motor_rad[last] - motor_rad[first])

    def shift_in(frame: np.ndarray) -> np.ndarray:
        """Return the shifts (…, 3) in frames (…)."""
        return np.take_along_axis(shift_mm, frame[..., None, None], axis=-2)[..., 0, :]

    return (1.0 - part[..., None]) * shift_in(first) + part[..., None] * shift_in(last)
