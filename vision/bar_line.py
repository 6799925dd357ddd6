"""The bar's line in one camera: shift and tilt against where it was expected, from its outline's two edges.

The bar stands still, so its frames are averaged. Near each rim its shading is a free but smooth function of the angle
round the bar, so that a dark rim is not taken for an edge farther in; the middle, with its highlights, is left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from vision.contact import BarAxis
from vision.effort import VisionSettings
from vision.line import RIMS, WAVES, LinePoints, Pieces, cut_pieces, read_band
from vision.shading import fit_shading, locate, piece_misfit, wave_prior
from vision.silhouette import outline
from vision.trace import View

ARM_MM = 20.0  # the line is handed on as two points, this far to either side
_INNER_SHARE = 0.72
_THICK_PX = 6.0  # half-width from which a rim is wide enough beside the blur to be looked at alone
_FEWEST_PIECES = 4
_WORST_MISFIT = 3.0  # of the median piece's
_KNOT_MM = 14.0
_LEAST_OFF_PX = 0.15
_ROUNDS = 3
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
    for _ in range(_ROUNDS):  # blur, line, and what counts as a rim depend on each other
        model = _model(pieces, line, knots)
        line, covariance, misfit = _settle(model, line)
        on_line = _on_line(model, line)
        pieces = pieces.select(on_line) if np.sum(on_line) >= _FEWEST_PIECES else pieces
    return BarLine(_two_points(pieces, line, covariance), model.blur_px, misfit)


@dataclass(frozen=True)
class _Model:
    """How pieces of the bar are explained: with which shading (terms, its knots and prior) and which blur."""

    pieces: Pieces
    terms: int
    knots: np.ndarray
    blur_px: float
    prior: np.ndarray | None

    def shading(self, line):
        """Shading and misfit with the line shifted by line[0] px and tilted by line[1] px over ARM_MM."""
        return fit_shading(_moved(self.pieces, line), self.blur_px, self.terms, self.knots, prior=self.prior)

    def misfit(self, line) -> float:
        """Mean chi² per pixel; with a prior, less the log evidence."""
        return self.shading(line)[1]


def _moved(pieces: Pieces, line) -> Pieces:
    return pieces.moved(line[0] + line[1] * pieces.place / ARM_MM)


def _model(pieces: Pieces, line, knots) -> _Model:
    """Rims alone where the bar is thick, all of it where it is thin; the blur under which it is explained best."""
    thick = float(np.median(pieces.radius_px)) > _THICK_PX
    rims = _rims(pieces, line) if thick else pieces
    first = _Model(rims, RIMS if thick else WAVES, knots, 1.0, None if thick else wave_prior(pieces, WAVES))
    best = int(np.argmin([replace(first, blur_px=blur).misfit(line) for blur in _BLURS_PX]))
    around = _BLURS_PX[max(best - 1, 0)], _BLURS_PX[min(best + 1, len(_BLURS_PX) - 1)]
    found = minimize_scalar(lambda blur: replace(first, blur_px=blur).misfit(line), bounds=around, method="bounded",
                            options={"xatol": 0.02})
    return replace(first, blur_px=float(found.x))


def _rims(pieces: Pieces, line) -> Pieces:
    """Pieces without their middle: highlights there say nothing about the edges."""
    inner = np.abs(_moved(pieces, line).offset_px) < _INNER_SHARE * pieces.radius_px[:, None]
    return replace(pieces, weight=np.where(inner, 0.0, pieces.weight))


def _pieces(view: View, grey, axis: BarAxis, radius_mm: float, settings: VisionSettings) -> Pieces:
    place = np.linspace(-settings.bar_reach_mm, settings.bar_reach_mm, 200)
    points = axis.point_mm + place[:, None] * axis.direction
    middle, radius = outline(view.camera, points, np.broadcast_to(axis.direction, points.shape), radius_mm)
    half = int(np.ceil(np.nanmax(radius))) + settings.bar_margin_px
    return cut_pieces([read_band(grey, view.background, middle, place, radius, half)], settings.bar_piece_px,
                      view.noise)


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
        moved = _moved(pieces, line)
        misfit = piece_misfit(moved, fit_shading(moved, 1.0, WAVES, knots)[0])
        good = misfit < _WORST_MISFIT * np.median(misfit)
        if np.all(good) or np.sum(good) < _FEWEST_PIECES:
            break
        pieces = pieces.select(good)
    return pieces


def _on_line(model: _Model, line) -> np.ndarray:
    """Which pieces (s,) lie on the line by themselves, to four times their scatter; a clamp's border does not."""
    shift = locate(_moved(model.pieces, line), model.shading(line)[0]).shift_px
    off = np.abs(shift - np.median(shift))
    return off < max(4.0 * 1.48 * np.median(off), _LEAST_OFF_PX)


def _sweep(pieces: Pieces, knots) -> np.ndarray:
    """Coordinate descent over ± 9 px of shift and tilt with a coarse, blurred model."""
    line, model = np.zeros(2), _Model(pieces, WAVES, knots, 1.5, None)
    for reach, step in ((9.0, 1.5), (3.0, 0.75)):
        grid = np.arange(-reach, reach + 1e-9, step)
        for _ in range(2):
            for k in range(2):
                tries = [line + d * np.eye(2)[k] for d in grid]
                line = tries[int(np.argmin([model.misfit(q) for q in tries]))]
    return line


def _settle(model: _Model, line):
    """Shift and tilt at the least misfit, their covariance (2, 2) from its curvature, and the misfit there."""
    simplex = line + np.array([[0.0, 0.0], [0.6, 0.0], [0.0, 0.6]])
    found = minimize(model.misfit, line, method="Nelder-Mead",
                     options={"initial_simplex": simplex, "xatol": 0.01, "fatol": 1e-6, "maxfev": 60})
    curvature = _curvature(model.misfit, found.x, found.fun)
    pixels = float(np.sum(model.pieces.weight > 0))
    values, vectors = np.linalg.eigh(0.5 * pixels * curvature / max(found.fun, 1.0))
    inverse = vectors @ np.diag(1.0 / np.maximum(values, 4.0)) @ vectors.T
    return found.x, inverse * _FORMAL_TO_TRUE**2, found.fun


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
