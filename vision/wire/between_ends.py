"""The line of a thin object in one picture, given its two ends: a cable, a catheter, a whisker.

    path by its edges → segments along it → positions, light and blur together → line points with sigma

Nothing else is known: not the width, not the light, not the background. The path is coarse
(`ridge_path.py`); about it segments are cut (`strip.py`) and evaluated as those of the wire on the
bench are (`trace.py`), again and again about the line
that was found, until it moves no more. The width is that of the steepest edges
(`steepest_edges.py`); where its evidence (`free_width.py`) says otherwise the sigma holds both.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_lsq_spline
from scipy.stats import theilslopes

from vision.geometry.refusals import Refused
from vision.geometry.robust import robust_sigma
from vision.pictures.pyramid import full_px, shrunk_picture, shrunk_px
from vision.wire.bands import Pieces
from vision.wire.free_width import log_width_of
from vision.wire.points import LinePoints
from vision.wire.ridge_path import CoarsePath, find_paths
from vision.wire.shading import Knots
from vision.wire.steepest_edges import half_width_of, steepest_edges
from vision.wire.strip import Curve, cut_strip, noise_beside, with_background
from vision.wire.trace import WireTrace, to_points, trace

# [px] Half-widths above this are evaluated in a shrunk picture: wires on the bench have 1 to 7.
# Derived.
_LARGEST_RADIUS_PX = 6.0
# [px] Blur before any is found. Stated.
_BLUR_PX = 1.0
# [rounds] Of placing segments about the line of the round before. Study: real_wires.py.
_MOST_ROUNDS = 12
# [sigma] The line has converged where a round moves its points by less, RMS. Derived.
_CONVERGED_SIGMAS = 0.3
# [px] Or by less than this. Derived.
_CONVERGED_PX = 0.02
# [1] Sigma of the line by light from one side, of the width that is seen: where the thickness is not
# known, a side as dark as what is behind is not missed. With it z RMS of 22
# path-traced lines is 0.98, without it 3.0. Study: real_wires.py.
_LIGHT_SHARE = 0.15
# [rounds] In which the width is found anew. Study: real_wires.py.
_WIDTH_ROUNDS = 4
# [px] Sigma of a half-width by the steepest edges: they lie so far from the silhouette of a bar that
# stands out. Study: real_wires.py.
_EDGE_SIGMA_PX = 0.1
# [segments] In a part of the line whose width is found by itself. By 4 or 9 lines of path-traced
# wires are off by 0.180 px RMS in place of 0.187, and points scatter by 1.48 or 1.38 sigma in place
# of 1.32. Study: thresholds.py wire.between_ends _PART_SEGMENTS ….
_PART_SEGMENTS = 6
# [parts] Of the line at most. Stated.
_MOST_PARTS = 4
# [px] Between knots of the curve through the points, and no less than so many widths. By 20 lines
# of path-traced wires are off as much, by 45 by 0.217 px RMS in place of 0.187. Study:
# thresholds.py wire.between_ends _KNOT_PX ….
_KNOT_PX = 30.0
# [widths] Between knots of the curve and of the shading. Half or twice as many move lines of
# path-traced wires by less than 0.005 px. Study: thresholds.py wire.between_ends _KNOT_WIDTHS ….
_KNOT_WIDTHS = 4.0
# [px] No round moves a line by more: segments move by 4, and ends by thrice that. Derived.
_FARTHEST_PX = 12.0
# [px] Sigma of a point, at least, when a curve is laid through. By 0.01 or 0.1 lines of path-traced
# wires move by less than 0.005 px. Study: thresholds.py wire.between_ends _LEAST_SIGMA_PX ….
_LEAST_SIGMA_PX = 0.03
# [segments] An object too short for so many is cut into shorter ones. Stated.
_FEWEST_SEGMENTS = 12
# [px] Length of a segment, at least. Stated.
_LEAST_PIECE_PX = 3.0
# [points] Fewer are no line. Stated.
_FEWEST_POINTS = 6
# [1] Share of the segments that must give a point. By 0.7 one of eight lines of path-traced wires
# more is refused, by 0.3 none less. Study: thresholds.py wire.between_ends _LEAST_SEEN ….
_LEAST_SEEN = 0.5
# [sigmas] Scatter of neighbouring points. Of cables in a compressed picture those that are followed
# have 1.9 to 3.0, one whose shadow was taken for an edge 3.5. Study: real_wires.py.
_MOST_SCATTER = 3.3
# [sigma] Signal of a segment over what its model leaves. 2 to 4.5 move no line of path-traced
# wires. Study: thresholds.py wire.between_ends _LEAST_CONTRAST ….
_LEAST_CONTRAST = 3.0


@dataclass(frozen=True)
class BetweenSettings:
    """Settings of a line between two ends.

    piece_px: length of the segments, each of which gives one point; shorter of a short object.
    margin_px: background read on either side. most_misfit: RMS that the model may leave in the median
    segment, in sigmas of the residuals outside the object.
    """

    piece_px: float = 8.0
    margin_px: float = 7.0
    most_misfit: float = 2.0


@dataclass(frozen=True)
class WireLine:
    """The line of a thin object in one picture.

    points: n points from the start on; `place` is the arc length in px. radius_px (n,): half the
    width. blur_px: of the lens. chi2: median over the segments, per pixel. scatter: see
    `scatter_of`; sigmas are multiplied by it where it is above 1. seen: share of segments that gave a
    point. others: paths between the ends that cost hardly more than that of the line.
    """

    points: LinePoints
    radius_px: np.ndarray
    blur_px: float
    chi2: float
    scatter: float
    seen: float
    others: tuple[CoarsePath, ...] = ()

    @property
    def sigma_px(self) -> np.ndarray:
        """Return the sigma (n,) of each point along its normal, what all points share included."""
        return _whole_sigma_px(self.points)


def trace_between(
    picture: np.ndarray,
    start_px: Sequence[float],
    end_px: Sequence[float],
    settings: BetweenSettings | None = None,
) -> WireLine:
    """Trace the thin object between two points (x, y) of a grey picture (h, w).

    The object is 2 to 40 px wide, darker or brighter than what is behind it, or both in turn;
    the points are a few px off its middle at most. Raises Refused, with a code: end_outside,
    ends_together, no_line (no object joins the ends), hidden (too little of it is seen),
    light_not_explained (its light is not that of a lit rod), not_converged.
    """
    settings = settings or BetweenSettings()
    grey = np.asarray(picture, dtype=float)
    best, *others = find_paths(grey, start_px, end_px)
    scale = max(1, int(np.ceil(np.median(best.radius_px) / _LARGEST_RADIUS_PX)))
    small = shrunk_picture(grey, scale)
    curve = _curve_of(best, scale)
    piece_px = np.clip(curve.length_px / _FEWEST_SEGMENTS, _LEAST_PIECE_PX, settings.piece_px)
    settings = replace(settings, piece_px=float(piece_px))
    found = _converge(small, curve, settings)
    _refuse_unexplained(found, settings)
    return _in_full(found, scale, tuple(others))


def _curve_of(path: CoarsePath, scale: int) -> Curve:
    """Return the smooth curve of a coarse path in the picture shrunk by `scale`."""
    px = shrunk_px(path.px, scale)
    radius = np.full(len(px), float(np.median(path.radius_px)) / scale)
    rough = Curve.through(px, radius)
    return _through(rough, rough.px, np.ones(len(rough.px)), rough.arc_px)


@dataclass(frozen=True)
class _Fitted:
    """A line about which nothing moves: its curve, trace, points, and scatter."""

    curve: Curve
    traced: WireTrace
    points: LinePoints
    scatter: float
    piece_px: float


def _converge(grey: np.ndarray, curve: Curve, settings: BetweenSettings) -> _Fitted:
    """Trace about a curve until the line moves no more; raises Refused where it does not stop."""
    blur_px = _BLUR_PX
    curve = _centred(grey, curve, settings)
    log_sigma = np.inf
    for number in range(_MOST_ROUNDS):
        seen_blur_px = blur_px if number else None
        pieces = _cut(grey, curve, settings, blur_px)
        traced = trace(pieces, _knots(curve), seen_blur_px=seen_blur_px, last=False)
        curve, moved = _next_curve(curve, _points(traced, curve, settings))
        blur_px = traced.blur_px
        if number < _WIDTH_ROUNDS:
            curve, log_sigma = _with_width(grey, curve, settings, blur_px)
        if number >= _WIDTH_ROUNDS and moved < 1.0:
            break
    else:
        raise Refused(
            f"the line still moves after {_MOST_ROUNDS} rounds: by {moved:.1f} of what is allowed",
            code="not_converged",
        )
    return _last_pass(grey, curve, settings, blur_px, log_sigma)


def _last_pass(
    grey: np.ndarray, curve: Curve, settings: BetweenSettings, blur_px: float, log_sigma: float
) -> _Fitted:
    """Trace about a curve that moves no more, with all that its points err by.

    log_sigma: of the object's width, by its edges.
    """
    pieces = _cut(grey, curve, settings, blur_px)
    traced = trace(pieces, _knots(curve), seen_blur_px=blur_px, last=True)
    log_by_evidence = log_width_of(_strip(grey, curve, settings, _wide(curve, settings)), blur_px)
    log_sigma = float(np.hypot(log_sigma, log_by_evidence))
    traced = _with_hidden_causes(grey, curve, settings, traced, log_sigma)
    points = _points(traced, curve, settings)
    return _Fitted(curve, traced, points, scatter_of(points, curve), settings.piece_px)


def _with_hidden_causes(
    grey: np.ndarray, curve: Curve, settings: BetweenSettings, traced: WireTrace, log_sigma: float
) -> WireTrace:
    """Return a trace whose shared causes hold what one sigma of the object's width moves, and light that
    hides a side of it.
    """
    shifts_px = []
    for log in (-log_sigma, log_sigma):
        other = replace(curve, radius_px=curve.radius_px * np.exp(log))
        pieces = _cut(grey, other, settings, traced.blur_px)
        solved = trace(pieces, _knots(curve), seen_blur_px=traced.blur_px, last=False).solved
        shifts_px.append(np.interp(traced.pieces.place, pieces.place, solved.shift_px))
    by_width_px = 0.5 * (shifts_px[1] - shifts_px[0])
    by_light_px = _LIGHT_SHARE * 2.0 * traced.pieces.radius_px
    causes_px = np.stack([by_width_px, by_light_px], axis=1)
    shared_px = np.concatenate([traced.solved.shared_px, causes_px], axis=1)
    return replace(traced, solved=replace(traced.solved, shared_px=shared_px))


def _cut(grey: np.ndarray, curve: Curve, settings: BetweenSettings, blur_px: float) -> Pieces:
    """Return the segments along a curve, with background and noise by both of their sides."""
    pieces = _strip(grey, curve, settings, settings.margin_px)
    return with_background(pieces, blur_px, noise_beside(pieces, blur_px))


def _strip(grey: np.ndarray, curve: Curve, settings: BetweenSettings, margin_px: float) -> Pieces:
    """Return the segments along a curve; raises Refused where too few lie within the picture."""
    pieces = cut_strip(grey, curve, margin_px, settings.piece_px)
    _refuse_few(len(pieces), curve.length_px / settings.piece_px)
    return pieces


def _refuse_few(count: int, possible: float) -> None:
    """Raise Refused where fewer segments show the object than a line needs."""
    needed = max(_FEWEST_POINTS, int(np.ceil(_LEAST_SEEN * int(possible))))
    if count < needed:
        raise Refused(
            f"{count} of {int(possible)} segments between the ends show the object and both of its "
            f"sides, {needed} are needed",
            code="hidden",
        )


def _wide(curve: Curve, settings: BetweenSettings) -> float:
    """Return the margin in which an object half as thick again can be found, px."""
    return settings.margin_px + 0.6 * float(np.median(curve.radius_px))


def _centred(grey: np.ndarray, curve: Curve, settings: BetweenSettings) -> Curve:
    """Return a coarse curve, all of it moved to the middle of the object's two edges, and as wide."""
    pieces = _strip(grey, curve, settings, _wide(curve, settings))
    edges_px = np.array([steepest_edges(pieces)])
    _, normal, _ = curve.at(curve.arc_px)
    px = curve.px + np.mean(edges_px) * normal
    return Curve.through(px, np.full(len(px), half_width_of(edges_px, _BLUR_PX)[0]))


def _with_width(
    grey: np.ndarray, curve: Curve, settings: BetweenSettings, blur_px: float
) -> tuple[Curve, float]:
    """Return a curve with the half-width that is seen along it, and the sigma of its logarithm.

    It is found in several parts of the line by their edges, and changes linearly along it.
    """
    pieces = _strip(grey, curve, settings, _wide(curve, settings))
    parts = int(np.clip(len(pieces) // _PART_SEGMENTS, 1, _MOST_PARTS))
    middles = (np.arange(parts) + 0.5) * (curve.length_px / parts)
    edges_px = np.array([steepest_edges(some) for some in _split(pieces, parts)])
    seen_px = half_width_of(edges_px, blur_px)
    along_px, scatter_px = _robust_line(middles, seen_px, curve.arc_px)
    along_px = np.clip(along_px, 0.7 * np.min(seen_px), 1.4 * np.max(seen_px))
    sigma_px = np.hypot(scatter_px / np.sqrt(parts), _EDGE_SIGMA_PX)
    return replace(curve, radius_px=along_px), float(sigma_px / np.median(seen_px))


def _split(pieces: Pieces, parts: int) -> list[Pieces]:
    """Return segments as so many parts that follow one another."""
    return [pieces.select(part) for part in np.array_split(np.arange(len(pieces)), parts)]


def _robust_line(
    place: np.ndarray, values: np.ndarray, along: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return the straight line through a few values (n,) at places (n,), where it goes along (m,),
    and their scatter about it.

    By the median of all slopes (Theil and Sen), so that one value in four may be wrong.
    """
    if len(values) == 1:
        return np.full(len(along), values[0]), 0.0
    slope, level, _, _ = theilslopes(values, place)
    scatter = robust_sigma(values - level - slope * place)
    return level + slope * along, scatter


def _points(traced: WireTrace, curve: Curve, settings: BetweenSettings) -> LinePoints:
    """Return the points that can be trusted, in order; raises Refused where they are too few."""
    points, _ = to_points(traced)
    _refuse_few(len(points), curve.length_px / settings.piece_px)
    return points


def _next_curve(curve: Curve, points: LinePoints) -> tuple[Curve, float]:
    """Return the curve through points, and by how much of what is allowed it moved, RMS."""
    least_px = np.maximum(points.sigma_px, _LEAST_SIGMA_PX)
    fitted = _through(curve, points.px, least_px, points.place)
    old, normal, _ = curve.at(points.place)
    stretched = fitted.length_px / curve.length_px
    new, _, _ = fitted.at(points.place * stretched)
    moved_px = np.sum((new - old) * normal, axis=1)
    rms_px = float(np.sqrt(np.mean(moved_px**2)))
    median_sigma_px = float(np.median(_whole_sigma_px(points)))
    allowed_px = max(_CONVERGED_PX, _CONVERGED_SIGMAS * median_sigma_px)
    return fitted, rms_px / allowed_px


def _whole_sigma_px(points: LinePoints) -> np.ndarray:
    """Return the sigma (n,) of each point along its normal, what all points share included."""
    shared_px = np.linalg.norm(points.shared_px, axis=1)
    return np.hypot(points.sigma_px, shared_px)


def _through(curve: Curve, px: np.ndarray, sigma_px: np.ndarray, place_px: np.ndarray) -> Curve:
    """Return the smooth curve of points (n, 2) at arc lengths (n,) of a curve, up to its ends."""
    spline = make_lsq_spline(place_px, px, _spline_knots(curve, place_px), w=1.0 / sigma_px)
    inside_px = np.clip(curve.arc_px, float(place_px[0]), float(place_px[-1]))
    past_ends_px = curve.arc_px - inside_px  # there it goes on straight
    tangent = spline.derivative()(inside_px)
    px_along = spline(inside_px) + past_ends_px[:, None] * tangent
    astray_px = float(np.max(np.linalg.norm(px_along - curve.px, axis=1)))
    if not astray_px < _FARTHEST_PX:
        raise Refused(
            f"the line went {astray_px:.0f} px away from what was followed, {_FARTHEST_PX:g} are allowed",
            code="not_converged",
        )
    return Curve.through(px_along, curve.radius_px)


def _spline_knots(curve: Curve, place_px: np.ndarray) -> np.ndarray:
    """Return the knots of a cubic spline through points at arc lengths (n,), three or more each."""
    first = float(place_px[0])
    last = float(place_px[-1])
    most = max(len(place_px) // 3 - 1, 1)
    count = int(np.clip((last - first) / _knot_distance_px(curve), 1, most))
    shares = np.linspace(0.0, 1.0, count + 1)
    inner = np.quantile(place_px, shares[1:-1])
    return np.concatenate([[first] * 4, inner, [last] * 4])  # a cubic's ends count four times


def _knot_distance_px(curve: Curve) -> float:
    """Return the distance between knots along a curve."""
    return max(_KNOT_PX, _KNOT_WIDTHS * 2.0 * float(np.median(curve.radius_px)))


def _knots(curve: Curve) -> Knots:
    """Return the places between which the shading changes linearly."""
    count = max(2, round(curve.length_px / _knot_distance_px(curve)) + 1)
    return Knots(np.linspace(0.0, curve.length_px, count))


def scatter_of(points: LinePoints, curve: Curve) -> float:
    """Return the scatter of neighbouring points about a smooth curve over their sigmas: 1 where noise is
    white and as measured.

    What the curve leaves is a parabola over four points, so that what remains of its third divided
    difference is noise. Codecs and what is printed behind the object leave errors that pixels share.
    """
    foot_px, normal, _ = curve.at(points.place)
    offset_px = np.sum((points.px - foot_px) * normal, axis=1)
    windows = np.lib.stride_tricks.sliding_window_view
    place = windows(points.place, 4)  # (n - 3, 4)
    apart = place[:, :, None] - place[:, None, :] + np.eye(4)
    share = 1.0 / np.prod(apart, axis=2)
    deviation = np.sum(share * windows(offset_px, 4), axis=1)
    sigma = np.sqrt(np.sum((share * windows(points.sigma_px, 4)) ** 2, axis=1))
    return robust_sigma(deviation / sigma)


def _refuse_unexplained(found: _Fitted, settings: BetweenSettings) -> None:
    """Raise Refused where the light along the line is not that of a lit rod before a background."""
    contrast = float(np.median(found.traced.solved.contrast))
    misfit = float(np.sqrt(found.traced.misfit))
    if contrast < _LEAST_CONTRAST * misfit:
        raise Refused(
            f"the object stands out by {contrast / misfit:.1f} times the noise of a segment, "
            f"{_LEAST_CONTRAST:g} are needed",
            code="no_line",
        )
    if found.scatter > _MOST_SCATTER:
        raise Refused(
            f"neighbouring points scatter by {found.scatter:.1f} of their sigmas, {_MOST_SCATTER:g} is "
            "allowed: something else lies along the object",
            code="light_not_explained",
        )
    if misfit > settings.most_misfit:
        raise Refused(
            f"the light along the line differs from that of a lit rod by {misfit:.1f} times the noise "
            f"beside it, {settings.most_misfit:g} is allowed",
            code="light_not_explained",
        )


def _in_full(found: _Fitted, scale: int, others: tuple[CoarsePath, ...]) -> WireLine:
    """Return the line in the full picture."""
    points = found.points
    widen = max(found.scatter, 1.0)
    _, _, radius_px = found.curve.at(points.place)
    full = LinePoints(
        px=full_px(points.px, scale),
        normal=points.normal,
        sigma_px=scale * widen * points.sigma_px,
        place=scale * points.place,
        shared_px=scale * points.shared_px,
        widened_px2=scale**2 * points.widened_px2,
    )
    return WireLine(
        points=full,
        radius_px=scale * radius_px,
        blur_px=scale * found.traced.blur_px,
        chi2=found.traced.misfit,
        scatter=found.scatter,
        seen=min(1.0, len(points) / int(found.curve.length_px / found.piece_px)),
        others=others,
    )
