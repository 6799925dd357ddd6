"""A sphere: a single ball."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from vision.geometry.rotation import turned_about, unit
from vision.geometry.rounded import Balls, Local, Rounded, RoundedAxis
from vision.geometry.touched import OneDiameter

# [—] A layout: the direction along which slopes count.
_UP = np.array([0.0, 0.0, 1.0])
# [1] Added to the upright, so that no sight is parallel to it. Stated.
_SKEWED = 0.01


@dataclass(frozen=True)
class Sphere(OneDiameter, Rounded):
    """A sphere of so many mm. Refused where that is no length."""

    name: ClassVar[str] = "sphere"
    search_reach_mm: ClassVar[float] = 30.0

    @property
    def label(self) -> str:
        """Return the sphere with its diameter, for a message."""
        return f"sphere of {self.diameter_mm:g} mm"

    def near(self, at: RoundedAxis, points_mm: np.ndarray) -> Local:
        """Return the sphere as a bar near points (..., k, 3): along the steepest way there."""
        centre = at.point_mm[..., None, :]
        apart = points_mm - centre
        normal = unit(apart)
        upright = unit(_UP - normal[..., 2:] * normal)
        return Local(np.broadcast_to(centre, apart.shape), upright, np.zeros(apart.shape[:-1]))

    def follows(self, at: RoundedAxis, local: Local, away: np.ndarray) -> float:
        """Return 0: the centre is nearest to all points."""
        return 0.0

    def balls(self, at: RoundedAxis, radius_mm: float, reach_mm: float, stations: int) -> Balls:
        """Return the one ball."""
        centre = at.point_mm[..., None, :]
        ahead = at.direction[..., None, :]
        return Balls(centre, ahead, np.full((*centre.shape[:-1], 1), radius_mm), 0.0)

    def silhouette(
        self,
        at: RoundedAxis,
        centre_mm: np.ndarray,
        radius_mm: float,
        reach_mm: float,
        stations: int,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compute where sights graze the sphere: a circle in two halves, whatever the reach."""
        middle = at.point_mm[..., None, :]
        sight = middle - centre_mm
        ahead = unit(sight)
        right = unit(np.cross(ahead, _UP + _SKEWED))
        turn = ((np.arange(2 * stations) + 0.5) * np.pi / stations)[:, None]
        ring = turned_about(ahead, right, turn)
        cosine = radius_mm / np.linalg.norm(sight, axis=-1, keepdims=True)
        normals = -cosine * ahead + np.sqrt(1.0 - cosine**2) * ring
        normals = normals.reshape(*normals.shape[:-2], 2, stations, 3)
        return middle[..., None, :] + radius_mm * normals, normals

    def covering_discs(self, edges_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return one disc (1, 2), (1,) px for all of the silhouette (2, m, 2)."""
        return super().covering_discs(edges_px.reshape(-1, 1, 2))

    def at_contact(
        self, spot_mm: np.ndarray, inwards: np.ndarray, along: np.ndarray, free: np.ndarray
    ) -> RoundedAxis:
        """Return where spheres stand that are touched at spots (n, 3); nothing is free."""
        return RoundedAxis(spot_mm + self.radius_mm * inwards, along, self, spot_mm)
