"""Find where a sphere or a cone may be: places whose silhouettes stand out in all cameras at once.

The score of a place is the mean edge strength along both sides of its silhouette (see
`vision.touched.edge_map`), the geometric mean of both, averaged over the cameras.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from vision.geometry.rotation import unit
from vision.geometry.rounded import RoundedAxis
from vision.pictures.change import HALF
from vision.touched.edge_map import EdgeMap
from vision.touched.grid_search import ObjectScore, SearchPass
from vision.touched.places import PlaceGrid, Places
from vision.touched.search_scene import SearchScene

# [half-widths] Blur of the edge maps, pass by pass. By 1.4 times as much a cone's d_x moves by 6
# sigma; by 0.7 times as much another place is taken, 52 sigma away. Study: thresholds.py
# touched.silhouette_score _BLURS … --sessions FOLDER.
_BLURS = (0.5, 0.2, 0.08)
# [places] That each pass keeps. By half or twice as many a cone loses its truth. Study:
# thresholds.py touched.silhouette_score _KEPT … --sessions FOLDER.
_KEPT = (24, 20, 12)
# [places] Of the grid that go on. 16 or 64 move no cone. Study: thresholds.py
# touched.silhouette_score _STARTS … --sessions FOLDER.
_STARTS = 32
# [steps] Least separation of two places of the grid. Study: rounded_seen.py.
_SEPARATION = 4.0
# [points] Of each side of a silhouette along which edges are read. Stated.
_STATIONS = 8
# [mm] From a silhouette outwards, to a point that gives its normal in the picture. Stated.
_OUTWARDS_MM = 0.2
# [1] Least edge strength of a camera in a geometric mean over cameras. Stated.
_LEAST_STRENGTH = 1e-3
# [rad] Slopes of the grid, as of a bar's. Stated.
_BETA_RAD = np.radians(np.arange(-78.0, 79.0, 6.0))
# [mm] Step of the grid along the whisker: less than the blur. Stated.
_X_MM = 2.4
# [mm] Step of the grid along the arc of the whisker's middle: less than the blur. Stated.
_TOUCH_MM = 2.4
# [places] Evaluated together: arrays stay in the processor's cache. No result depends on it.
# Derived.
_BATCH = 4000


def find_silhouettes(edge_maps: Sequence[EdgeMap], scene: SearchScene) -> list[RoundedAxis]:
    """Find the places whose silhouettes have the strongest edges, the best first."""

    def passes_of(places_of: Places) -> list[SearchPass]:
        """Return the passes, on edge maps that are blurred less and less."""
        passes = []
        for blur, kept in zip(_BLURS, _KEPT):
            blurred = [one.blurred(blur) for one in edge_maps]
            score = SilhouetteScore(places_of, blurred, scene.radius_mm)
            passes.append(SearchPass(score, blur / _BLURS[0], 1.0, kept))
        return passes

    grid = PlaceGrid(_X_MM, _TOUCH_MM, _BETA_RAD, _STARTS, _SEPARATION)
    return grid.search(scene, passes_of)


@dataclass(frozen=True)
class SilhouetteScore(ObjectScore):
    """Score of places from 0 to 1: edge strength along both sides of their silhouettes."""

    edge_maps: Sequence[EdgeMap]
    radius_mm: float

    batch: ClassVar[int] = _BATCH

    def of_objects(self, objects: RoundedAxis) -> np.ndarray:
        """Return the scores (n,): means of cameras, geometric where one has no silhouette."""
        strength = np.array([self.both_sides(objects, one) for one in self.edge_maps])
        has_silhouette = np.isfinite(strength)  # (cameras, n)
        if np.all(has_silhouette):
            return np.mean(strength, axis=0)
        logs = np.where(has_silhouette, np.log(np.maximum(strength, _LEAST_STRENGTH)), 0.0)
        count = np.sum(has_silhouette, axis=0)
        mean = np.sum(logs, axis=0) / np.maximum(count, 1)
        return np.where(count > 0, np.exp(mean), 0.0)

    def both_sides(self, objects: RoundedAxis, edges: EdgeMap) -> np.ndarray:
        """Compute the strength (n,) of both sides in one camera.

        It is their geometric mean, NaN where there is no silhouette.
        """
        centre_mm = edges.camera.centre_mm
        reach_mm = objects.form.search_reach_mm
        silhouette, normals = objects.silhouette(centre_mm, self.radius_mm, reach_mm, _STATIONS)
        strength = _strength_along(edges, silhouette, normals)  # (n, 2, stations)
        strength[~np.isfinite(silhouette[..., 0])] = np.nan
        sides = np.mean(strength, axis=-1)
        return np.sqrt(np.prod(sides, axis=-1))


def _strength_along(edges: EdgeMap, points_mm: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the strength (...) of edges along an outline, by points (..., 3) of the surface there.

    normals (..., 3): of the surface, which project to those of its outline.
    """
    outside_mm = points_mm + _OUTWARDS_MM * normals
    px, outside_px = edges.camera.project(np.stack([points_mm, outside_mm])) / HALF
    normal_px = unit(outside_px - px)
    return edges.strength_across(np.nan_to_num(px), np.nan_to_num(normal_px))
