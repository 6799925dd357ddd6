"""The pixels of a bar's image: patches of the band along it, clear of wires and clamps, and their
rims.

`Pieces` (`vision.wire.bands`) are patches of the band, each some pixels long and as wide as the
band. This module reads them about a predicted axis, and selects those that show the bar before its
background and nothing else.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import KDTree

from vision.geometry.contact import BarAxis
from vision.geometry.polyline import tangents_by
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.pixel_noise import Noise
from vision.touched.object_view import ObjectView
from vision.wire.bands import Band, Pieces, cut_pieces, read_band
from vision.wire.cylinder import WAVES
from vision.wire.shading import Knots, fit_shading

# [mm] The line is handed on as two points, this far to either side: a layout.
ARM_MM = 20.0
# [radii] Pixels nearer to the axis are no rim, where edges are measured. By 0.6 touch moves
# by 0.08 sigma, by 0.8 by 0.8. Study: thresholds.py touched.pieces _INNER_SHARE ….
_INNER_SHARE = 0.72
# [points] Along the bar's predicted outline. A layout.
_STATIONS = 200
# [1] Least share of a piece's pixels in the picture. 0.25 to 0.75 move nothing on the fixtures.
# Study: thresholds.py touched.pieces _LEAST_IN_PICTURE ….
_LEAST_IN_PICTURE = 0.5
# [pieces] Four: two for a line, two left over. Derived.
FEWEST_PIECES = 4
# [1] Largest misfit of a piece over the median piece's, or over that of noise alone where this is
# more: beyond, the piece shows something else than the bar. 2 to 4.5 move nothing on the fixtures.
# Study: thresholds.py touched.pieces _WORST_MISFIT ….
_WORST_MISFIT = 3.0
# [px] To either side of a wire's middle its pixels, and those that the lens spreads it to: half a
# wire of 4 px and four blurs of a pixel. Derived.
_WIRE_PX = 6.0
# [1] Least share of a piece's pixels that no wire hides: with fewer the piece constrains little. By
# 0.15 a whisk of five has no truth, by 0.6 a slope moves by 0.3 sigma. Study: thresholds.py
# touched.pieces _LEAST_CLEAR_SHARE ….
_LEAST_CLEAR_SHARE = 0.3
# [mm] Between knots of the rims' shading, where edges are measured. By 9 touch moves by 0.07 sigma,
# by 20 a slope by 2.2. Study: thresholds.py touched.pieces _KNOT_MM ….
_KNOT_MM = 14.0
# [1] Chi² per pixel of the edges' model: a bar before its background leaves 0.1 to 2. Study:
# coverage.py alone.
NO_BAR = 3.5
# [passes] Of excluding pieces by their misfit. Two move nothing on the fixtures. Study:
# thresholds.py touched.pieces _PASSES ….
_PASSES = 3


def bar_pieces(view: ObjectView, axis: BarAxis, noise: Noise) -> Pieces:
    """Return the pieces of the bar in the mean picture, to either side of the axis's point, that
    show no wire.

    noise: of the difference of mean and background. Raises Refused where no part of the bar lies
    before the camera.
    """
    length_px = view.settings.bar_piece_px
    band = _from_whole(_read_bar_band(view, axis), length_px)
    pieces = cut_pieces([band], length_px, noise)
    is_used = np.mean(pieces.weight > 0, axis=1) > _LEAST_IN_PICTURE
    is_used &= clear_of_wire(pieces, view.crossing_px, length_px / 2 + 5.0)
    return pieces.select(is_used)


def _read_bar_band(view: ObjectView, axis: BarAxis) -> Band:
    """Read the band along the bar, where that lies before the camera and is no wider than the picture.

    Raises Refused where no part of it lies before the camera, or the bar would pass through that.
    """
    settings = view.settings
    place, middle, radius = axis.outline_before(
        view.camera, view.radius_mm, settings.bar_reach_mm, _STATIONS
    )
    half = int(np.ceil(np.max(radius))) + settings.bar_margin_px
    return read_band(view.pictures.mean, view.pictures.background, middle, place, radius, half)


def _from_whole(band: Band, length_px: int) -> Band:
    """Return the band from a pixel whose number is a multiple of a piece's length on.

    So pieces do not move with the axis.
    """
    extent = np.ptp(band.foot_px, axis=0)
    along = int(np.argmin(np.abs(extent - len(band.place) + 1)))
    first = int(-band.foot_px[0, along] % length_px)
    return band.select(slice(first, None))


def bar_knots(settings: VisionSettings) -> Knots:
    """Return the places between which the bar's shading changes linearly."""
    return Knots(np.arange(-settings.bar_reach_mm, settings.bar_reach_mm + 1e-9, _KNOT_MM))


def clear_of_wire(pieces: Pieces, wires_px: Sequence[np.ndarray], margin_px: float) -> np.ndarray:
    """Return which pieces (s,) of the bar show no wire: each is a rectangle along and across the
    bar."""
    if not len(wires_px):
        return np.ones(len(pieces), dtype=bool)
    tangent = tangents_by(pieces.normal)
    from_feet_px = np.concatenate(wires_px) - pieces.foot_px[:, None]  # (s, all m, 2)
    along = np.abs(np.einsum("smi,si->sm", from_feet_px, tangent))
    across = np.abs(np.einsum("smi,si->sm", from_feet_px, pieces.normal))
    is_inside = (along < margin_px) & (across < pieces.radius_px[:, None] + margin_px)
    return ~np.any(is_inside, axis=1)


def beside_wires(pieces: Pieces, wires_px: Sequence[np.ndarray]) -> Pieces:
    """Return pieces whose pixels near a wire weigh nothing, of those that have enough others.

    For a bar that a wire sweeps along, where hardly a piece is clear of it.
    """
    px = pieces.foot_px[:, None] + pieces.offset_px[..., None] * pieces.normal[:, None]
    nodes_px = np.concatenate([np.empty((0, 2)), *wires_px])
    nodes_px = nodes_px[np.isfinite(nodes_px).all(axis=1)]  # those before the camera
    distance_px, _ = KDTree(nodes_px).query(px, distance_upper_bound=_WIRE_PX)
    is_hidden = np.isfinite(distance_px)
    pieces = replace(pieces, weight=np.where(is_hidden, 0.0, pieces.weight))
    return pieces.select(np.mean(pieces.weight > 0, axis=1) > _LEAST_CLEAR_SHARE)


def of_bar_alone(pieces: Pieces, align: Callable[[Pieces], Pieces], knots: Knots) -> Pieces:
    """Return the pieces that a bar before its background can explain: no clamps, no hub, no
    shadow's border.

    align: returns pieces with offsets counted from the bar's estimated axis.
    """
    for _ in range(_PASSES):
        aligned = align(pieces)
        shading = fit_shading(aligned, 1.0, WAVES, knots)[0]
        misfit = shading.misfit(aligned)
        is_bar = misfit < _WORST_MISFIT * max(float(np.median(misfit)), 1.0)
        if np.all(is_bar) or np.sum(is_bar) < FEWEST_PIECES:
            break
        pieces = pieces.select(is_bar)
    return pieces


def rims_of(pieces: Pieces, aligned: Pieces) -> Pieces:
    """Return the pieces without their middle, where highlights do not constrain the edges.

    aligned: the same pieces with offsets counted from the bar's estimated axis.
    """
    is_inner = np.abs(aligned.offset_px) < _INNER_SHARE * aligned.radius_px[:, None]
    rims = replace(pieces, weight=np.where(is_inner, 0.0, pieces.weight))
    return rims.columns(np.any(rims.weight > 0, axis=0))


def at_arms(pieces: Pieces) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return places (2,) at ± ARM_MM, and there the band's foot and normal (2, 2) and half width
    (2,), by parabolas."""
    order = np.argsort(pieces.place)
    place = np.array([-ARM_MM, ARM_MM])
    curves = np.column_stack([pieces.foot_px, pieces.normal, pieces.radius_px])[order].T
    values = []
    for curve in curves:
        values.append(np.polyval(np.polyfit(pieces.place[order], curve, 2), place))
    values = np.stack(values, axis=1)  # (2, 5)
    return place, values[:, :2], values[:, 2:4], values[:, 4]
