"""A cone: balls that grow in proportion to their distance from its tip."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from vision.geometry.checks import require
from vision.geometry.rounded import (
    AboutAxis,
    Balls,
    FreeNumber,
    Local,
    Rounded,
    RoundedAxis,
    upwards,
)
from vision.geometry.touched import StatedSizes

# [mm] Of a cone: nearer to its tip its two edges are one, 2 px apart. Stated.
_LEAST_RADIUS_MM = 0.3
# [mm] How thick a cone may be where it is touched. Study: rounded_seen.py.
_RADII_MM = np.array([3.0, 6.0, 12.0, 24.0])
# [1] How thick, over what is stated of it. Study: rounded_seen.py.
_ABOUT = np.array([0.6, 1.0, 1.7])


@dataclass(frozen=True)
class Cone(Rounded):
    """A cone; it has no thickness of its own. Refused where its half-angle is none.

    about_mm: about how thick it is, across its surface, where it is touched (0: not stated).
    """

    half_angle_rad: float
    about_mm: float = 0.0

    name: ClassVar[str] = "cone"
    search_reach_mm: ClassVar[float] = 20.0
    diameter_mm: ClassVar[float] = 0.0
    diameter_sigma_mm: ClassVar[float] = 0.0

    def __post_init__(self):
        """Raise Refused where there is no such cone."""
        require(
            0.0 < self.half_angle_rad < 0.5 * np.pi,
            f"cone half_angle_rad {self.half_angle_rad:g}: 0 to pi/2",
        )

    @classmethod
    def from_sizes(cls, stated: StatedSizes) -> "Cone":
        """Return the cone of a stated half-angle. Raises Refused where there is none."""
        return cls(stated.half_angle_rad, stated.diameter_mm)

    @property
    def sizes(self) -> StatedSizes:
        """Return the half-angle, and about how thick the cone is where it is touched."""
        return StatedSizes(self.about_mm, half_angle_rad=self.half_angle_rad)

    @property
    def label(self) -> str:
        """Return the cone with its half-angle, for a message."""
        return f"cone of {np.degrees(self.half_angle_rad):g} deg half-angle"

    def near(self, at: RoundedAxis, points_mm: np.ndarray) -> Local:
        """Return the cone as a bar near points (..., k, 3): along its surface to the tip."""
        sin = np.sin(self.half_angle_rad)
        cos = np.cos(self.half_angle_rad)
        axis = at.direction[..., None, :]
        place = AboutAxis.of(at, points_mm)
        down = place.radius_mm * sin / cos - place.height_mm  # from the tip to the foot
        along_surface = upwards(cos * axis - sin * place.outward)
        foot = at.point_mm[..., None, :] - down * axis
        return Local(foot, along_surface, (down * sin)[..., 0])

    def follows(self, at: RoundedAxis, local: Local, away: np.ndarray) -> float:
        """Return 1: the middle is straight."""
        return 1.0

    def balls(self, at: RoundedAxis, radius_mm: float, reach_mm: float, stations: int) -> Balls:
        """Return the balls near where the cone is touched; their radii shrink towards its tip."""
        point = at.point_mm[..., None, :]
        axis = at.direction[..., None, :]
        sin = np.sin(self.half_angle_rad)
        from_tip = point - at.spot_foot_mm
        spot_down = np.sum(from_tip * axis, axis=-1, keepdims=True)
        nearest = np.maximum(spot_down - reach_mm, _LEAST_RADIUS_MM / sin)
        farthest = np.maximum(spot_down, nearest) + reach_mm
        share = np.linspace(0.0, 1.0, stations)[:, None]
        down = nearest + share * (farthest - nearest)
        middle = point - down * axis
        return Balls(middle, np.broadcast_to(axis, middle.shape), down * sin, -sin)

    def free_numbers(self) -> list[FreeNumber]:
        """Return the log of the radius, mm, where the cone is touched, and its tip's side, ±1."""
        radii_mm = 0.5 * self.about_mm * _ABOUT if self.about_mm else _RADII_MM
        return [
            FreeNumber(np.log(radii_mm)),
            FreeNumber(np.array([-1.0, 1.0]), is_choice=True),
        ]

    def at_contact(
        self, spot_mm: np.ndarray, inwards: np.ndarray, along: np.ndarray, free: np.ndarray
    ) -> RoundedAxis:
        """Return where cones stand that are touched at spots (n, 3).

        free (n, 2): log of the radius there, mm, and on which side the tip is.
        """
        radius = np.exp(free[:, :1])
        side = np.sign(free[:, 1:])
        sin = np.sin(self.half_angle_rad)
        cos = np.cos(self.half_angle_rad)
        point = spot_mm + radius * cos / sin * side * along
        return RoundedAxis(point, cos * side * along - sin * inwards, self, spot_mm)
