"""First touch of the unbent whisker on a straight bar whose place a stage states.

Nothing that is felt or seen enters: the motor's angle, the whisker's stated shape and the bar's
stated place decide.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from vision.geometry import BarAxis, Curves, Wire, centrelines, clearance, rotation_z

# [1] Motor angles of a stroke at which the whisker's distance from the bar is computed: 0.3° apart
# over 30°, in which no bar is passed and left again. Derived.
_SCANNED = 101
# [rad] To either side of touch, where steps of derivatives move it to: they do by 1e-4. Derived.
_NEAR_RAD = 0.01
# [1] Of the whisker's length: a contact beyond is the tip's. The point of a curve that is nearest to a bar
# beyond its end is the end itself, to rounding. Derived.
_BEFORE_TIP = 1.0 - 1e-6
# [1] Coefficients of the whisker's unloaded shape, each way: offset, slope, curvature.
REST_TERMS = 3


@dataclass(frozen=True, eq=False)
class Offsets:
    """Errors of what a stage's truth rests on, as numbers or with their standard deviations.

    place_mm (3,): of the bar. slope_rad, tilt_rad: of its direction. reach_mm: of the radii of bar
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


@dataclass(frozen=True, eq=False)
class StatedPush:
    """A stroke against a bar that stands, or is moved, as stated.

    motor_rad (n,): of the stroke, in time. place_at: the bar's place (..., 3) in the rig frame at
    motor angles (...). axis (3,): its direction there, unit, or None where slope_rad says it in the
    contact's frame, with no tilt.
    """

    motor_rad: np.ndarray
    place_at: Callable[[np.ndarray], np.ndarray]
    wire: Wire
    bar_radius_mm: float
    axis: np.ndarray | None
    slope_rad: float = 0.0

    def touch(self, offsets: Offsets) -> Contact | None:
        """Return first touch; None where the whisker does not come to the bar in this stroke.

        Nor does one whose tip passes before the bar: no point load bends that.
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
        slope, tilt = self._angles(at, offsets)
        return Contact(float(at[0]), d_x_mm, float(slope[0]), float(tilt[0]))

    def starts_touching(self, offsets: Offsets) -> bool:
        """Return whether the whisker is past the bar's surface where the stroke begins."""
        return bool(self._clearance(self.motor_rad[:1], offsets)[0][0] <= 0.0)

    def from_base_mm(self) -> float:
        """Return how far from the whisker's base the bar's axis passes where the stroke begins."""
        begin = self.motor_rad[:1]
        place_mm = self.place_at(begin)[0]
        to_hub = rotation_z(begin[0]).T
        direction = _direction(*self._angles(begin, Offsets.none()))[0]
        return float(np.linalg.norm(np.cross(to_hub @ place_mm, direction)))

    def _clearance(self, motor_rad: np.ndarray, offsets: Offsets) -> tuple[np.ndarray, np.ndarray]:
        """Return gaps (n,) between the surfaces and the nearest points (n, 3), in the hub's axes.

        motor_rad (n,).
        """
        count = len(motor_rad)
        to_hub = np.swapaxes(rotation_z(motor_rad), -1, -2)  # (n, 3, 3)
        place_mm = self.place_at(motor_rad) + offsets.place_mm  # (n, 3)
        direction = _direction(*self._angles(motor_rad, offsets))
        bar = BarAxis(np.einsum("nij,nj->ni", to_hub, place_mm), direction)
        one = centrelines(offsets.rest_mm, np.zeros(2), self.wire.length_mm, 0.0, self.wire)
        shape = (count, *one.points_mm.shape)
        curves = Curves(
            one.arc_mm,
            np.broadcast_to(one.points_mm, shape),
            np.broadcast_to(one.tangents, shape),
        )
        distance_mm, arc_mm, points_mm = clearance(curves, bar)
        reach_mm = self.bar_radius_mm + self.wire.radius_mm(arc_mm) + offsets.reach_mm
        return distance_mm - reach_mm, points_mm

    def _angles(self, motor_rad: np.ndarray, offsets: Offsets) -> tuple[np.ndarray, np.ndarray]:
        """Return slope and tilt (n,) of the bar in the hub's axes at motor angles (n,).

        At touch the hub's axes are the contact frame's.
        """
        slope = np.full(len(motor_rad), self.slope_rad)
        tilt = np.zeros(len(motor_rad))
        if self.axis is not None:
            x, y, z = np.moveaxis(np.swapaxes(rotation_z(motor_rad), -1, -2) @ self.axis, -1, 0)
            slope = np.arctan2(y, z)
            tilt = np.arcsin(np.clip(x, -1.0, 1.0))
        return slope + offsets.slope_rad, tilt + offsets.tilt_rad


def _direction(slope_rad: np.ndarray, tilt_rad: np.ndarray) -> np.ndarray:
    """Return unit directions (n, 3) of bars by slope and tilt (n,)."""
    across = np.cos(tilt_rad)
    return np.stack(
        [np.sin(tilt_rad), across * np.sin(slope_rad), across * np.cos(slope_rad)], axis=-1
    )
