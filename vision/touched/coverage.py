"""Where a ring may be in space, before any wire is known: by what it covers in all cameras.

The edges near the contact determine neither the ring's plane nor its centre, and a tube has
highlights and rims whose edges are as strong as its own. So the whole ring is used: a map of each
camera says how surely every pixel differs from the picture without rods. Just within the ring's
outer silhouette, which no part of it hides, the picture must differ, and just beyond it must not.
The score of a ring is the difference of these, in the camera where it is lowest. The search
(`vision.touched.places`) reads maps that are blurred less and less.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import cv2
import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.rounded import RoundedAxis
from vision.pictures.change import HALF, change_confidence
from vision.pictures.view import View
from vision.touched.grid_search import ObjectScore, SearchPass
from vision.touched.places import PlaceGrid, Places
from vision.touched.search_scene import SearchScene

# [px] Blur of the maps, pass by pass. By the first two alone, or 7, 3.5 and 1.5, a ring's slope
# moves by 1.2 sigma. Study: thresholds.py touched.coverage _BLURS_PX … --sessions FOLDER.
_BLURS_PX = (5.0, 2.5, 1.0)
# [places] That each pass keeps. Half or twice as many move no ring. Study: thresholds.py
# touched.coverage _KEPT … --sessions FOLDER.
_KEPT = (24, 12, 8)
# [points] Of a silhouette, pass by pass. By half as many a ring's slope moves by 1.4 sigma. Study:
# thresholds.py touched.coverage _STATIONS … --sessions FOLDER.
_STATIONS = (24, 32, 48)
# [places] Of the grid that go on. Half or twice as many move no ring. Study: thresholds.py
# touched.coverage _STARTS … --sessions FOLDER.
_STARTS = 64
# [steps] Least separation of two places of the grid. By 1 a ring's d_x moves by 0.7 sigma, by 4
# nothing. Study: thresholds.py touched.coverage _SEPARATION … --sessions FOLDER.
_SEPARATION = 2.0
# [rad] Slopes of the grid. Stated.
_BETA_RAD = np.radians(np.arange(-70.0, 71.0, 10.0))
# [mm] Step of the grid along the whisker: about the tube's radius. Stated.
_X_MM = 3.0
# [mm] Step of the grid along the arc of the whisker's middle: about the tube's radius. Stated.
_TOUCH_MM = 4.0
# [radii] From a silhouette outwards, where the map is read: two places within it, two beyond. By
# three quarters of it within and 1.3 times as much beyond, a ring's slope moves by 0.5 sigma.
# Study: thresholds.py touched.coverage _OUTWARDS … --sessions FOLDER.
_OUTWARDS = np.array([-1.2, -0.6, 0.35, 0.9])
# [places] Of these that lie within. A layout.
_WITHIN = 2
# [1] Weight of what differs beyond a silhouette, over that within: another thing may hide a ring,
# and adds nothing to it. By 1 or 2.2 a ring's slope moves by 0.3 sigma. Study: thresholds.py
# touched.coverage _BEYOND … --sessions FOLDER.
_BEYOND = 1.5
# [1] Share of a silhouette in the picture: what is outside speaks neither for nor against a ring,
# but a smaller share counts as this one. Stated.
_LEAST_SHARE = 0.6
# [px] Gaps that are closed in what differs. By 3 or 9 a ring's slope moves by 1.4 or 0.9 sigma.
# Study: thresholds.py touched.coverage _CLOSED_PX … --sessions FOLDER.
_CLOSED_PX = 5
# [places] Evaluated together: arrays stay in the processor's cache. No result depends on it.
# Derived.
_BATCH = 2000


@dataclass(frozen=True)
class ChangeMap:
    """How surely one camera's picture differs from the one without rods.

    field (h, w): from 0 to 1, at every HALF-th pixel.
    """

    camera: Camera
    field: np.ndarray

    @classmethod
    def from_view(cls, view: View) -> "ChangeMap":
        """Compute the map of a view."""
        still = view.still.astype(float)
        noise = view.noise.times(view.mean_share)
        field = change_confidence(still, view.half_background, noise).astype(np.float32)
        square = np.ones((_CLOSED_PX, _CLOSED_PX))
        return cls(view.camera, cv2.morphologyEx(field, cv2.MORPH_CLOSE, square))

    def blurred(self, blur_px: float) -> "ChangeMap":
        """Return the map blurred by a Gaussian."""
        return ChangeMap(self.camera, cv2.GaussianBlur(self.field, (0, 0), blur_px))

    def at(self, px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the field (...) at the nearest pixels to px (..., 2), and which lie within it."""
        height, width = self.field.shape
        is_inside = np.all((px >= 0.0) & (px < [width - 1.0, height - 1.0]), axis=-1)
        nearest = np.where(is_inside[..., None], px + 0.5, 0.0).astype(np.intp)
        column, row = np.moveaxis(nearest, -1, 0)
        return self.field.ravel().take(row * width + column), is_inside


def find_covering(maps: Sequence[ChangeMap], scene: SearchScene) -> list[RoundedAxis]:
    """Find the places of a ring that cover best what differs, the best first; eight at most."""

    def passes_of(places_of: Places) -> list[SearchPass]:
        """Return the passes, on maps that are blurred less and less."""
        passes = []
        for blur_px, stations, kept in zip(_BLURS_PX, _STATIONS, _KEPT):
            blurred = [one.blurred(blur_px) for one in maps]
            score = CoverageScore(places_of, blurred, scene.radius_mm, stations)
            share = blur_px / _BLURS_PX[0]
            passes.append(SearchPass(score, share, share, kept))
        return passes

    grid = PlaceGrid(_X_MM, _TOUCH_MM, _BETA_RAD, _STARTS, _SEPARATION)
    return grid.search(scene, passes_of)


def coverage_score(maps: Sequence[ChangeMap], ring: RoundedAxis, radius_mm: float) -> float:
    """Compute how well a ring covers what differs, up to 1, in its worst camera."""
    blurred = [one.blurred(_BLURS_PX[-1]) for one in maps]
    return float(_lowest_coverage(blurred, ring.batch(), radius_mm, _STATIONS[-1])[0])


@dataclass(frozen=True)
class CoverageScore(ObjectScore):
    """Score of hypothetical rings, up to 1: how well they cover what differs.

    stations: points of a silhouette that are read.
    """

    maps: Sequence[ChangeMap]
    radius_mm: float
    stations: int

    batch: ClassVar[int] = _BATCH

    def of_objects(self, objects: RoundedAxis) -> np.ndarray:
        """Return the scores (n,) of a batch of rings (n, 3)."""
        return _lowest_coverage(self.maps, objects, self.radius_mm, self.stations)


def _lowest_coverage(
    maps: Sequence[ChangeMap], rings: RoundedAxis, radius_mm: float, stations: int
) -> np.ndarray:
    """Return the coverage (n,) of rings in the camera where it is lowest."""
    each = [_coverage(one, rings, radius_mm, stations) for one in maps]
    return np.min(each, axis=0)


def _coverage(change: ChangeMap, rings: RoundedAxis, radius_mm: float, stations: int) -> np.ndarray:
    """Compute how much more (n,) a picture differs within rings (n, 3) than beyond them."""
    px = _px_across_outline(change.camera, rings, radius_mm, stations)
    field, is_inside = change.at(px / HALF)  # (n, stations, 4)
    within = np.mean(field[..., :_WITHIN], axis=-1)
    beyond = np.mean(field[..., _WITHIN:], axis=-1)
    is_read = np.all(is_inside, axis=-1)  # (n, stations)
    difference = np.where(is_read, within - _BEYOND * beyond, 0.0)
    count = np.maximum(np.sum(is_read, axis=-1), _LEAST_SHARE * stations)
    return np.sum(difference, axis=-1) / count


def _px_across_outline(
    camera: Camera, rings: RoundedAxis, radius_mm: float, stations: int
) -> np.ndarray:
    """Project points across the outer silhouettes of rings (n, 3): (n, stations, 4, 2) px."""
    silhouette, normals = _outer_side(camera, rings, radius_mm, stations)
    offsets_mm = radius_mm * _OUTWARDS[:, None] * normals[..., None, :]
    return camera.project(silhouette[..., None, :] + offsets_mm)


def _outer_side(
    camera: Camera, rings: RoundedAxis, radius_mm: float, stations: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the outer one of the two sides of the silhouettes of rings (n, 3).

    Returns points and normals (n, stations, 3).
    """
    sides, normals = rings.silhouette(camera.centre_mm, radius_mm, np.inf, stations)
    outwards = (sides - rings.point_mm[:, None, None]) * normals  # (n, 2, stations, 3)
    outer = np.argmax(np.nansum(outwards, axis=(-1, -2)), axis=-1)
    rows = np.arange(len(sides))
    return sides[rows, outer], normals[rows, outer]
