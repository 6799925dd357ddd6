"""Where a ring may be in space, before any wire is known: by what it covers in all cameras.

The edges beside the contact determine neither the ring's plane nor its centre, and a tube has
highlights and rims whose edges are as strong as its own. So the whole ring is used: a map of each
camera says how surely every pixel differs from the picture without rods. Just within the ring's
outer silhouette, which no part of it hides, the picture must differ, and just beyond it must not.
The score of a ring is the difference of these, in the camera where it is lowest. The best of a grid
of rings that the whisker would touch are refined from coarse to fine (`vision.touched.grid_search`)
on maps that are blurred less and less.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.rods import Rods
from vision.geometry.rounded import Rounded
from vision.pictures.change import HALF, change_confidence
from vision.pictures.view import View
from vision.touched.grid_search import (
    SearchPass,
    coarse_to_fine,
    half_steps,
    score_in_batches,
    touch_angles,
)
from vision.touched.rounded_places import touched_first

# [px] Blur of the maps, pass by pass. Set by eye. Study: rounded_seen.py.
_BLURS_PX = (5.0, 2.5, 1.0)
# [places] That each pass keeps. Set by eye. Study: rounded_seen.py.
_KEPT = (24, 12, 8)
# [points] Of a silhouette, pass by pass. Set by eye. Study: rounded_seen.py.
_STATIONS = (24, 32, 48)
# [places] Of the grid that go on. Set by eye. Study: rounded_seen.py.
_STARTS = 64
# [steps] Least separation of two places of the grid. Set by eye. Study: rounded_seen.py.
_SEPARATION = 2.0
# [rad] Slopes of the grid. Stated.
_BETA_RAD = np.radians(np.arange(-70.0, 71.0, 10.0))
# [rad] Tilts of the grid. Stated.
_PSI_RAD = np.radians(np.arange(-16.0, 17.0, 8.0))
# [rad] Turns of the grid about the ring's tangent where it is touched. Stated.
_TURN_RAD = np.radians(np.arange(-20.0, 21.0, 20.0))
# [mm] Step of the grid along the whisker: about the tube's radius. Stated.
_X_MM = 3.0
# [mm] Step of the grid along the arc of the whisker's middle: about the tube's radius. Stated.
_TOUCH_MM = 4.0
# [mm] Nearest contact to the whisker's base. Stated.
_NEAREST_MM = 10.0
# [radii] From a silhouette outwards, where the map is read: two places within it, two beyond. Set
# by eye. Study: rounded_seen.py.
_OUTWARDS = np.array([-1.2, -0.6, 0.35, 0.9])
# [places] Of these that lie within. A layout.
_WITHIN = 2
# [1] Weight of what differs beyond a silhouette, over that within: another thing may hide a ring,
# and adds nothing to it. Set by eye. Study: rounded_seen.py.
_BEYOND = 1.5
# [1] Share of a silhouette in the picture: what is outside speaks neither for nor against a ring,
# but a smaller share counts as this one. Stated.
_LEAST_SHARE = 0.6
# [px] Gaps that are closed in what differs. Set by eye. Study: rounded_seen.py.
_CLOSED_PX = 5
# [places] Evaluated together: arrays that stay in the processor's cache. Not measured.
_BATCH = 2000


@dataclass(frozen=True)
class ChangeMap:
    """How surely one camera's picture differs from the one without rods.

    field (h, w): from 0 to 1, at every HALF-th pixel.
    """

    camera: Camera
    field: np.ndarray

    @classmethod
    def from_pictures(cls, view: View, still: np.ndarray) -> "ChangeMap":
        """Compute the map of a view.

        still (h, w): the picture of what stands still, at every HALF-th pixel.
        """
        background = view.background[::HALF, ::HALF]
        noise = view.noise.times(view.mean_share)
        field = change_confidence(still.astype(float), background, noise).astype(np.float32)
        square = np.ones((_CLOSED_PX, _CLOSED_PX))
        return cls(view.camera, cv2.morphologyEx(field, cv2.MORPH_CLOSE, square))

    def blurred(self, blur_px: float) -> "ChangeMap":
        """Return the map blurred by a Gaussian."""
        return ChangeMap(self.camera, cv2.GaussianBlur(self.field, (0, 0), blur_px))


def find_rings(
    maps: Sequence[ChangeMap],
    rods: Rods,
    motor_rad: tuple[float, float],
) -> list[Rounded]:
    """Find rings that cover what differs and that the whisker would touch, the best first.

    At most eight are found. motor_rad: lowest and highest motor angle, between which the whisker
    touches. Numbers of a hypothesis (n, 5): see `vision.touched.rounded_places.touched_first`.
    """
    length_mm = rods.wire.length_mm
    x_mm = np.arange(_NEAREST_MM, length_mm, _X_MM)
    touch_rad = touch_angles(motor_rad, length_mm, _TOUCH_MM)
    values = [x_mm, touch_rad, _BETA_RAD, _PSI_RAD, _TURN_RAD]
    rings_of = partial(touched_first, rods.bar.form, rods)
    passes = []
    for blur_px, stations, kept in zip(_BLURS_PX, _STATIONS, _KEPT):
        blurred = [one.blurred(blur_px) for one in maps]
        score = CoverageScore(blurred, rings_of, rods.bar.radius_mm, stations)
        share = blur_px / _BLURS_PX[0]
        passes.append(SearchPass(score, share, share, kept))
    best = coarse_to_fine(values, half_steps(values), passes, _SEPARATION, _STARTS)
    return rings_of(best).each()


def coverage_score(maps: Sequence[ChangeMap], ring: Rounded, radius_mm: float) -> float:
    """Compute how well a ring covers what differs, up to 1, in its worst camera."""
    one_ring = Rounded(ring.point_mm[None], ring.direction[None], ring.form, ring.spot_mm[None])
    blurred = [one.blurred(_BLURS_PX[-1]) for one in maps]
    return float(_lowest_coverage(blurred, one_ring, radius_mm, _STATIONS[-1])[0])


@dataclass(frozen=True)
class CoverageScore:
    """Score of hypothetical rings: how well they cover what differs.

    stations: points of a silhouette that are read.
    """

    maps: Sequence[ChangeMap]
    rings_of: Callable[[np.ndarray], Rounded]
    radius_mm: float
    stations: int

    def __call__(self, hypotheses: np.ndarray) -> np.ndarray:
        """Return the scores (n,) of hypotheses (n, 5), up to 1."""
        return score_in_batches(self._score, hypotheses, _BATCH)

    def _score(self, hypotheses: np.ndarray) -> np.ndarray:
        """Return the scores (n,) of a batch of hypotheses (n, 5)."""
        rings = self.rings_of(hypotheses)
        return _lowest_coverage(self.maps, rings, self.radius_mm, self.stations)


def _lowest_coverage(
    maps: Sequence[ChangeMap], rings: Rounded, radius_mm: float, stations: int
) -> np.ndarray:
    """Return the coverage (n,) of rings in the camera where it is lowest."""
    each = [_coverage(one, rings, radius_mm, stations) for one in maps]
    return np.min(each, axis=0)


def _coverage(change: ChangeMap, rings: Rounded, radius_mm: float, stations: int) -> np.ndarray:
    """Compute how much more (n,) a picture differs within rings (n, 3) than beyond them."""
    camera = change.camera
    limb, normals = rings.limb(camera.centre_mm, radius_mm, np.inf, stations)  # (n, 2, stations, 3)
    outwards = (limb - rings.point_mm[:, None, None]) * normals
    outer = np.argmax(np.nansum(outwards, axis=(-1, -2)), axis=-1)  # of the two sides
    rows = np.arange(len(limb))
    silhouette = limb[rows, outer, :, None]
    offsets_mm = radius_mm * _OUTWARDS[:, None] * normals[rows, outer, :, None]
    places = silhouette + offsets_mm  # (n, stations, 4, 3)
    px = camera.project(places.reshape(-1, 3)).reshape(*places.shape[:-1], 2) / HALF
    height, width = change.field.shape
    last = np.array([width, height]) - 1.0
    is_inside = np.all((px >= 0.0) & (px < last), axis=-1)
    column = np.where(is_inside, px[..., 0] + 0.5, 0.0).astype(np.intp)
    row = np.where(is_inside, px[..., 1] + 0.5, 0.0).astype(np.intp)
    field = change.field.ravel().take(row * width + column)
    within = np.mean(field[..., :_WITHIN], axis=-1)
    beyond = np.mean(field[..., _WITHIN:], axis=-1)
    is_read = np.all(is_inside, axis=-1)  # (n, stations)
    difference = np.where(is_read, within - _BEYOND * beyond, 0.0)
    count = np.maximum(np.sum(is_read, axis=-1), _LEAST_SHARE * stations)
    return np.sum(difference, axis=-1) / count
