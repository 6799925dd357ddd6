"""How long the whisker is seen to be: a length that the manifest states too.

Along the fitted curve, and straight on beyond its stated end, the wire is what neither of two pictures explains: that
without rods, and what stands still in the trial. Where that ends, the wire does: the place at which what is left over
half of the wire's own evidence, summed from the base, is largest (Page's test, Biometrika 41, 100, 1954).
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vision.fit.problem import curves_of
from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves
from vision.pictures.view import View, median_of
from vision.truth.value import Value
from vision.truth.whisk_pictures import FittedWhisk, WhiskPictures
from vision.wire.bands import Pieces
from vision.wire.trace import NEAR_CLAMP_MM, clear_of_bar, wire_pieces

# [lengths] How far on a longer wire is looked for; one still longer is told as this long at
# least. Stated.
_REACH = 1.6
# [frames] The wire stands in another place in each, so that nothing behind it passes for it in
# all. Stated.
_LOOKS = 8
# [px] Along the wire; beside it on each hand; between it and these, where its blur ends. Stated.
_PIECE_PX, _FLANK_PX, _GAP_PX = 4, 5, 2
# [px] Nearer to the bar's outline the bar is taken for wire, as in `first_bends.py`. Stated.
_BESIDE_BAR_PX = 8.0
# [mm] Of the evidence along the wire, and the sigma of an end: finer than lengths are stated
# wrong. Study: wire_ends.py.
_BIN_MM = 2.0
# [1] A wire differs twice as much from what is behind it as what is beside it, or its end is not
# told. Study: wire_ends.py.
_LEAST = np.log(2.0)
# [mm] Without a wire behind its end: less may be a dark place. Stated.
_BEYOND_MM = 10.0


def wire_ends(whisk: WhiskPictures, fitted: FittedWhisk) -> dict[str, Value]:
    """By camera how far from the base, mm, the wire is seen to end, where it is; of a wire that tapers nothing, for its
    tip is too thin to be seen."""
    wire, sure_mm = whisk.rods.wire, float(np.min(fitted.state.arcs_mm))
    if wire.taper_per_mm > 0.0:
        return {}
    curves = _some_curves(fitted, _REACH * wire.length_mm)
    told = (
        (view.camera.name, _end(*_seen_along(view, whisk, curves), sure_mm)) for view in whisk.views
    )
    return {name: end for name, end in told if end is not None}


def _some_curves(fitted: FittedWhisk, to_mm: float) -> dict[int, Curves]:
    """Centrelines of frames spread over the whisk, up to another length."""
    chosen = np.unique(np.linspace(0, len(fitted.frames) - 1, _LOOKS).astype(int))
    curves, _ = curves_of(fitted.problem, fitted.state.vector, fitted.state.arcs_mm)
    return {fitted.frames[k]: _straight_on(curves.one(k), to_mm) for k in chosen.tolist()}


def _straight_on(curve: Curves, to_mm: float) -> Curves:
    """A curve with nodes up to another length, straight beyond its end."""
    step = curve.arc_mm[1]
    more = step * np.arange(1, 1 + int(np.ceil((to_mm - curve.arc_mm[-1]) / step)))
    tangent = curve.tangents[-1:] / np.linalg.norm(curve.tangents[-1])
    points = np.concatenate([curve.points_mm, curve.points_mm[-1] + more[:, None] * tangent])
    tangents = np.concatenate([curve.tangents, np.repeat(tangent, len(more), axis=0)])
    return Curves(np.append(curve.arc_mm, curve.arc_mm[-1] + more), points, tangents)


def _in_picture_mm(camera: Camera, curves: Mapping[int, Curves], least_mm: float) -> float:
    """Up to where curves stay in a picture, mm, least_mm at least: beyond, they may come up to the camera."""
    arc = next(iter(curves.values())).arc_mm
    px = np.stack([camera.project(curve.points_mm) for curve in curves.values()])
    out = (arc > least_mm) & ~np.all(
        (px >= 0.0) & (px <= np.array(camera.size_px) - 1.0), axis=(0, 2)
    )
    return float(arc[np.argmax(out) - 1]) if np.any(out) else float(arc[-1])


def _seen_along(
    view: View, whisk: WhiskPictures, curves: Mapping[int, Curves]
) -> tuple[np.ndarray, np.ndarray]:
    """Places (b,) along the wire, mm, clear of hub and bar, and the evidence of it in one camera there."""
    length_mm = whisk.rods.wire.length_mm
    wire = replace(
        whisk.rods.wire, length_mm=max(length_mm, _in_picture_mm(view.camera, curves, length_mm))
    )
    still = median_of([view.frames[frame] for frame in curves])
    pieces = wire_pieces(view, curves, wire, _PIECE_PX, _FLANK_PX + _GAP_PX, still)
    outline = whisk.bar.axis.covering_discs(view.camera, whisk.bar_swept_mm)
    clear = clear_of_bar(pieces, *outline, _BESIDE_BAR_PX)
    return _binned(pieces.place[clear], _evidence(pieces.select(clear)))


def _evidence(pieces: Pieces) -> np.ndarray:
    """By how much (s,) each piece's middle differs from both backgrounds more than what is beside it does: the log
    of their mean squares over the noise's. NaN where too little of it is in the picture."""
    there, away = pieces.weight > 0, np.abs(pieces.offset_px) - pieces.radius_px[:, None]
    middle, beside = there & (away < 0.0), there & (away > _GAP_PX)
    left = [(pieces.grey - behind) * pieces.weight for behind in (pieces.background, pieces.still)]
    left = [one - _mean(one, beside)[:, None] for one in left]
    both = np.where(left[0] * left[1] > 0.0, np.minimum(left[0] ** 2, left[1] ** 2), 0.0)
    return np.log1p(_mean(both, middle)) - np.log1p(_mean(both, beside))


def _mean(values, among) -> np.ndarray:
    """Of each row (s,), NaN where there is nothing."""
    count = among.sum(axis=1)
    return np.where(count > 0, np.sum(values * among, axis=1) / np.maximum(count, 1), np.nan)


def _binned(place_mm, evidence) -> tuple[np.ndarray, np.ndarray]:
    """Middles (b,) of bins along the wire, mm, and the median evidence in each, of those that have any."""
    known = np.isfinite(evidence) & (place_mm > NEAR_CLAMP_MM)
    number = np.floor(place_mm[known] / _BIN_MM).astype(int)
    bins = np.unique(number)
    return (bins + 0.5) * _BIN_MM, np.array(
        [np.median(evidence[known][number == one]) for one in bins]
    )


def _end(place_mm, evidence, sure_mm: float) -> Value | None:
    """Where the evidence ends, of a wire that surely reaches sure_mm; None where it does not stand out, or goes on to
    where nothing more is seen."""
    sure = place_mm < sure_mm
    usual = float(np.median(evidence[sure])) if np.any(sure) else 0.0
    if usual < _LEAST:
        return None
    last = int(np.argmax(np.cumsum(evidence - 0.5 * usual)))
    if place_mm[-1] < place_mm[last] + _BEYOND_MM:
        return None
    low, high = place_mm[last] + 0.5 * _BIN_MM, place_mm[last + 1] - 0.5 * _BIN_MM
    return Value(0.5 * (low + high), float(np.hypot(_BIN_MM, (high - low) / np.sqrt(12.0))))
