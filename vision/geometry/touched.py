"""What the whisker touches: the interface of every form of object, and of the place where it stands.

`Touched` is an object as it is stated: its form and its sizes. It says which parameters it adds to
a fit, and how it is made from what a manifest states. `Axis` is where an object stands: what a
search finds and a fit moves, and where distances and outlines are computed. A straight bar is
`vision.geometry.rods.Bar`, with its `vision.geometry.contact.BarAxis`. All others derive from
`vision.geometry.rounded.Rounded` and share `vision.geometry.rounded.RoundedAxis`. The forms by name
are in `vision.geometry.forms`. What an object needs besides geometry is chosen by its class: its
search in `vision.touched.search`, the residuals of its line points in `vision.fit.object_rows`, how
its edges are read in `vision.truth.strategies`, and its record in `vision.truth.truth_rows`.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from vision.geometry.camera import Camera
from vision.geometry.checks import require_length, require_sigma
from vision.geometry.rotation import unit


@dataclass(frozen=True)
class StatedSizes:
    """The sizes of an object as a manifest states them, 0 where it states none.

    diameter_mm: thickness, of a cone about where it is touched. ring_diameter_mm: along the middle
    of a ring's bar.
    """

    diameter_mm: float = 0.0
    diameter_sigma_mm: float = 0.0
    ring_diameter_mm: float = 0.0
    half_angle_rad: float = 0.0


class Touched(ABC):
    """An object that the whisker touches, as it is stated: its form and its sizes.

    name: the form's, as manifests have it. may_move: whether it is found while it moves or gives
    way. along_sigma_mm: prior sigmas of its shift along its axis, where its outline determines
    that. outline_sigma_px: prior sigmas of the error with which one camera reads its outline too
    far out, where its size determines that.
    """

    name: ClassVar[str]
    may_move: ClassVar[bool]
    along_sigma_mm: ClassVar[tuple[float, ...]]
    outline_sigma_px: ClassVar[tuple[float, ...]]
    diameter_mm: float
    diameter_sigma_mm: float

    @property
    def radius_mm(self) -> float:
        """Return half the diameter."""
        return 0.5 * self.diameter_mm

    @classmethod
    @abstractmethod
    def from_sizes(cls, stated: StatedSizes) -> Self:
        """Return the object of stated sizes. Raises Refused where it cannot have them."""

    @property
    @abstractmethod
    def sizes(self) -> StatedSizes:
        """Return the sizes, as `from_sizes` takes them."""

    @property
    @abstractmethod
    def label(self) -> str:
        """Return the form with its size, for a message."""


@dataclass(frozen=True)
class OneDiameter(Touched):
    """An object whose only size is its diameter. Refused where that is no length."""

    diameter_mm: float
    diameter_sigma_mm: float = 0.0

    def __post_init__(self):
        """Raise Refused where there is no such object."""
        require_length("bar", diameter_mm=self.diameter_mm)
        require_sigma("bar", diameter_sigma_mm=self.diameter_sigma_mm)

    @classmethod
    def from_sizes(cls, stated: StatedSizes) -> Self:
        """Return the object of a stated diameter. Raises Refused where there is none."""
        return cls(stated.diameter_mm, stated.diameter_sigma_mm)

    @property
    def sizes(self) -> StatedSizes:
        """Return the diameter and its sigma."""
        return StatedSizes(self.diameter_mm, self.diameter_sigma_mm)


class Axis(ABC):
    """Where an object stands in the rig frame, whatever its thickness; a batch has (..., 3).

    point_mm (..., 3): a point of it. direction (..., 3): unit.
    """

    point_mm: np.ndarray
    direction: np.ndarray

    newton_steps: ClassVar[int]  # that `closest_arc` needs from nearby

    @abstractmethod
    def upward(self) -> "Axis":
        """Return the same place with that of its directions which slopes are counted along."""

    @abstractmethod
    def bar_at(self, points_mm: np.ndarray) -> "Axis":
        """Return the straight bars that contacts at points (..., 3) act on."""

    @abstractmethod
    def as_bar(self) -> "Axis":
        """Return the straight bar that stands for the object where it is touched, to be drawn."""

    @abstractmethod
    def nearest(self, points_mm: np.ndarray) -> np.ndarray:
        """Return which (...) of points (..., k, 3) is nearest to the object."""

    @abstractmethod
    def newton_step(
        self, points_mm: np.ndarray, tangents: np.ndarray, growth: np.ndarray | float = 0.0
    ) -> np.ndarray:
        """Return Newton's steps (..., k), mm, along curves to where their surface is nearest.

        points_mm (..., k, 3): on the curves. tangents (..., k, 3): there, of about unit length.
        growth (..., k): change of the radius about a curve per arc length.
        """

    @abstractmethod
    def distance_mm(self, points_mm: np.ndarray, tangents: np.ndarray) -> np.ndarray:
        """Return the distances (...) of curves at their nearest points (..., 3), with tangents."""

    @abstractmethod
    def covering_discs(self, camera: Camera, radius_mm: float) -> tuple[np.ndarray, np.ndarray]:
        """Return middles (m, 2) and radii (m,) px of discs that cover the object in a picture."""

    @abstractmethod
    def edges_px(
        self, camera: Camera, radius_mm: float, reach_mm: float, stations: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return both sides (stations, 2) px of the outline, to be drawn.

        reach_mm: how far to either side of where the object is touched.
        """

    def points_at(self, place_mm: ArrayLike) -> np.ndarray:
        """Return the points (..., k, 3), mm, at places (k,) along the axis, counted from its point."""
        steps_mm = np.asarray(place_mm)[..., None] * self.direction[..., None, :]
        return self.point_mm[..., None, :] + steps_mm

    def shifted(
        self, across: np.ndarray, vector: np.ndarray, along_mm: np.ndarray | float = 0.0
    ) -> Self:
        """Return the object moved by two shifts in mm and two tilts across its axis, and along it.

        vector (..., 4 or more), along_mm (..., 1): more than one give a batch. across (2, 3): see
        `vision.geometry.contact.axis_frame`.
        """
        moved_mm = self.point_mm + vector[..., 0:2] @ across
        return replace(
            self,
            point_mm=moved_mm + along_mm * self.direction,
            direction=unit(self.direction + vector[..., 2:4] @ across),
        )
