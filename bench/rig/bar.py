"""The straight bar, and where a whisker first touches an object."""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy import optimize

from bench.rig.elastic_rod import Rod
from bench.rig.linear import across, rotate_about_z
from bench.rig.touched_object import LocalBar, TouchedObject

# [lengths] Largest distance from contact that is a touch, and residual along the whisker. Stated.
_TOUCHES = 1e-11
# [rad] Before first touch, where the surfaces are apart: 0.1 µm at 10 mm. Stated.
_BEFORE_RAD = 1e-5


@dataclass(frozen=True)
class TouchedBar(TouchedObject):
    """A straight round bar about the axis through `point_mm`; the axis' z is positive."""

    shape = "bar"
    is_straight = True

    @classmethod
    def at_contact(
        cls,
        *,
        d_x_mm: float,
        beta_rad: float,
        psi_rad: float,
        touch_rad: float,
        radius_mm: float,
        whisker_radius_mm: float,
        stiffness_N_mm: float = math.inf,
    ) -> Self:
        """Make the bar that a straight whisker at motor angle `touch_rad` just touches at
        `d_x_mm`."""
        upright = math.cos(psi_rad)
        axis = np.array(
            [math.sin(psi_rad), upright * math.sin(beta_rad), upright * math.cos(beta_rad)]
        )
        towards_whisker = np.array([0.0, -math.cos(beta_rad), math.sin(beta_rad)])
        point = np.array([d_x_mm, 0.0, 0.0]) - (radius_mm + whisker_radius_mm) * towards_whisker
        return cls(
            rotate_about_z(point, touch_rad),
            rotate_about_z(axis, touch_rad),
            radius_mm,
            stiffness_N_mm,
        )

    @classmethod
    def from_trial(cls, bar: Self, touched_mm: np.ndarray, table: object) -> Self:
        """Return the bar itself."""
        return bar

    def in_frame(self, pose: np.ndarray) -> Self:
        """Return the bar in the frame of a pose (3, 4), T_rig_frame, its axis' z positive."""
        bar = super().in_frame(pose)
        return bar if bar.axis[2] >= 0 else replace(bar, axis=-bar.axis)

    def foot_mm(self, point_mm: np.ndarray) -> np.ndarray:
        """Return the axis' points nearest to points (..., 3)."""
        return self.point_mm + np.multiply.outer((point_mm - self.point_mm) @ self.axis, self.axis)

    def local_bar(self, point_mm: np.ndarray) -> LocalBar:
        """Return the bar itself, which is the same wherever it is touched."""
        projection = across(self.axis)
        offset_mm = projection @ (point_mm - self.point_mm)
        return LocalBar(offset_mm, projection, self.axis, np.zeros((3, 3)))


@dataclass(frozen=True)
class UnloadedTouch:
    """First touch of the unloaded whisker: motor angle, arc length, and contact point P0 (3,) in
    the rig frame."""

    motor_rad: float
    arc_mm: float
    point_mm: np.ndarray

    @property
    def d_x_mm(self) -> float:
        """Return the radial distance |P0|."""
        return float(np.linalg.norm(self.point_mm))


def unloaded_curve(
    rod: Rod, motor_rad: float, arc_mm: float | np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return points and tangents, each (..., 3), of the unloaded whisker in the rig frame."""
    points = rotate_about_z(rod.rest.point_mm(arc_mm), motor_rad)
    return points, rotate_about_z(rod.rest.tangent(arc_mm), motor_rad)


def find_first_touch(
    rod: Rod, bar: TouchedObject, motor_rad: float, arc_mm: float
) -> UnloadedTouch:
    """Find the first touch near a guess: where the whisker's surface is nearest, the centreline at a
    distance of both radii.

    Where the nearest point lies beyond the end, the tip touches and the arc is the length. Raises
    ArithmeticError where the whisker never touches, or only as it leaves the object on its far side.
    """
    length_mm = rod.length_mm
    start = [motor_rad, min(arc_mm / length_mm, 1.0)]
    found = optimize.root(
        lambda at: _touch_residual(rod, bar, at[0], at[1] * length_mm) / length_mm, start, tol=1e-13
    )
    before_mm = _touch_residual(rod, bar, found.x[0] - _BEFORE_RAD, found.x[1] * length_mm)[0]
    if np.abs(found.fun).max() > _TOUCHES or before_mm < -_TOUCHES * length_mm:
        raise ArithmeticError("the whisker never touches the bar")
    motor_rad = found.x[0]
    arc_mm = found.x[1] * length_mm
    if arc_mm > rod.length_mm:
        arc_mm = rod.length_mm
        motor_rad = _find_tip_touch(rod, bar, motor_rad)
    return UnloadedTouch(motor_rad, arc_mm, unloaded_curve(rod, motor_rad, arc_mm)[0])


def _touch_residual(rod, bar, motor_rad, arc_mm):
    """Return the gap between the surfaces and the distance from the nearest point, (2,) mm."""
    point, tangent = unloaded_curve(rod, motor_rad, arc_mm)
    gap_mm = bar.outside_mm(point) - rod.radius_mm(arc_mm)
    away = point - bar.foot_mm(point)
    return np.array([gap_mm, away @ tangent - rod.taper_at(arc_mm) * np.linalg.norm(away)])


def _find_tip_touch(rod, bar, motor_rad):
    """Find the motor angle at which the tip touches."""
    try:
        return optimize.newton(
            lambda angle: _touch_residual(rod, bar, angle, rod.length_mm)[0], motor_rad, tol=1e-12
        )
    except RuntimeError:
        raise ArithmeticError("the whisker never touches the bar") from None
