"""A ring in space before any wire is known: the rings that are before what differs from the picture without rods, and
that reach no farther.

The edges beside the whisker alone tell neither the ring's plane nor where its middle is, and a tube has highlights and
rims whose edges are as clear as its own. What is looked for here is all of the ring: within its outer outline, which
nothing of it hides, the picture differs, and beyond it does not.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.rods import Rods
from vision.geometry.rounded import Rounded
from vision.pictures.change import HALF, changed
from vision.pictures.view import View
from vision.touched.find import coarse_to_fine, half_steps

# [px, places, points] By how much what differs is blurred, look by look, how many places go on,
# and by how many points of an outline. Set by eye. Study: rounded_seen.py.
_BLURS_PX, _KEPT, _STATIONS = (
    (5.0, 2.5, 1.0),
    (24, 12, 8),
    (24, 32, 48),
)
# [places] That are climbed from, of a grid. Set by eye. Study: rounded_seen.py.
_STARTS = 64
# [rad] Slopes of the grid, and turns of a ring about its tangent. Stated.
_BETA_RAD, _PSI_RAD, _TURN_RAD = (
    np.radians(np.arange(-most, most + 1.0, step))
    for most, step in ((70.0, 10.0), (16.0, 8.0), (20.0, 20.0))
)
# [mm] Steps of the grid along the whisker and along its swing: about the tube's radius. Stated.
_X_MM, _TOUCH_MM = 3.0, 4.0
# [radii] Beside an outline, outwards: where it is asked whether the picture differs. Set by eye.
# Study: rounded_seen.py.
_AT = np.array([-1.2, -0.6, 0.35, 0.9])
# [1] What differs beyond an outline, over what does not within: another thing may hide a ring,
# and adds nothing to it. Set by eye. Study: rounded_seen.py.
_BEYOND = 1.5
# [1] Of an outline in a picture: less counts as so much. Stated.
# of an outline in a picture: what is outside speaks neither for nor against, up to here
_LEAST_SHARE = 0.6
# [px] Gaps that are closed in what differs. Set by eye. Study: rounded_seen.py.
_CLOSED_PX = 5
# [places] Arrays that stay in the processor's cache. Not measured.
_AT_ONCE = 2000


@dataclass(frozen=True)
class Differs:
    """How surely a camera's picture differs from the one without rods, (h, w) from 0 to 1, at every HALF-th pixel."""

    camera: Camera
    field: np.ndarray

    @classmethod
    def of(cls, view: View, still: np.ndarray) -> "Differs":
        """still: the picture of what stands still, at every HALF-th pixel."""
        behind = view.background[::HALF, ::HALF]
        field = changed(still.astype(float), behind, view.noise.times(view.mean_share)).astype(
            np.float32
        )
        return cls(
            view.camera, cv2.morphologyEx(field, cv2.MORPH_CLOSE, np.ones((_CLOSED_PX, _CLOSED_PX)))
        )

    def blurred(self, blur_px: float) -> "Differs":
        """The same, less sharp."""
        return Differs(self.camera, cv2.GaussianBlur(self.field, (0, 0), blur_px))


def likely_rings(
    seen: Sequence[Differs], rods: Rods, motor_rad: tuple[float, float], placed: Callable
) -> list[Rounded]:
    """Rings that fill what differs the best in the camera where they do the worst, of those that the whisker would
    touch. placed: the rings (n,) of hypotheses (n, 5), see `vision.touched.rounded_search.placed`."""
    length = rods.wire.length_mm
    touch = np.linspace(
        *motor_rad, max(3, int(np.ceil(np.ptp(motor_rad) * 0.5 * length / _TOUCH_MM)))
    )
    values = [np.arange(10.0, length, _X_MM), touch, _BETA_RAD, _PSI_RAD, _TURN_RAD]

    def score(blur_px: float, stations: int) -> Callable:
        return partial(
            _of_each, [one.blurred(blur_px) for one in seen], placed, rods.bar.radius_mm, stations
        )

    looks = (
        (score(blur_px, stations), share, share, kept)
        for blur_px, share, kept, stations in zip(
            _BLURS_PX, np.divide(_BLURS_PX, _BLURS_PX[0]), _KEPT, _STATIONS
        )
    )
    found = placed(coarse_to_fine(values, half_steps(values), looks, 2.0, _STARTS))
    return [
        Rounded(*where, found.form, spot)
        for *where, spot in zip(found.point_mm, found.direction, found.spot_mm)
    ]


def filled(seen: Sequence[Differs], ring: Rounded, radius_mm: float) -> float:
    """How well a ring fills what differs, up to 1, in the camera where it does the worst."""
    each = Rounded(ring.point_mm[None], ring.direction[None], ring.form, ring.spot_mm[None])
    return float(
        _in_all([one.blurred(_BLURS_PX[-1]) for one in seen], each, radius_mm, _STATIONS[-1])[0]
    )


def _of_each(
    seen: Sequence[Differs], placed: Callable, radius_mm: float, stations: int, each: np.ndarray
):
    groups = np.array_split(each, -(-len(each) // _AT_ONCE))
    return np.concatenate([_in_all(seen, placed(some), radius_mm, stations) for some in groups])


def _in_all(seen: Sequence[Differs], rings: Rounded, radius_mm: float, stations: int) -> np.ndarray:
    return np.min([_filled(one, rings, radius_mm, stations) for one in seen], axis=0)


def _filled(seen: Differs, rings: Rounded, radius_mm: float, stations: int) -> np.ndarray:
    """By how much more (n,) the picture differs within the outer outlines of rings than beyond."""
    limb, normals = rings.limb(seen.camera.centre_mm, radius_mm, np.inf, stations)
    outwards = np.nansum((limb - rings.point_mm[:, None, None]) * normals, axis=(-1, -2))
    rows, outer = np.arange(len(limb)), np.argmax(outwards, axis=-1)
    beside = limb[rows, outer, :, None] + radius_mm * _AT[:, None] * normals[rows, outer, :, None]
    px = seen.camera.project(beside.reshape(-1, 3)).reshape(*beside.shape[:-1], 2) / HALF
    height, width = seen.field.shape
    there = np.all((px >= 0.0) & (px < np.array([width, height]) - 1.0), axis=-1)
    column, row = (np.where(there, px[..., k] + 0.5, 0.0).astype(np.intp) for k in range(2))
    field = seen.field.ravel().take(row * width + column)
    told = np.all(there, axis=-1)
    more = np.mean(field[..., :2], axis=-1) - _BEYOND * np.mean(field[..., 2:], axis=-1)
    return np.sum(np.where(told, more, 0.0), axis=-1) / np.maximum(
        np.sum(told, axis=-1), _LEAST_SHARE * stations
    )
