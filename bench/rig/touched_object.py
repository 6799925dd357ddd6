"""The interface of what the whisker is pushed against: a straight bar, a ring, a sphere or a cone.

To a contact each of them is a round bar whose axis turns as the contact moves over the surface.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Self

import numpy as np

from bench.rig.linear import rotate_about_z

if TYPE_CHECKING:
    from bench.rig.bar import TouchedBar
    from bench.rig.protocol_tables import TrialTable


class LocalBar(NamedTuple):
    """The round bar that a contact at a point meets.

    offset_mm (3,): from the axis' nearest point to the point; offset_by (3, 3): its derivative by
    the point. axis (3,): unit direction of the axis there, z positive; axis_by (3, 3): its
    derivative by the point.
    """

    offset_mm: np.ndarray
    offset_by: np.ndarray
    axis: np.ndarray
    axis_by: np.ndarray


@dataclass(frozen=True)
class TouchedObject(ABC):
    """An object in the rig frame.

    point_mm (3,): where it stands. axis (3,): unit direction. radius_mm: of its surface about the
    axis that a contact meets. stiffness_N_mm: the surface yields along its normal by force over
    stiffness.
    velocity_mm_rad (3,): of an object that moves, per radian of the motor's steady motion; it is
    at point_mm at the motor angle touch_rad. None where it stands still.
    """

    shape: ClassVar[str]
    is_straight: ClassVar[bool] = False

    point_mm: np.ndarray
    axis: np.ndarray
    radius_mm: float
    stiffness_N_mm: float = math.inf
    velocity_mm_rad: np.ndarray | None = None
    touch_rad: float = 0.0

    @classmethod
    @abstractmethod
    def from_trial(cls, bar: "TouchedBar", touched_mm: np.ndarray, table: "TrialTable") -> Self:
        """Make the object that a whisker touches where it would touch a bar, with the same slope.

        touched_mm (3,): the point of contact. table: holds the sizes that a bar does not have.
        """

    @abstractmethod
    def foot_mm(self, point_mm: np.ndarray) -> np.ndarray:
        """Return the axis' points nearest to points (..., 3)."""

    @abstractmethod
    def local_bar(self, point_mm: np.ndarray) -> LocalBar:
        """Return the round bar that a contact at a point (3,) meets."""

    def place_keys(self) -> dict:
        """Return the keys of [object] that say where it stands."""
        return {"point_mm": self.point_mm.tolist(), "axis": self.axis.tolist()}

    def size_keys(self) -> dict:
        """Return the keys of [object] that say how large it is, beyond its diameter."""
        return {}

    def support_mm(self) -> np.ndarray:
        """Return the point (3,) at which a rod holds the object."""
        return self.point_mm

    def in_frame(self, pose: np.ndarray) -> Self:
        """Return the object in the frame of a pose (3, 4), T_rig_frame."""
        rotation = pose[:, :3]
        point = rotation.T @ (self.point_mm - pose[:, 3])
        return replace(self, point_mm=point, axis=rotation.T @ self.axis)

    def shift(self, by_mm: np.ndarray) -> Self:
        """Return the object displaced by (3,) and standing still there."""
        return replace(self, point_mm=self.point_mm + by_mm, velocity_mm_rad=None)

    def moved_mm(self, motor_rad: float | np.ndarray) -> np.ndarray:
        """Return how far (..., 3) the object has moved since first touch, at motor angles."""
        since_rad = np.asarray(motor_rad, float)[..., None] - self.touch_rad
        return since_rad * (np.zeros(3) if self.velocity_mm_rad is None else self.velocity_mm_rad)

    def at(self, motor_rad: float) -> Self:
        """Return the object where it is at a motor angle, standing still there."""
        return self if self.velocity_mm_rad is None else self.shift(self.moved_mm(motor_rad))

    def outside_mm(self, point_mm: np.ndarray) -> np.ndarray:
        """Return how far points (..., 3) are outside of the surface, negative within."""
        return np.linalg.norm(point_mm - self.foot_mm(point_mm), axis=-1) - self.radius_mm

    def axis_at(self, point_mm: np.ndarray) -> np.ndarray:
        """Return the axis' unit direction (3,) nearest to a point (3,), its z positive."""
        return self.local_bar(point_mm).axis

    def slope(self, touch_rad: float, point_mm: np.ndarray) -> tuple[float, float]:
        """Return (β, ψ), rad, at a point (3,) of contact: β = atan2(a_y, a_z), ψ = asin(a_x) for
        the axis a in the contact frame."""
        x, y, z = rotate_about_z(self.axis_at(point_mm), -touch_rad)
        return math.atan2(y, z), math.asin(x)
