"""First touch of the unbent whisker on an object whose place a stage states.

Nothing that is felt or seen enters: the motor's angle, the whisker's stated shape and the bar's
stated place decide. A bar is a `StatedBar`, any other object a `StatedRounded`.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from vision.geometry import (
    Axis,
    BarAxis,
    Curves,
    Rounded,
    RoundedAxis,
    Wire,
    axis_frame,
    centrelines,
    clearance,
    rotation_z,
)

# [1] Motor angles of a stroke at which the whisker's distance from the object is computed: 0.3° apart
# over 30°, in which none is passed and left again. Derived.
_SCANNED = 101
# [rad] To either side of touch, where steps of derivatives move it to: they do by 1e-4. Derived.
_NEAR_RAD = 0.01
# [1] Of the whisker's length: a contact beyond is the tip's. The point of a curve that is nearest to a bar
# beyond its end is the end itself, to rounding. Derived.
_BEFORE_TIP = 1.0 - 1e-6
# [1] Coefficients of the whisker's unloaded shape, each way: offset, slope, curvature.
REST_TERMS = 3
# Places in `Offsets.vector`: of the object along x, y and z, and its slope.
X, Y, Z, SLOPE = range(4)


@dataclass(frozen=True, eq=False)
class Offsets:
    """Errors of what a stage's truth rests on, as numbers or with their standard deviations.

    place_mm (3,): of the object. slope_rad, tilt_rad: of its direction, two turns across it. reach_mm: of the radii of bar
    and whisker together. rest_mm (2, k): polynomials of the unbent whisker's shape, in y and z.
    """

    place_mm: np.ndarray
    slope_rad: float
    tilt_rad: float
    reach_mm: float
    rest_mm: np.ndarray

    @property
    def vector(self) -> np.ndarray:
        """Return all numbers in a row (6 + 2 k,)."""
        numbers = [self.slope_rad, self.tilt_rad, self.reach_mm]
        return np.concatenate([self.place_mm, numbers, self.rest_mm.ravel()])

    @classmethod
    def none(cls) -> "Offsets":
        """Return no offsets."""
        return cls(np.zeros(3), 0.0, 0.0, 0.0, np.zeros((2, REST_TERMS)))

    @classmethod
    def from_vector(cls, vector: np.ndarray) -> "Offsets":
        """Return the offsets of such a row."""
        place_mm, numbers, rest_mm = np.split(vector, [3, 6])
        return cls(place_mm, *numbers.tolist(), rest_mm.reshape(2, -1))


@dataclass(frozen=True, eq=False)
class Contact:
    """First touch: motor angle, distance from the base, slope and tilt of the bar there."""

    motor_rad: float
    d_x_mm: float
    beta_rad: float
    psi_rad: float


class StatedObject(ABC):
    """An object of stated form and direction, which stands where a stage has it."""

    radius_mm: float

    @abstractmethod
    def at(self, place_mm: np.ndarray, motor_rad: np.ndarray, offsets: Offsets) -> Axis:
        """Return the object at places (n, 3), mm, in the hub's axes at motor angles (n,)."""

    @abstractmethod
    def from_base_mm(self, standing: Axis) -> float:
        """Return how far its middle is from the whisker's base; standing: the first of `at`."""


@dataclass(frozen=True, eq=False)
class StatedBar(StatedObject):
    """A straight bar. axis (3,): its direction in the rig frame, unit, or None where slope_rad says it in
    the contact's frame, with no tilt.
    """

    radius_mm: float
    axis: np.ndarray | None
    slope_rad: float = 0.0

    def at(self, place_mm: np.ndarray, motor_rad: np.ndarray, offsets: Offsets) -> BarAxis:
        """Return the bar in the hub's axes, which at touch are the contact frame's."""
        slope = np.full(len(motor_rad), self.slope_rad)
        tilt = np.zeros(len(motor_rad))
        if self.axis is not None:
            slope, tilt = slope_and_tilt(_to_hub(motor_rad) @ self.axis)
        return BarAxis(place_mm, _direction(slope + offsets.slope_rad, tilt + offsets.tilt_rad))

    def from_base_mm(self, standing: Axis) -> float:
        """Return how far from the whisker's base its axis passes."""
        return float(np.linalg.norm(np.cross(standing.point_mm[0], standing.direction[0])))


@dataclass(frozen=True, eq=False)
class StatedRounded(StatedObject):
    """A ring, sphere or cone. axis (3,): its direction in the rig frame, unit."""

    form: Rounded
    axis: np.ndarray

    @property
    def radius_mm(self) -> float:
        """Return the radius of its surface about its middle."""
        return self.form.radius_mm

    def at(self, place_mm: np.ndarray, motor_rad: np.ndarray, offsets: Offsets) -> RoundedAxis:
        """Return the object in the hub's axes."""
        turns = np.array([offsets.slope_rad, offsets.tilt_rad])
        axis = self.axis + turns @ axis_frame(self.axis)
        direction = _to_hub(motor_rad) @ (axis / np.linalg.norm(axis))
        return RoundedAxis(place_mm, direction, self.form, place_mm)

    def from_base_mm(self, standing: Axis) -> float:
        """Return how far its middle is from the whisker's base, less what that is farther from its surface."""
        distances, _ = standing.outside_mm(np.zeros((len(standing.point_mm), 1, 3)))
        return float(distances[0, 0])


@dataclass(frozen=True, eq=False)
class StatedPush:
    """A stroke against an object that stands, or is moved, as stated.

    motor_rad (n,): of the stroke, in time. place_at: the object's place (..., 3) in the rig frame at
    motor angles (...).
    """

    motor_rad: np.ndarray
    place_at: Callable[[np.ndarray], np.ndarray]
    wire: Wire
    object: StatedObject

    def touch(self, offsets: Offsets) -> Contact | None:
        """Return first touch; None where the whisker does not come to the object in this stroke.

        Nor does one whose tip passes before it: no point load bends that.
        """
        angles = np.linspace(self.motor_rad.min(), self.motor_rad.max(), _SCANNED)
        gaps, _ = self._clearance(angles, offsets)
        closes = np.flatnonzero((gaps[:-1] > 0.0) & (gaps[1:] <= 0.0))
        if not len(closes):
            return None
        return self._touch_between(angles[closes[0]], angles[closes[0] + 1], offsets)

    def moved_touch(self, touch: Contact, offsets: Offsets) -> Contact | None:
        """Return where first touch goes by small offsets; None where it is not near any more."""
        low = touch.motor_rad - _NEAR_RAD
        high = touch.motor_rad + _NEAR_RAD
        (before, after), _ = self._clearance(np.array([low, high]), offsets)
        return self._touch_between(low, high, offsets) if after < 0.0 < before else None

    def _touch_between(self, low_rad: float, high_rad: float, offsets: Offsets) -> Contact | None:
        """Return the touch between two motor angles, of which the second is past it."""

        def gap(motor_rad: float) -> float:
            """Return the gap, mm, at one motor angle."""
            return float(self._clearance(np.array([motor_rad]), offsets)[0][0])

        at = np.array([brentq(gap, low_rad, high_rad, xtol=1e-12)])
        _, points_mm = self._clearance(at, offsets)
        d_x_mm = float(np.linalg.norm(points_mm[0]))
        if d_x_mm > _BEFORE_TIP * self.wire.length_mm:
            return None
        bar = self._standing(at, offsets).bar_at(points_mm)
        slope, tilt = slope_and_tilt(bar.direction)
        return Contact(float(at[0]), d_x_mm, float(slope[0]), float(tilt[0]))

    def starts_touching(self, offsets: Offsets) -> bool:
        """Return whether the whisker is past the object's surface where the stroke begins."""
        return bool(self._clearance(self.motor_rad[:1], offsets)[0][0] <= 0.0)

    def from_base_mm(self) -> float:
        """Return how far the object's middle is from the whisker's base where the stroke begins."""
        return self.object.from_base_mm(self._standing(self.motor_rad[:1], Offsets.none()))

    def standing_in_rig(self, motor_rad: float) -> Axis:
        """Return where the object stands in the base's frame at a motor angle."""
        standing = self._standing(np.array([motor_rad]), Offsets.none())
        turn = rotation_z(motor_rad)
        return replace(
            standing, point_mm=turn @ standing.point_mm[0], direction=turn @ standing.direction[0]
        )

    def _standing(self, motor_rad: np.ndarray, offsets: Offsets) -> Axis:
        """Return where the object stands in the hub's axes at motor angles (n,)."""
        place_mm = self.place_at(motor_rad) + offsets.place_mm  # (n, 3)
        in_hub_mm = np.einsum("nij,nj->ni", _to_hub(motor_rad), place_mm)
        return self.object.at(in_hub_mm, motor_rad, offsets)

    def _clearance(self, motor_rad: np.ndarray, offsets: Offsets) -> tuple[np.ndarray, np.ndarray]:
        """Return gaps (n,) between the surfaces and the nearest points (n, 3), in the hub's axes.

        motor_rad (n,).
        """
        count = len(motor_rad)
        one = centrelines(offsets.rest_mm, np.zeros(2), self.wire.length_mm, 0.0, self.wire)
        shape = (count, *one.points_mm.shape)
        curves = Curves(
            one.arc_mm,
            np.broadcast_to(one.points_mm, shape),
            np.broadcast_to(one.tangents, shape),
        )
        there = self._standing(motor_rad, offsets)
        distance_mm, arc_mm, points_mm = clearance(curves, there, self.wire)
        reach_mm = self.object.radius_mm + self.wire.radius_mm(arc_mm) + offsets.reach_mm
        return distance_mm - reach_mm, points_mm


def slope_and_tilt(directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return slope and tilt (n,) of bars along unit directions (n, 3) in the contact's frame."""
    x, y, z = directions.T
    return np.arctan2(y, z), np.arcsin(np.clip(x, -1.0, 1.0))


def _to_hub(motor_rad: np.ndarray) -> np.ndarray:
    """Return what turns rig vectors into the hub's axes (n, 3, 3) at motor angles (n,)."""
    return np.swapaxes(rotation_z(motor_rad), -1, -2)


def _direction(slope_rad: np.ndarray, tilt_rad: np.ndarray) -> np.ndarray:
    """Return unit directions (n, 3) of bars by slope and tilt (n,)."""
    across = np.cos(tilt_rad)
    return np.stack(
        [np.sin(tilt_rad), across * np.sin(slope_rad), across * np.cos(slope_rad)], axis=-1
    )
