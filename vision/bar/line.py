"""The bar's line in one camera: shift and tilt against where it was expected, by the evidence of both its edges.

The bar stands still, so its frames are averaged. Each stretch of it says by itself how probable a middle is; together
they give the posterior of a straight line. Where an edge is as dark as what is behind it, or a shadow's border may be
taken for it, the posterior is wide or has several peaks, and the line's sigma is as wide.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline

from vision.bar.evidence import FULL_SCALE, Evidence, Profile, evidence, profiles
from vision.bar.pieces import ARM_MM, FEWEST_PIECES, at_arms, bar_pieces
from vision.geometry.contact import BarAxis
from vision.geometry.settings import VisionSettings
from vision.lines.bands import Pieces
from vision.lines.points import LinePoints
from vision.pictures.view import SATURATED, View

FAR_PX, NEAR_PX = 9.0, 3.0  # how far off an axis may be: found among the changes, and settled on coarse lines
# Lines are looked for as far off, at least, then once more close by if they are known so well.
_WIDE_PX, _CLOSE_PX, _WITHIN_SIGMAS = 2.0, 1.0, 4.0
_STRETCHES = 6
_FAR_STEP_PX = 0.75
_STEPS, _GRID = 25, 121  # shifts at which the evidence is taken, and lines between, by shift and by tilt
_FAR_BLUR_PX, _BLURS_PX = 1.6, (0.6, 0.8, 1.0, 1.25, 1.6)
_GAMMAS = (1.0, 2.2)  # of a sensor itself, and of a picture that was encoded for a screen
# Of minus twice the log evidence: neighbouring bins err alike, by compression and by what no model has. With this the
# RMS of z over path-traced bars is 1.1 (tests/ladder/bar_scenes.py).
_TEMPER = 4.0
_LEAST_CHANCE = 0.01  # of a transfer curve that is still looked at
_LEAST_SHOWN = 0.5
_MOST = 40.0  # of the same: what one stretch may say against a line; a clamp or a hole in the bench says anything
_LEAST_EVIDENCE = 20.0  # for a bar and against none, tempered
# Of the area of lines that were possible: where nearly all of them still are, no edge is seen. Bars that are there
# leave 0.13 at most, what is taken for one along a clamp or a shadow 0.2 to 1 (tests/ladder/bar_scenes.py).
_MOST_UNRESOLVED = 1.0 / 6.0


@dataclass(frozen=True)
class BarLine:
    """Line points (two) of the bar's middle, `place` mm along the axis they were expected on; how far from there; and
    how much more probable a bar is there than none: twice the log of the ratio; and how clearly it is one, whatever its
    contrast: the log of how many times worse the light is explained without it; and what share of the lines that were
    possible still are."""

    points: LinePoints
    moved_px: float
    for_bar: float
    clearness: float
    unresolved: float

    @property
    def is_bar(self) -> bool:
        """Whether what is seen is a bar."""
        return self.for_bar > _LEAST_EVIDENCE

    @property
    def has_edges(self) -> bool:
        """Whether that bar's edges are seen, too: it lies somewhere among the lines that were possible."""
        return self.is_bar and self.unresolved < _MOST_UNRESOLVED


def measure_bars(views: Sequence[View], axis: BarAxis, radius_mm: float, wires_px: Mapping[str, Sequence[np.ndarray]],
                 settings: VisionSettings, *, off_px: float = 0.0) -> dict[str, BarLine]:
    """The bar's line in the mean of each view's pictures, by camera; without those where too little of it is clear.

    wires_px: by camera lines (m, 2) where the wire lies in some frame. off_px: how far off the axis may be.
    """
    pieces = {view.camera.name: _pieces(view, axis, radius_mm, wires_px.get(view.camera.name, []), settings)
              for view in views}
    pieces = {name: some for name, some in pieces.items() if len(some) >= FEWEST_PIECES and _shows(some)}
    line = {name: _far(some, off_px) if off_px > NEAR_PX else np.zeros(2) for name, some in pieces.items()}
    reach_px = max(_WIDE_PX, min(off_px, NEAR_PX))
    wide = {name: [_posterior(_moved(some, line[name]), reach_px, gamma) for gamma in _GAMMAS]
            for name, some in pieces.items()}
    chances = _chances(wide.values()) if wide else None
    return {name: _bar_line(some, line[name], wide[name], chances, reach_px) for name, some in pieces.items()}


@dataclass(frozen=True)
class _Posterior:
    """Of shift and tilt over ARM_MM (2,), px, with one transfer curve and one blur: mean, covariance, minus twice the
    log evidence, how much more probable a bar is than none, and by how much its misfit is less."""

    line: np.ndarray
    covariance: np.ndarray
    evidence: float
    for_bar: float
    clearness: float
    gamma: float
    blur_px: float


def _chances(cameras: Iterable[Sequence[_Posterior]]) -> np.ndarray:
    """Of each transfer curve: the cameras of a bench are of one kind."""
    total = np.sum([[one.evidence for one in by_gamma] for by_gamma in cameras], axis=0)
    chance = np.exp(-0.5 * (total - total.min()))
    return chance / chance.sum()


def _bar_line(pieces: Pieces, line, wide: Sequence[_Posterior], chances, reach_px: float) -> BarLine:
    """The line by all transfer curves, each by its chance; looked for once more close by if it is known so well."""
    mean, covariance = _mixed(wide, chances)
    unresolved = float(3.0 * np.sqrt(np.linalg.det(covariance))) / reach_px**2  # a flat one's variance is reach² / 3
    line, for_bar = line + mean, float(chances @ [one.for_bar for one in wide])
    clearness = float(chances @ [one.clearness for one in wide])
    if np.sqrt(np.max(np.diag(covariance))) < _CLOSE_PX / _WITHIN_SIGMAS:
        likely = chances > _LEAST_CHANCE
        again = [_posterior(_moved(pieces, line), _CLOSE_PX, one.gamma, one.blur_px)
                 for one, is_likely in zip(wide, likely) if is_likely]
        mean, covariance = _mixed(again, chances[likely] / chances[likely].sum())
        line = line + mean
    points, moved_px = _two_points(pieces, line, covariance), float(np.sum(np.abs(line)))
    return BarLine(points, moved_px, for_bar, clearness, unresolved)


def _mixed(posteriors: Sequence[_Posterior], chances) -> tuple[np.ndarray, np.ndarray]:
    """Mean (2,) and covariance (2, 2) of a mixture."""
    lines = np.array([one.line for one in posteriors])
    mean = chances @ lines
    own = np.array([one.covariance for one in posteriors])
    return mean, np.einsum("g,gij->ij", chances, own + np.einsum("gi,gj->gij", lines - mean, lines - mean))


def _shows(pieces: Pieces) -> bool:
    """Whether more than a half of the pixels are there, and not saturated."""
    return bool(np.mean((pieces.weight > 0) & (pieces.grey < SATURATED * FULL_SCALE)) > _LEAST_SHOWN)


def _pieces(view: View, axis: BarAxis, radius_mm: float, wires_px, settings: VisionSettings) -> Pieces:
    """Pieces of the bar in the view's mean picture, with its noise, in grey levels of 8 bit."""
    quiet = replace(view, noise=view.noise.times(view.mean_share))
    pieces = bar_pieces(quiet, view.mean, axis, radius_mm, wires_px, settings)
    scale = FULL_SCALE / view.full_scale
    return replace(pieces, grey=pieces.grey * scale, background=pieces.background * scale,
                   weight=pieces.weight / scale)


def _moved(pieces: Pieces, line) -> Pieces:
    return pieces.moved(line[0] + line[1] * pieces.place / ARM_MM)


def _far(pieces: Pieces, off_px: float) -> np.ndarray:
    """The most probable line (2,) by blurred pictures, on a coarse grid."""
    shifts = np.arange(-off_px, off_px + 0.5 * _FAR_STEP_PX, _FAR_STEP_PX)
    seen = profiles(pieces, _STRETCHES, off_px, 1.0)
    misfit, lines = _over_lines(evidence(seen, shifts, _FAR_BLUR_PX), seen, off_px)
    return lines[np.unravel_index(np.argmin(misfit), misfit.shape)]


def _posterior(pieces: Pieces, reach_px: float, gamma: float, blur_px: float | None = None) -> _Posterior:
    """Over lines within reach_px, under the lens blur that explains the pieces best where it is not given."""
    shifts = np.linspace(-reach_px, reach_px, _STEPS)
    seen = profiles(pieces, _STRETCHES, reach_px, gamma)
    blur_px = _best_blur(seen, shifts[::3]) if blur_px is None else blur_px
    found = evidence(seen, shifts, blur_px)
    misfit, lines = _over_lines(found, seen, reach_px)
    chance = np.exp(-0.5 * (misfit - misfit.min()))
    total = chance.sum()
    mean = np.einsum("ab,abi->i", chance, lines) / total
    away = lines - mean
    for_bar = float(np.sum((found.of_none - found.of_bar.min(axis=1)) / _temper(found)))
    return _Posterior(mean, np.einsum("ab,abi,abj->ij", chance, away, away) / total,
                      float(misfit.min() - 2.0 * np.log(total)), for_bar, _clearness(found), gamma, blur_px)


def _best_blur(seen: Sequence[Profile], shifts) -> float:
    """The lens blur, px, with the most evidence: of a few, downhill from the middle one, then between them by a
    parabola of their logarithms."""
    least = cache(lambda k: float(np.sum(evidence(seen, shifts, _BLURS_PX[k]).of_bar.min(axis=1))))
    lowest, middle = len(_BLURS_PX) // 2, 0
    while middle != min(max(lowest, 1), len(_BLURS_PX) - 2):
        middle = min(max(lowest, 1), len(_BLURS_PX) - 2)
        near = range(middle - 1, middle + 2)
        lowest = min(near, key=least)
    blurs = [_BLURS_PX[k] for k in near]
    square, slope, _ = np.polyfit(np.log(blurs), [least(k) for k in near], 2)
    if square <= 0.0:
        return _BLURS_PX[lowest]
    return float(np.clip(np.exp(-0.5 * slope / square), blurs[0], blurs[-1]))


def _clearness(found: Evidence) -> float:
    """The log of how many times worse the light is explained without a bar: of the median stretch."""
    return float(np.median(np.log(np.maximum(found.misfit_of_none, 1.0) / np.maximum(found.misfit, 1.0))))


def _temper(found: Evidence) -> np.ndarray:
    """By how much (k,) each stretch's evidence is overstated."""
    return _TEMPER * np.maximum(found.misfit, 1.0)


def _over_lines(found: Evidence, seen: Sequence[Profile], reach_px: float) -> tuple[np.ndarray, np.ndarray]:
    """Minus twice the log probability (n, n) of lines (n, n, 2), shift and tilt in px, all within reach_px.

    Where the stretches' own middles lie on no line to their sigmas, these are taken to be as much larger.
    """
    grid = np.linspace(-reach_px, reach_px, _GRID)
    lines = np.stack(np.meshgrid(grid, grid, indexing="ij"), axis=-1)
    own = found.of_bar / _temper(found)[:, None]
    least = own.min(axis=1, keepdims=True)
    total = np.zeros(lines.shape[:2])
    for one, curve in zip(seen, np.minimum(own - least, _MOST)):
        there = np.clip(lines @ [1.0, one.place_mm / ARM_MM], -reach_px, reach_px)
        total += np.clip(CubicSpline(found.shift_px, curve)(there), 0.0, _MOST)
    scatter = max(1.0, total.min() / max(len(seen) - 2, 1))
    return float(np.sum(least)) + total / scatter, lines


def _two_points(pieces: Pieces, line, covariance) -> LinePoints:
    """The line as two points at ± ARM_MM, each with its sigma."""
    place, foot, normal, _ = at_arms(pieces)
    lever = place / ARM_MM
    across = np.stack([np.ones(2), lever], axis=1)
    sigma = np.sqrt(np.einsum("ni,ij,nj->n", across, covariance, across))
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return LinePoints(foot + (line[0] + line[1] * lever)[:, None] * normal, normal, sigma, place)
