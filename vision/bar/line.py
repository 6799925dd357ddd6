"""The bar's line in one camera: shift and tilt against where it was expected, from its outline's two edges.

The bar stands still, so its frames are averaged. Near each rim its shading is a free but smooth function of the angle
round the bar, so that a dark rim is not taken for an edge farther in; the middle, with its highlights, is left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.bar.pieces import (
    ARM_MM,
    FEWEST_PIECES,
    NO_BAR,
    at_arms,
    bar_knots,
    bar_pieces,
    of_bar_alone,
    rims_of,
)
from vision.geometry.contact import BarAxis
from vision.geometry.newton import covariance_of, descend
from vision.geometry.settings import VisionSettings
from vision.lines.bands import Pieces
from vision.lines.binned import binned, without
from vision.lines.cylinder import RIMS, WAVES
from vision.lines.points import LinePoints
from vision.lines.shading import Knots, fit_shading, locate, wave_prior
from vision.pictures.view import View

_THICK_PX = 6.0  # half-width from which a rim is wide enough beside the blur to be looked at alone
_UNTOLD_PX, _LOST_PX = 0.25, 0.6  # sigmas beyond which the misfit has no minimum to speak of, and may lead anywhere
_LEAST_OFF_PX = 0.15
_ROUGHLY, _EXACTLY = (0.3,), (0.1, 0.05)  # px: what a line may still move by, round by round
_STEPS, _LONGEST = np.array([0.15, 0.15, 0.1]), np.array([0.7, 0.7, 0.4])  # shift, tilt (px), log blur
FAR_PX, NEAR_PX = 9.0, 3.0  # how far off an axis may be: found among the changes, and settled on coarse lines
_BIN_PX, _COARSE_BIN_PX = 0.25, 0.75
_BLURS_PX = (0.55, 0.8, 1.15, 1.65, 2.4)  # to begin with
# Formal sigmas count every pixel's noise as independent; the shading's misfit is not (see docs/truth.md).
_FORMAL_TO_TRUE = 2.0


@dataclass(frozen=True)
class BarLine:
    """Line points (two) of the bar's middle, `place` mm along the axis they were expected on; how far from there; and
    how badly a bar explains the pixels (chi² each)."""

    points: LinePoints
    moved_px: float
    misfit: float

    @property
    def is_bar(self) -> bool:
        """Whether what is seen is a bar."""
        return self.misfit <= NO_BAR

    @property
    def told(self) -> bool:
        """Whether it is one, and its line is told, well somewhere and not too badly anywhere."""
        least, most = np.min(self.points.sigma_px), np.max(self.points.sigma_px)
        return self.is_bar and bool(least <= _UNTOLD_PX and most <= _LOST_PX)


def measure_bar(view: View, grey, axis: BarAxis, radius_mm: float, wires_px: Sequence[np.ndarray],
                settings: VisionSettings, *, off_px: float = 0.0,
                last: bool = False) -> BarLine | None:
    """The bar's line in the mean picture `grey`; None where too little of it is clear, or what is seen is no bar.

    wires_px: lines (m, 2) where the wire lies in some frame. off_px: how far off the axis may be; where it may be, a
    line to a tenth of a pixel is enough. last: no better axis will come, so a line that is none is not handed on.
    """
    pieces, knots = bar_pieces(view, grey, axis, radius_mm, wires_px, settings), bar_knots(settings)
    if len(pieces) < FEWEST_PIECES:
        return None
    line, blur_px = _sweep(pieces, knots, off_px), None
    pieces = of_bar_alone(pieces, lambda some: _moved(some, line), knots)
    for settled_px in _EXACTLY if last else _ROUGHLY:  # line, blur, and what counts as a rim depend on each other
        model = _model(pieces, line, knots)
        line, blur_px, covariance, misfit = _settle(model, line, blur_px, settled_px)
        on_line = _on_line(replace(model, blur_px=blur_px), line)
        pieces = pieces.select(on_line) if np.sum(on_line) >= FEWEST_PIECES else pieces
    found = BarLine(_two_points(pieces, line, covariance), float(np.sum(np.abs(line))), misfit)
    return found if found.told or not last else None


@dataclass(frozen=True)
class _Model:
    """How pieces of the bar are explained: with which shading (terms, its knots and prior) and which blur."""

    pieces: Pieces
    terms: int
    knots: Knots
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
    """Rims alone where the bar is thick, all of it where it is thin."""
    if float(np.median(pieces.radius_px)) > _THICK_PX:
        return _Model(rims_of(pieces, _moved(pieces, line)), RIMS, knots, 1.0, None)
    return _Model(pieces, WAVES, knots, 1.0, wave_prior(pieces, WAVES))


def _on_line(model: _Model, line) -> np.ndarray:
    """Which pieces (s,) lie on the line by themselves, to four times their scatter; a clamp's border does not."""
    shift = locate(_moved(model.pieces, line), model.shading(line)[0]).shift_px
    off = np.abs(shift - np.median(shift))
    return off < max(4.0 * 1.48 * np.median(off), _LEAST_OFF_PX)


def _sweep(pieces: Pieces, knots, off_px: float) -> np.ndarray:
    """Coordinate descent over ± off_px of shift and tilt with a coarse, blurred model and every other piece."""
    few, _ = binned(pieces.select(slice(None, None, 2)), _COARSE_BIN_PX)
    line, model = np.zeros(2), _Model(few, WAVES, knots, 1.5, None)
    for reach, step in ((FAR_PX, 1.5), (NEAR_PX, 0.75)):
        if reach > off_px:
            continue
        grid = np.arange(-reach, reach + 1e-9, step)
        for _ in range(2):
            for k in range(2):
                tries = [line + d * np.eye(2)[k] for d in grid]
                line = tries[int(np.argmin([model.misfit(q) for q in tries]))]
    return line


def _settle(model: _Model, line, blur_px: float | None, settled_px: float):
    """Line and lens blur at the least misfit, the line's covariance (2, 2) from the curvature there, and the misfit."""
    pieces, blurred = binned(model.pieces, _BIN_PX)
    few = replace(model, pieces=pieces)
    misfit = lambda q: replace(few, blur_px=float(np.exp(q[2]))).misfit(q[:2])  # noqa: E731
    blurs = np.log(_BLURS_PX if blur_px is None else [blur_px])
    begin = min((np.array([*line, blur]) for blur in blurs), key=misfit)
    q, _, curvature = descend(misfit, begin, _STEPS, _LONGEST, settled_px)
    blur_px = without(np.exp(q[2]), blurred)
    here = replace(model, blur_px=blur_px).misfit(q[:2])
    covariance = covariance_of(curvature, here, float(np.sum(pieces.weight > 0)))
    return q[:2], blur_px, covariance[:2, :2] * _FORMAL_TO_TRUE**2, here


def _two_points(pieces: Pieces, line, covariance) -> LinePoints:
    """The line as two points at ± ARM_MM, each with its sigma."""
    place, foot, normal, _ = at_arms(pieces)
    lever = place / ARM_MM
    across = np.stack([np.ones(2), lever], axis=1)
    sigma = np.sqrt(np.einsum("ni,ij,nj->n", across, covariance, across))
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return LinePoints(foot + (line[0] + line[1] * lever)[:, None] * normal, normal, sigma, place)
