"""The bar's two edges in one camera: how wide it looks, and so how far away it is.

Two cameras tell where a bar is by where their sights cross, and there its width adds next to nothing. One camera has
only the width. The rims' shading is as free as for the bar's line (see `vision.bar_line`); but what a wrong rim does to
the middle cancels, and to the width it does not, so each edge has its own error.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from vision.bar_line import ARM_MM, clear_of_wire
from vision.contact import BarAxis
from vision.effort import VisionSettings
from vision.line import RIMS, WAVES, LinePoints, Pieces, cut_pieces, read_band
from vision.shading import fit_shading, locate
from vision.silhouette import outline
from vision.trace import View

# An edge's error beyond its formal one, which half-widths of path-traced and painted bars show (docs/truth.md).
EDGE_PX, FORMAL_TO_TRUE = 0.12, 2.0
_FEWEST_PIECES = 4
_INNER_SHARE = 0.72  # of the half-width: highlights farther in say nothing about the edges
_WORST_MISFIT = 3.0  # of the median piece's, or of what noise alone gives, if that is more
_NO_BAR = 3.5  # chi² per pixel: a bar before its background leaves 0.1 to 2
_KNOT_MM = 14.0
_SWEEP_BLUR_PX = 1.5
_SWEEP_REACH_MM = 20.0
# Shift and tilt in px; widening and taper in half-widths, the latter of a bar at 20 degrees to the sight.
_SWEEP_MOST_PX, _SWEEP_MOST_SHARE = (5.0, 5.0), np.array([0.2, 0.15])
_SWEEP_PARTS = (1.0, 0.3, 0.1)
_ROUNDS = 2  # what counts as a rim depends on where the edges are
_STEPS = np.array([0.15, 0.15, 0.15, 0.15, 0.1])  # for derivatives by shift, tilt, widening, taper (px), log blur
_LONGEST = np.array([0.7, 0.7, 0.7, 0.7, 0.4])
_MOST_STEPS, _SETTLED_PX, _PARTS = 12, 0.005, (1.0, 0.3, 0.1, 0.03)
_LEAST_CURVATURE = 4.0  # px⁻²: what the pictures do not tell is told to half a pixel by nothing


def measure_edges(view: View, grey, axis: BarAxis, radius_mm: float, wires_px: Sequence[np.ndarray],
                  settings: VisionSettings, *, coarse: bool = False) -> dict[int, LinePoints] | None:
    """Two points of each of the bar's edges in the mean picture `grey`, by side: 1 towards the points' normals, -1
    against them. None where too little of the bar is clear, or what is seen is no bar.

    wires_px: lines (m, 2) where the wire lies in some frame. coarse: the axis may be some pixels off, and its width.
    """
    pieces = _pieces(view, grey, axis, radius_mm, settings)
    pieces = pieces.select(clear_of_wire(pieces, wires_px, settings.bar_piece_px / 2 + 5.0))
    knots = np.arange(-settings.bar_reach_mm, settings.bar_reach_mm + 1e-9, _KNOT_MM)
    if len(pieces) < _FEWEST_PIECES:
        return None
    found = np.append(_sweep(pieces, knots) if coarse else np.zeros(4), 0.0)
    pieces = _of_bar_alone(pieces, found, knots)
    for _ in range(_ROUNDS):
        rims = _rims(pieces, found)
        misfit = lambda q: fit_shading(_placed(rims, q), float(np.exp(q[4])), RIMS, knots)[1]  # noqa: B023, E731
        found, curvature, left = _settle(misfit, found)
    if left > _NO_BAR:
        return None
    return _edges(pieces, found, _covariance(curvature, left, float(np.sum(rims.weight > 0))))


def _pieces(view: View, grey, axis: BarAxis, radius_mm: float, settings: VisionSettings) -> Pieces:
    place = np.linspace(-settings.bar_reach_mm, settings.bar_reach_mm, 200)
    points = axis.point_mm + place[:, None] * axis.direction
    middle, radius = outline(view.camera, points, np.broadcast_to(axis.direction, points.shape), radius_mm)
    half = int(np.ceil(np.nanmax(radius))) + settings.bar_margin_px
    return cut_pieces([read_band(grey, view.background, middle, place, radius, half)], settings.bar_piece_px,
                      view.noise)


def _placed(pieces: Pieces, q) -> Pieces:
    """The same pixels about a rod that is shifted by q[0] px and tilted by q[1] px over ARM_MM, whose half-width is
    larger by q[2] px and grows by q[3] px over ARM_MM."""
    lever = pieces.place / ARM_MM
    moved = pieces.moved(q[0] + q[1] * lever)
    return replace(moved, radius_px=np.maximum(moved.radius_px + q[2] + q[3] * lever, 1.0))


def _sweep(pieces: Pieces, knots) -> np.ndarray:
    """Coordinate descent over shift, tilt, widening and taper with a coarse, blurred model, near the contact."""
    near = np.abs(pieces.place) < _SWEEP_REACH_MM
    some, found = pieces.select(near) if np.sum(near) >= _FEWEST_PIECES else pieces, np.zeros(4)
    misfit = lambda q: fit_shading(_placed(some, q), _SWEEP_BLUR_PX, WAVES, knots)[1]  # noqa: E731
    most = np.array([*_SWEEP_MOST_PX, *np.median(pieces.radius_px) * _SWEEP_MOST_SHARE])
    for part in _SWEEP_PARTS:
        for _ in range(2):
            for k in (0, 2, 1, 3):
                steps = part * most[k] * np.linspace(-1.0, 1.0, 9)
                tries = [np.clip(found + step * np.eye(4)[k], -most, most) for step in steps]
                found = min(tries, key=misfit)
    return found


def _of_bar_alone(pieces: Pieces, found, knots) -> Pieces:
    """Without the pieces that a bar before its background cannot explain: clamps, the wire, a shadow's border."""
    for _ in range(3):
        placed = _placed(pieces, found)
        misfit = locate(placed, fit_shading(placed, 1.0, WAVES, knots)[0], rounds=1).chi2
        good = misfit < _WORST_MISFIT * max(float(np.median(misfit)), 1.0)
        if np.all(good) or np.sum(good) < _FEWEST_PIECES:
            break
        pieces = pieces.select(good)
    return pieces


def _rims(pieces: Pieces, found) -> Pieces:
    placed = _placed(pieces, found)
    inner = np.abs(placed.offset_px) < _INNER_SHARE * placed.radius_px[:, None]
    rims = replace(pieces, weight=np.where(inner, 0.0, pieces.weight))
    return rims.columns(np.any(rims.weight > 0, axis=0))


def _settle(misfit: Callable, q) -> tuple[np.ndarray, np.ndarray, float]:
    """Where the misfit is least, by Newton's method with derivatives from differences; curvature (5, 5) and misfit."""
    here = misfit(q)
    for _ in range(_MOST_STEPS):
        slope, curvature = _derivatives(misfit, q, here)
        values, vectors = np.linalg.eigh(curvature)
        values = np.maximum(np.abs(values), 1e-3 * np.max(np.abs(values)))
        step = -vectors @ ((vectors.T @ slope) / values)
        step /= max(1.0, np.max(np.abs(step) / _LONGEST))
        lower, there = min(((misfit(q + part * step), q + part * step) for part in _PARTS), key=lambda trial: trial[0])
        if lower >= here:
            break
        here, q = lower, there
        if np.max(np.abs(step[:4])) < _SETTLED_PX:
            break
    return q, curvature, here


def _derivatives(misfit: Callable, q, here: float) -> tuple[np.ndarray, np.ndarray]:
    """Gradient (n,) and second derivatives (n, n) by central differences."""
    step = np.diag(_STEPS)
    ahead, behind = (np.array([misfit(q + sign * row) for row in step]) for sign in (1, -1))
    curvature = np.diag(ahead + behind - 2.0 * here)
    for i in range(len(q)):
        for j in range(i):
            both = misfit(q + step[i] + step[j])
            curvature[i, j] = curvature[j, i] = both - ahead[i] - ahead[j] + here
    return (ahead - behind) / (2.0 * _STEPS), curvature / np.outer(_STEPS, _STEPS)


def _covariance(curvature, misfit: float, pixels: float) -> np.ndarray:
    """Of shift, tilt, widening and taper, (4, 4) px², from noise alone."""
    values, vectors = np.linalg.eigh(0.5 * pixels * curvature / max(misfit, 1.0))
    return (vectors @ np.diag(1.0 / np.maximum(values, _LEAST_CURVATURE)) @ vectors.T)[:4, :4]


def _edges(pieces: Pieces, found, covariance) -> dict[int, LinePoints]:
    """Points at ± ARM_MM of both edges, each with its sigma."""
    order, place = np.argsort(pieces.place), np.array([-ARM_MM, ARM_MM])
    known = np.column_stack([pieces.foot_px, pieces.normal, pieces.radius_px])[order]
    foot_normal_radius = np.stack([np.polyval(np.polyfit(pieces.place[order], column, 2), place)
                                   for column in known.T], axis=1)
    foot, normal, radius = foot_normal_radius[:, :2], foot_normal_radius[:, 2:4], foot_normal_radius[:, 4]
    points = {}
    for side in (-1, 1):
        across = np.stack([np.ones(2), place / ARM_MM, np.full(2, side), side * place / ARM_MM], axis=1)
        formal = np.sqrt(np.einsum("ni,ij,nj->n", across, covariance, across))
        off = across @ found[:4] + side * radius
        px = foot + off[:, None] * normal
        points[side] = LinePoints(px, _across(px, normal), np.hypot(EDGE_PX, FORMAL_TO_TRUE * formal), place)
    return points


def _across(px, normal) -> np.ndarray:
    """Unit normals (2, 2) of the line through two points, on the side of the given ones."""
    along = (px[1] - px[0]) / np.linalg.norm(px[1] - px[0])
    across = np.array([-along[1], along[0]])
    return np.tile(across * np.sign(across @ normal.sum(axis=0)), (2, 1))
