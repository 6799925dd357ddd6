"""The bar's line in one camera: shift and tilt against where it was expected, from its outline's two edges.

The bar stands still, so all frames are averaged. Its shading is free but smooth near the rims; a highlight in the
middle says nothing about the edges and is weighted down.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from vision.contact import BarAxis
from vision.effort import VisionSettings
from vision.line import LinePoints, Pieces, cut_pieces, read_band, shading_terms
from vision.shading import fit_shading, piece_misfit
from vision.silhouette import outline
from vision.trace import View

ARM_MM = 20.0  # the line is handed on as two points, this far to either side
_INNER_SHARE, _INNER_WEIGHT = 0.72, 0.2
_FEWEST_PIECES = 4
_WORST_MISFIT = 5.0  # of the median piece's
_KNOT_MM = 14.0
_BLURS_PX = (0.5, 0.6, 0.7, 0.8, 0.9, 1.05, 1.25, 1.5, 1.9, 2.5)
# Formal sigmas count every pixel's noise as independent; the shading's misfit is not (see docs/truth.md).
_FORMAL_TO_TRUE = 2.0


@dataclass(frozen=True)
class BarLine:
    """Line points (two) of the bar's middle, `place` mm along the axis they were expected on; lens blur in px."""

    points: LinePoints
    blur_px: float
    misfit: float


def measure_bar(view: View, grey, axis: BarAxis, radius_mm: float, wires_px: Sequence[np.ndarray],
                settings: VisionSettings, coarse: bool) -> BarLine | None:
    """The bar's line in the mean picture `grey`; None where too little of it is clear.

    wires_px: lines (m, 2) where the wire lies in some frame. coarse: the axis may be 10 px off.
    """
    pieces = _pieces(view, grey, axis, radius_mm, settings)
    pieces = pieces.select(clear_of_wire(pieces, wires_px, settings.bar_piece_px / 2 + 5.0))
    if len(pieces) < _FEWEST_PIECES:
        return None
    knots = np.arange(-settings.bar_reach_mm, settings.bar_reach_mm + 1e-9, _KNOT_MM)
    line = np.zeros(2)
    if coarse:
        line = _sweep(pieces, knots)
    pieces = _of_bar_alone(pieces, line, knots)
    radius = float(np.median(pieces.radius_px))
    blur = _best_blur(pieces, line, radius, knots)
    line, covariance, misfit = _settle(pieces, line, blur, shading_terms(radius, blur), knots)
    return BarLine(_two_points(pieces, line, covariance), blur, misfit)


def _pieces(view: View, grey, axis: BarAxis, radius_mm: float, settings: VisionSettings) -> Pieces:
    place = np.linspace(-settings.bar_reach_mm, settings.bar_reach_mm, 200)
    points = axis.point_mm + place[:, None] * axis.direction
    middle, radius = outline(view.camera, points, np.broadcast_to(axis.direction, points.shape), radius_mm)
    half = int(np.ceil(np.nanmax(radius))) + settings.bar_margin_px
    pieces = cut_pieces([read_band(grey, view.background, middle, place, radius, half)],
                        settings.bar_piece_px, view.noise)
    inner = np.abs(pieces.offset_px) < _INNER_SHARE * pieces.radius_px[:, None]
    return replace(pieces, weight=np.where(inner, _INNER_WEIGHT, 1.0) * pieces.weight)


def clear_of_wire(pieces: Pieces, wires_px: Sequence[np.ndarray], margin_px: float) -> np.ndarray:
    """Which pieces (s,) of the bar show no wire: each reads a rectangle along and across the bar."""
    tangent = np.stack([pieces.normal[:, 1], -pieces.normal[:, 0]], axis=1)
    clear = np.ones(len(pieces), dtype=bool)
    for line in wires_px:
        away = line[None] - pieces.foot_px[:, None]
        along = np.abs(np.einsum("smi,si->sm", away, tangent))
        across = np.abs(np.einsum("smi,si->sm", away, pieces.normal))
        clear &= ~np.any((along < margin_px) & (across < pieces.radius_px[:, None] + margin_px), axis=1)
    return clear


def _of_bar_alone(pieces: Pieces, line, knots) -> Pieces:
    """Without the pieces that a bar before its background cannot explain: clamps, the hub, a shadow's border."""
    for _ in range(3):
        moved = pieces.moved(line[0] + line[1] * pieces.place / ARM_MM)
        misfit = piece_misfit(moved, fit_shading(moved, 1.0, 8, knots)[0])
        good = misfit < _WORST_MISFIT * np.median(misfit)
        if np.all(good) or np.sum(good) < _FEWEST_PIECES:
            break
        pieces = pieces.select(good)
    return pieces


def _misfit(pieces: Pieces, line, blur_px, terms, knots) -> float:
    """Mean chi² per pixel with the line shifted by line[0] px and tilted by line[1] px over ARM_MM."""
    moved = pieces.moved(line[0] + line[1] * pieces.place / ARM_MM)
    return fit_shading(moved, blur_px, terms, knots)[1]


def _sweep(pieces: Pieces, knots) -> np.ndarray:
    """Coordinate descent over ± 9 px of shift and tilt with a coarse, blurred model."""
    line = np.zeros(2)
    for reach, step in ((9.0, 1.5), (3.0, 0.75)):
        grid = np.arange(-reach, reach + 1e-9, step)
        for _ in range(2):
            for k in range(2):
                tries = [line + d * np.eye(2)[k] for d in grid]
                line = tries[int(np.argmin([_misfit(pieces, q, 1.5, 8, knots) for q in tries]))]
    return line


def _best_blur(pieces: Pieces, line, radius_px, knots) -> float:
    misfits = [_misfit(pieces, line, blur, shading_terms(radius_px, blur), knots) for blur in _BLURS_PX]
    return _BLURS_PX[int(np.argmin(misfits))]


def _settle(pieces: Pieces, line, blur_px, terms, knots):
    """Shift and tilt at the least misfit, their covariance (2, 2) from its curvature, and the misfit there."""
    simplex = line + np.array([[0.0, 0.0], [0.6, 0.0], [0.0, 0.6]])
    found = minimize(lambda q: _misfit(pieces, q, blur_px, terms, knots), line, method="Nelder-Mead",
                     options={"initial_simplex": simplex, "xatol": 0.01, "fatol": 1e-5, "maxfev": 60})
    line, curvature = found.x, _curvature(lambda q: _misfit(pieces, q, blur_px, terms, knots), found.x, found.fun)
    pixels = float(np.sum(pieces.weight > 0))
    values, vectors = np.linalg.eigh(0.5 * pixels * curvature / max(found.fun, 1.0))
    inverse = vectors @ np.diag(1.0 / np.maximum(values, 4.0)) @ vectors.T
    return line, inverse * _FORMAL_TO_TRUE**2, found.fun


def _curvature(misfit, line, here: float, step: float = 0.15) -> np.ndarray:
    """Second derivatives (2, 2) of the misfit by central differences."""
    value = lambda a, b: misfit(line + np.array([a, b]))  # noqa: E731
    xx = (value(step, 0) + value(-step, 0) - 2 * here) / step**2
    yy = (value(0, step) + value(0, -step) - 2 * here) / step**2
    xy = (value(step, step) - value(step, -step) - value(-step, step) + value(-step, -step)) / (4 * step**2)
    return np.array([[xx, xy], [xy, yy]])


def _two_points(pieces: Pieces, line, covariance) -> LinePoints:
    """The line as two points at ± ARM_MM, each with its sigma."""
    order = np.argsort(pieces.place)
    place = np.array([-ARM_MM, ARM_MM])
    lever = place / ARM_MM
    across = np.stack([np.ones(2), lever], axis=1)
    sigma = np.sqrt(np.einsum("ni,ij,nj->n", across, covariance, across))
    foot, normal = (np.stack([np.polyval(np.polyfit(pieces.place[order], values[order, k], 2), place)
                              for k in range(2)], axis=1) for values in (pieces.foot_px, pieces.normal))
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return LinePoints(foot + (line[0] + line[1] * lever)[:, None] * normal, normal, sigma, place)
