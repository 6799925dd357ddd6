"""The round bar that the whisker is pushed against, and where a whisker first touches it."""

import math
from dataclasses import dataclass, replace

import numpy as np

from bench.rig.elastic_rod import Rod


def turned(vectors: np.ndarray, angle_rad: float) -> np.ndarray:
    """Vectors (..., 3) turned about the rotation axis z."""
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    x, y, z = np.moveaxis(np.asarray(vectors, float), -1, 0)
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], -1)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product of two vectors; numpy's own takes ten times as long for one pair."""
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def cross_matrix(a: np.ndarray) -> np.ndarray:
    """The matrix (3, 3) that makes of a vector its cross product with this one from the left."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


_STRAIGHT = np.zeros((3, 3))  # how the axis of a straight bar turns


@dataclass(frozen=True)
class Bar:
    """A round bar in the rig frame: a point of its axis, the axis' unit direction (its z positive), its radius, and how
    stiff its surface is: it gives way by force over stiffness, along its normal, where the whisker presses.

    velocity_mm_rad (3,): of a bar that moves, per radian of the motor's steady way; it is at its point at first touch,
    motor angle touch_rad. None: it stands.
    """

    point_mm: np.ndarray
    axis: np.ndarray
    radius_mm: float
    stiffness_N_mm: float = math.inf
    velocity_mm_rad: np.ndarray | None = None
    touch_rad: float = 0.0

    @classmethod
    def placed(
        cls,
        *,
        d_x_mm: float,
        beta_rad: float,
        psi_rad: float,
        touch_rad: float,
        radius_mm: float,
        whisker_radius_mm: float,
        stiffness_N_mm: float = math.inf,
    ) -> "Bar":
        """The bar that a straight whisker at motor angle `touch_rad` would just touch at `d_x_mm`."""
        axis = np.array(
            [
                math.sin(psi_rad),
                math.cos(psi_rad) * math.sin(beta_rad),
                math.cos(psi_rad) * math.cos(beta_rad),
            ]
        )
        towards_whisker = np.array([0.0, -math.cos(beta_rad), math.sin(beta_rad)])
        point = np.array([d_x_mm, 0.0, 0.0]) - (radius_mm + whisker_radius_mm) * towards_whisker
        return cls(turned(point, touch_rad), turned(axis, touch_rad), radius_mm, stiffness_N_mm)

    def seen_from(self, pose: np.ndarray) -> "Bar":
        """The same bar in the frame of a pose (3, 4), T_rig_base, in which its axis' z is positive too."""
        axis = pose[:, :3].T @ self.axis
        point = pose[:, :3].T @ (self.point_mm - pose[:, 3])
        return replace(self, point_mm=point, axis=axis if axis[2] >= 0 else -axis)

    def moving(self, velocity_mm_rad: np.ndarray, touch_rad: float) -> "Bar":
        """The bar as one that moves."""
        return replace(
            self, velocity_mm_rad=np.asarray(velocity_mm_rad, float), touch_rad=touch_rad
        )

    def moved_mm(self, motor_rad: float | np.ndarray) -> np.ndarray:
        """How far (..., 3) a bar that moves has come since first touch, at motor angles."""
        since = np.asarray(motor_rad, float)[..., None] - self.touch_rad
        return since * (np.zeros(3) if self.velocity_mm_rad is None else self.velocity_mm_rad)

    def at(self, motor_rad: float) -> "Bar":
        """The bar where it is at a motor angle, standing."""
        if self.velocity_mm_rad is None:
            return self
        return replace(
            self, point_mm=self.point_mm + self.moved_mm(motor_rad), velocity_mm_rad=None
        )

    def given(self, gave_mm: np.ndarray) -> "Bar":
        """The bar that has given way by so much (3,)."""
        return replace(self, point_mm=self.point_mm + gave_mm)

    def foot_mm(self, point_mm: np.ndarray) -> np.ndarray:
        """The axis' points nearest to points (..., 3)."""
        return self.point_mm + np.multiply.outer((point_mm - self.point_mm) @ self.axis, self.axis)

    def outside_mm(self, point_mm: np.ndarray) -> np.ndarray:
        """How far points (..., 3) are outside of the surface, negative within."""
        apart = point_mm - self.foot_mm(point_mm)
        return np.linalg.norm(apart, axis=-1 if apart.ndim > 1 else None) - self.radius_mm

    def around(self, point_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """What a contact at a point (3,) sees: the way there (3,) from the axis' nearest point, and its derivative by
        the point, (3, 3); the axis' direction there (3,), and its derivative (3, 3)."""
        flat = np.eye(3) - np.outer(self.axis, self.axis)
        return flat @ (point_mm - self.point_mm), flat, self.axis, _STRAIGHT

    def axis_at(self, point_mm: np.ndarray) -> np.ndarray:
        """The axis' direction (3,) nearest to a point (3,), its z positive."""
        return self.around(point_mm)[2]

    def slope(self, touch_rad: float, point_mm: np.ndarray | None = None) -> tuple[float, float]:
        """(β, ψ) in the contact frame, as in the conventions: β = atan2(a_y, a_z), ψ = asin(a_x). point_mm: where it is
        touched; a straight bar leans alike everywhere."""
        x, y, z = turned(self.axis if point_mm is None else self.axis_at(point_mm), -touch_rad)
        return math.atan2(y, z), math.asin(x)


@dataclass(frozen=True)
class Touch:
    """First touch of the unloaded whisker: motor angle, arc length and the contact point P0 in the rig frame."""

    motor_rad: float
    arc_mm: float
    point_mm: np.ndarray

    @property
    def d_x_mm(self) -> float:
        """|P0|, the radial distance."""
        return float(np.linalg.norm(self.point_mm))


def unloaded(
    rod: Rod, motor_rad: float, arc_mm: float | np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points and tangents of the unloaded whisker in the rig frame, each (..., 3)."""
    arc = np.asarray(arc_mm, float)
    along = np.stack([arc, 0 * arc, 0 * arc], -1)
    tangent = np.array([1.0, 0, 0]) + rod.rest.slope(arc)
    return turned(along + rod.rest.offset_mm(arc), motor_rad), turned(tangent, motor_rad)


def first_touch(rod: Rod, bar: Bar, motor_rad: float, arc_mm: float) -> Touch:
    """Newton's method from a guess for: nearest point of the centreline, at a distance of both radii.

    Where the nearest point lies beyond the end, the tip touches and the arc is the length. Raises ArithmeticError where
    the whisker never touches.
    """
    at = np.array([motor_rad, min(arc_mm, rod.length_mm)])
    for _ in range(30):
        residual = _gap(rod, bar, at)
        jacobian = np.stack(
            [
                (_gap(rod, bar, at + h) - _gap(rod, bar, at - h)) / 2e-6
                for h in (np.array([1e-6, 0]), np.array([0, 1e-6]))
            ],
            -1,
        )
        step = np.linalg.solve(jacobian, residual)
        at = at - step
        if abs(step[0]) < 1e-13 and abs(step[1]) < 1e-10:
            break
    else:
        raise ArithmeticError("the whisker never touches the bar")
    if at[1] > rod.length_mm:
        return _tip_touch(rod, bar, at[0])
    return Touch(at[0], at[1], unloaded(rod, at[0], at[1])[0])


def _gap(rod, bar, at):
    point, tangent = unloaded(rod, at[0], at[1])
    apart = point - bar.foot_mm(point)
    return np.array([bar.outside_mm(point) - rod.radius_mm(at[1]), apart @ tangent])


def _tip_touch(rod, bar, motor_rad):
    length = rod.length_mm
    for _ in range(30):
        gap = [_gap(rod, bar, (motor_rad + h, length))[0] for h in (0, 1e-6)]
        step = gap[0] / ((gap[1] - gap[0]) / 1e-6)
        motor_rad -= step
        if abs(step) < 1e-10:
            return Touch(motor_rad, length, unloaded(rod, motor_rad, length)[0])
    raise ArithmeticError("the whisker never touches the bar")
