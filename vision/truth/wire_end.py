"""The whisker's length in the pictures, which checks the manifest.

Along the fitted curve, and straight on beyond its stated end, the wire is what neither of two
pictures explains: that without rods, and what stands still in the trial. Where that ends, the wire
does: the place at which what is left over half of the wire's own evidence, summed from the base, is
largest (Page's test, Biometrika 41, 100, 1954).
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves
from vision.pictures.view import View, median_of
from vision.truth.value import Value
from vision.truth.whisk_pictures import FittedWhisk, WhiskPictures
from vision.wire.bands import Pieces
from vision.wire.trace import NEAR_CLAMP_MM, clear_of_bar, wire_pieces

# [lengths] How far on a longer wire is searched for; one still longer is reported as this long at
# least. Stated.
_REACH = 1.6
# [frames] The wire stands in another place in each, so that nothing behind it passes for it in
# all. Stated.
_FRAMES = 8
# [px] Length of a segment of the wire. Stated.
_PIECE_PX = 4
# [px] Width of the flank on each side. Stated.
_FLANK_PX = 5
# [px] Between wire and flank, where its blur ends. Stated.
_GAP_PX = 2
# [px] Nearer to the bar's outline the bar is taken for wire, as in `first_bends.py`. Stated.
_BAR_MARGIN_PX = 8.0
# [mm] Of the evidence along the wire, and the sigma of an end: finer than lengths are stated
# wrong. Study: wire_ends.py.
_BIN_MM = 2.0
# [1] A wire differs twice as much from what is behind it as its flanks do, or its end is unknown.
# Study: wire_ends.py.
_LEAST = np.log(2.0)
# [mm] Without a wire behind its end: less may be a dark place. Stated.
_BEYOND_MM = 10.0


def wire_ends(whisk: WhiskPictures, fitted: FittedWhisk) -> dict[str, Value]:
    """Return by camera how far from the base, mm, the wire ends in its pictures, where that is
    known.

    Of a wire that tapers it is empty, for its tip is too thin to be seen.
    """
    wire = whisk.rods.wire
    if not wire.is_uniform:
        return {}
    sure_mm = float(np.min(fitted.state.arcs_mm))
    curves = {}
    for frame, curve in fitted.some_curves(_FRAMES).items():
        curves[frame] = _extend(curve, _REACH * wire.length_mm)
    ends = {}
    for view in whisk.views:
        place_mm, evidence = _evidence_along(view, whisk, curves)
        end = _end(place_mm, evidence, sure_mm)
        if end is not None:
            ends[view.camera.name] = end
    return ends


def _extend(curve: Curves, to_mm: float) -> Curves:
    """Return a curve with nodes up to another length, straight beyond its end."""
    step_mm = curve.arc_mm[1]
    count = int(np.ceil((to_mm - curve.arc_mm[-1]) / step_mm))
    beyond_mm = step_mm * np.arange(1, count + 1)
    tangent = curve.tangents[-1:] / np.linalg.norm(curve.tangents[-1])
    straight = curve.points_mm[-1] + beyond_mm[:, None] * tangent
    return Curves(
        np.append(curve.arc_mm, curve.arc_mm[-1] + beyond_mm),
        np.concatenate([curve.points_mm, straight]),
        np.concatenate([curve.tangents, np.repeat(tangent, count, axis=0)]),
    )


def _in_picture_mm(camera: Camera, curves: Mapping[int, Curves], least_mm: float) -> float:
    """Return the arc length, mm, least_mm at least, up to which all curves stay in the picture:
    beyond, they may come up to the camera.
    """
    arc_mm = next(iter(curves.values())).arc_mm
    px = np.stack([camera.project(curve.points_mm) for curve in curves.values()])
    are_inside = np.all(camera.has_in_picture(px), axis=0)
    outside = np.flatnonzero((arc_mm > least_mm) & ~are_inside)
    return float(arc_mm[outside[0] - 1] if len(outside) else arc_mm[-1])


def _evidence_along(
    view: View, whisk: WhiskPictures, curves: Mapping[int, Curves]
) -> tuple[np.ndarray, np.ndarray]:
    """Return places (b,) along the wire, mm, clear of hub and bar, and the evidence of it in one
    camera there.
    """
    length_mm = whisk.rods.wire.length_mm
    visible_mm = max(length_mm, _in_picture_mm(view.camera, curves, length_mm))
    wire = replace(whisk.rods.wire, length_mm=visible_mm)
    static = median_of([view.frames[frame] for frame in curves])
    pieces = wire_pieces(view, curves, wire, _PIECE_PX, _FLANK_PX + _GAP_PX, static)
    discs_px = whisk.bar.axis.covering_discs(view.camera, whisk.bar_swept_mm)
    clear = clear_of_bar(pieces, discs_px, _BAR_MARGIN_PX)
    return _bin_evidence(pieces.place[clear], _evidence(pieces.select(clear)))


def _evidence(pieces: Pieces) -> np.ndarray:
    """Return by how much (s,) each segment's middle differs from both backgrounds more than its
    flanks do.

    It is the log ratio of mean squares over the noise's; NaN where too little of the segment is in
    the picture.
    """
    outside_px = np.abs(pieces.offset_px) - pieces.radius_px[:, None]
    middle = (pieces.weight > 0) & (outside_px < 0.0)
    flanks = (pieces.weight > 0) & (outside_px > _GAP_PX)
    from_empty = _above_flanks((pieces.grey - pieces.background) * pieces.weight, flanks)
    from_static = _above_flanks((pieces.grey - pieces.static) * pieces.weight, flanks)
    same_sign = from_empty * from_static > 0.0
    weaker = np.minimum(from_empty**2, from_static**2)
    squared = np.where(same_sign, weaker, 0.0)
    return np.log1p(_row_means(squared, middle)) - np.log1p(_row_means(squared, flanks))


def _above_flanks(difference, flanks) -> np.ndarray:
    """Return differences (s, p) less their means over the flanks of each row."""
    return difference - _row_means(difference, flanks)[:, None]


def _row_means(values, mask) -> np.ndarray:
    """Return the mean (s,) of each row of `values` (s, p) where `mask` holds; NaN where it holds
    nowhere.
    """
    count = mask.sum(axis=1)
    return np.where(count > 0, np.sum(values * mask, axis=1) / np.maximum(count, 1), np.nan)


def _bin_evidence(place_mm, evidence) -> tuple[np.ndarray, np.ndarray]:
    """Return the middles (b,) of bins along the wire, mm, and the median evidence in each, of those
    that have any.
    """
    known = np.isfinite(evidence) & (place_mm > NEAR_CLAMP_MM)
    number = np.floor(place_mm[known] / _BIN_MM).astype(int)
    bins = np.unique(number)
    medians = [np.median(evidence[known][number == one]) for one in bins]
    return (bins + 0.5) * _BIN_MM, np.array(medians)


def _end(place_mm, evidence, sure_mm: float) -> Value | None:
    """Return where the evidence ends, mm, of a wire that surely reaches sure_mm.

    None where the wire is not distinct, or where it goes on to the last place with evidence.
    """
    sure = place_mm < sure_mm
    usual = float(np.median(evidence[sure])) if np.any(sure) else 0.0
    if usual < _LEAST:
        return None
    last = int(np.argmax(np.cumsum(evidence - 0.5 * usual)))
    if place_mm[-1] < place_mm[last] + _BEYOND_MM:
        return None
    low_mm = place_mm[last] + 0.5 * _BIN_MM
    high_mm = place_mm[last + 1] - 0.5 * _BIN_MM
    sigma_mm = np.hypot(_BIN_MM, (high_mm - low_mm) / np.sqrt(12.0))
    return Value(0.5 * (low_mm + high_mm), float(sigma_mm))
