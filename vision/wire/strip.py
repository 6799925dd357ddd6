"""The pixels near a curve that may bend by any angle: segments of equal length along it.

Each pixel belongs to the segment that has its foot on the curve, so that a thick object which bends
is cut across its own direction everywhere. No pixel is interpolated and none is used twice. What is
behind the object is not known: it is fitted to both of its sides.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from scipy.spatial import cKDTree

from vision.geometry.polyline import at_lengths, beside_nodes, lengths_px, normals
from vision.geometry.robust import robust_sigma
from vision.geometry.rotation import unit
from vision.pictures.pixel_noise import Noise
from vision.wire.bands import Pieces
from vision.wire.pixel_table import PixelTable

# [px] Between nodes of the curve: a pixel's foot is found from the nearest one. Derived.
_NODE_PX = 0.5
# [px] A segment shows so much beside both of its edges. Derived.
_LEAST_BESIDE_PX = 2.0
# [blurs] Beyond an edge, where a fifteenth of its contrast is left. Derived.
_CLEAR_BLURS = 1.5
# [1] Keeps the equations of a side's few pixels from being singular. Derived.
_WEAK = 1e-6
# [1] Share of the pixels beside an object that is left after its background is fitted, at least.
# Derived.
_LEAST_FREEDOM = 0.25
# [1] Level, slope and step of a background, and a slope of its own on either side. Stated.
_BACKGROUND_TERMS = 4


@dataclass(frozen=True)
class Curve:
    """A curve: nodes (m, 2) px at equal steps, their arc length (m,) px and the object's
    half-width (m,) px.
    """

    px: np.ndarray
    arc_px: np.ndarray
    radius_px: np.ndarray

    @staticmethod
    def through(px: np.ndarray, radius_px: np.ndarray) -> "Curve":
        """Return the curve of nodes (n, 2) and half-widths (n,), at steps of _NODE_PX."""
        length_px = lengths_px(px)
        steps = max(int(np.ceil(length_px[-1] / _NODE_PX)), 2)
        place_px = np.linspace(0.0, length_px[-1], steps + 1)
        nodes = at_lengths(place_px, length_px, px)
        return Curve(nodes, place_px, np.interp(place_px, length_px, radius_px))

    @property
    def length_px(self) -> float:
        """Return the length."""
        return float(self.arc_px[-1])

    @cached_property
    def normals(self) -> np.ndarray:
        """Return the unit normals (m, 2) at the nodes, as `vision.geometry.polyline` has them."""
        return normals(self.px)

    def at(self, place_px: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return points (s, 2), unit normals (s, 2) and half-widths (s,) at arc lengths (s,)."""
        point = at_lengths(place_px, self.arc_px, self.px)
        normal = unit(at_lengths(place_px, self.arc_px, self.normals))
        return point, normal, np.interp(place_px, self.arc_px, self.radius_px)


def cut_strip(grey: np.ndarray, curve: Curve, margin_px: float, length_px: float) -> Pieces:
    """Cut the pixels near a curve into segments of length_px, their background not known yet.

    grey (h, w). margin_px: beyond the object's edges. Segments of which the picture lacks an edge are
    left out.
    """
    pixels = _pixels_near(grey, curve, margin_px)
    count = max(int(curve.length_px / length_px), 1)
    middles = (np.arange(count) + 0.5) * (curve.length_px / count)
    piece = np.clip((pixels.place_px / curve.length_px * count).astype(int), 0, count - 1)
    table = PixelTable.by_segment(piece, pixels.offset_px, count)
    foot, normal, radius = curve.at(middles)
    nothing = np.zeros(table.shape)
    pieces = Pieces(
        offset_px=table.filled(pixels.offset_px),
        grey=table.filled(pixels.grey),
        background=nothing,
        slope=nothing,
        curvature=nothing,
        weight=table.filled(np.ones(len(piece))),
        place=middles,
        radius_px=radius,
        foot_px=foot,
        normal=normal,
        source=np.zeros(count, dtype=int),
    )
    return pieces.select(_shows_both_sides(pieces))


def _shows_both_sides(pieces: Pieces) -> np.ndarray:
    """Return which segments have pixels beyond both edges of the object, (s,) bool."""
    needed_px = (pieces.radius_px + _LEAST_BESIDE_PX)[:, None]
    known_px = pieces.offset_px * pieces.weight
    shows_one = np.any(known_px > needed_px, axis=1)
    shows_other = np.any(known_px < -needed_px, axis=1)
    return shows_one & shows_other


@dataclass(frozen=True)
class _Pixels:
    """Pixels near a curve: signed distance and arc length of the foot, px, and grey level, (n,)."""

    offset_px: np.ndarray
    place_px: np.ndarray
    grey: np.ndarray


def _pixels_near(grey: np.ndarray, curve: Curve, margin_px: float) -> _Pixels:
    """Return the pixels whose foot is on a curve, within margin_px of the object's edge there."""
    widest_px = float(np.max(curve.radius_px)) + margin_px
    px, node = _nearest_nodes(grey.shape, curve, widest_px)
    offset_px, past_node_px = beside_nodes(px - curve.px[node], curve.normals[node])
    place_px = curve.arc_px[node] + past_node_px
    reach_px = curve.radius_px[node] + margin_px
    is_beside = (place_px >= 0.0) & (place_px <= curve.length_px)
    is_near = is_beside & (np.abs(offset_px) <= reach_px)
    column, row = px[is_near].T
    seen = grey[row, column].astype(float)
    return _Pixels(offset_px[is_near], place_px[is_near], seen)


def _nearest_nodes(
    shape: tuple[int, ...], curve: Curve, reach_px: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the pixels (n, 2) of a picture of this shape (h, w) within reach_px of a curve, and the
    nearest node (n,) of each.
    """
    mask = np.zeros(shape, dtype=np.uint8)
    nodes = np.rint(curve.px).astype(np.int32)
    cv2.polylines(mask, [nodes], False, 1, thickness=2 * int(np.ceil(reach_px)) + 3)
    px = np.argwhere(mask)[:, ::-1]
    distance, node = cKDTree(curve.px).query(px, distance_upper_bound=reach_px + _NODE_PX)
    is_near = np.isfinite(distance)
    return px[is_near], node[is_near]


def with_background(pieces: Pieces, blur_px: float, noise: Noise) -> Pieces:
    """Return segments with a background by both of their sides, weighed by the noise of a pixel.

    The background is a level and a slope on either side, for a shadow next to the object, and a step
    that the object hides. blur_px: of the lens, by which pixels that show the background alone are
    known.
    """
    background, slope, _ = _fit_background(pieces, blur_px)
    is_known = pieces.weight > 0
    return replace(
        pieces,
        background=np.where(is_known, background, 0.0),
        slope=np.where(is_known, slope[:, None], 0.0),
        weight=np.where(is_known, 1.0 / noise.sigma(background), 0.0),
    )


def noise_beside(pieces: Pieces, blur_px: float) -> Noise:
    """Return the noise of a pixel by the residuals of segments' backgrounds outside the object.

    What is printed there counts as noise: nobody knows how it goes on behind.
    """
    background, _, is_side = _fit_background(pieces, blur_px)
    residual = (pieces.grey - background)[is_side]
    if len(residual) == 0:
        return Noise(1.0, 0.0)
    freedom = max(1.0 - _BACKGROUND_TERMS * len(pieces) / len(residual), _LEAST_FREEDOM)
    return Noise(robust_sigma(residual) ** 2 / freedom, 0.0)


def _fit_background(pieces: Pieces, blur_px: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fit the background (s, p) to the pixels on either side of the object; return with it its slope
    (s,) per px, and which pixels (s, p) show it alone.
    """
    radius_px = pieces.radius_px[:, None]
    beyond_px = np.abs(pieces.offset_px) - radius_px
    level = np.ones_like(beyond_px)
    step = np.clip(pieces.offset_px / radius_px, -1.0, 1.0)
    bend = np.maximum(beyond_px, 0.0)
    design = np.stack([level, pieces.offset_px, step, bend], axis=-1)  # (s, p, 4)
    is_side = (pieces.weight > 0) & (beyond_px > _CLEAR_BLURS * blur_px)
    on_sides = design * is_side[..., None]
    transposed = on_sides.transpose(0, 2, 1)
    normal = transposed @ on_sides + _WEAK * np.eye(_BACKGROUND_TERMS)
    coefficients = np.linalg.solve(normal, transposed @ pieces.grey[..., None])  # (s, 4, 1)
    background = design @ coefficients
    return background[..., 0], coefficients[:, 1, 0], is_side
