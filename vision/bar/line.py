"""The bar's line in one camera: shift and tilt against where it was expected, by the evidence of both its edges.

The bar stands still, so its frames are averaged. Each stretch of it says by itself how probable a middle is; together
they give the posterior of a straight line. Where an edge is as dark as what is behind it, or a shadow's border may be
taken for it, the posterior is wide or has several peaks, and the line's sigma is as wide.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from vision.bar.evidence import FULL_SCALE, SATURATED, Evidence, Profiles, evidence, profiles
from vision.bar.pieces import ARM_MM, FEWEST_PIECES, at_arms, bar_pieces
from vision.geometry.contact import BarAxis
from vision.geometry.settings import VisionSettings
from vision.lines.bands import Pieces
from vision.lines.points import LinePoints
from vision.pictures.view import View

FAR_PX, NEAR_PX = 9.0, 3.0  # how far off an axis may be: found among the changes, and settled on coarse lines
# Lines are looked for as far off, at least, then once more close by if they are known so well.
_WIDE_PX, _CLOSE_PX, _WITHIN_SIGMAS = 2.0, 1.0, 4.0
_STRETCHES = 6
_LEVER = 1.6
_PARTS = (1, 1, 2)
_LEAST_PX, _BLUR_REACH = 0.25, (0.1, 0.5)
_SPLINE_BLURS = 0.25
_BLUR_GRID, _GRID = 13, 33  # shifts at which the evidence is taken, and lines between, by shift and by tilt
_FAR_BLUR_PX, _BLURS_PX = 1.6, (0.6, 0.85, 1.2, 1.7)
_GAMMAS = (1.0, 2.2)  # of a sensor itself, and of a picture that was encoded for a screen
# Of minus twice the log evidence: neighbouring bins err alike, by compression and by what no model has. With this the
# RMS of z over path-traced bars is 1.1 (tests/ladder/bar_scenes.py).
_TEMPER = 4.0
_LEAST_CHANCE = 0.01  # of a transfer curve that is still looked at
_LEAST_SHOWN = 0.5
_MOST = 40.0  # of the same: what one stretch may say against a line; a clamp or a hole in the bench says anything
_LEAST_EVIDENCE = 20.0  # for a bar and against none, tempered


@dataclass(frozen=True)
class BarLine:
    """Line points (two) of the bar's middle, `place` mm along the axis they were expected on; how far from there; and
    how much more probable a bar is there than none: twice the log of the ratio; and how clearly it is one, whatever its
    contrast: the log of how many times worse the light is explained without it."""

    points: LinePoints
    moved_px: float
    for_bar: float
    clearness: float

    @property
    def is_bar(self) -> bool:
        """Whether what is seen is a bar."""
        return self.for_bar > _LEAST_EVIDENCE


def measure_bars(views: Sequence[View], axis: BarAxis, radius_mm: float, wires_px: Mapping[str, Sequence[np.ndarray]],
                 settings: VisionSettings, *, off_px: float = 0.0) -> dict[str, BarLine]:
    """The bar's line in the mean of each view's pictures, by camera; without those where too little of it is clear.

    wires_px: by camera lines (m, 2) where the wire lies in some frame. off_px: how far off the axis may be.
    """
    pieces = {view.camera.name: _pieces(view, axis, radius_mm, wires_px.get(view.camera.name, []), settings)
              for view in views}
    pieces = {name: some for name, some in pieces.items() if len(some) >= FEWEST_PIECES and _shows(some)}
    if not pieces:
        return {}
    reach_px = max(_WIDE_PX, min(off_px, NEAR_PX))
    first = {name: _far(some, off_px) if off_px > NEAR_PX else np.zeros(2) for name, some in pieces.items()}
    found = {name: [_settled(some, first[name], reach_px, gamma) for gamma in _GAMMAS] for name, some in pieces.items()}
    chances = _chances(found.values())
    return {name: _bar_line(some, found[name], chances) for name, some in pieces.items()}


def _settled(pieces: Pieces, line, reach_px: float, gamma: float) -> "_Posterior":
    """From a line (2,) that may be reach_px off, look by look closer by."""
    window = _Window.around(reach_px)
    for parts in _PARTS:
        found = _posterior(_moved(pieces, line), window, gamma, parts)
        line = line + found.line
        window = _Window.after(found)
    return replace(found, line=line)


@dataclass(frozen=True)
class _Window:
    """Where a line is looked for: as far off (2,), px, at its middle and over ARM_MM; under lens blurs (n,), px."""

    most_px: np.ndarray
    blurs_px: np.ndarray

    @classmethod
    def around(cls, reach_px: float) -> "_Window":
        return cls(np.full(2, reach_px), np.array(_BLURS_PX))

    @classmethod
    def after(cls, wide: "_Posterior") -> "_Window":
        """About a posterior."""
        sigma = np.sqrt(np.diag(wide.covariance))
        wide_by = np.clip(np.hypot(_WITHIN_SIGMAS * wide.log_blur_sigma, wide.log_blur_step), *_BLUR_REACH)
        return cls(np.clip(_WITHIN_SIGMAS * sigma, _LEAST_PX, _WIDE_PX), wide.blur_px * np.exp(np.linspace(-wide_by, wide_by, 4)))


@dataclass(frozen=True)
class _Posterior:
    """Of shift and tilt over ARM_MM (2,), px, all lens blurs mixed: mean, covariance, minus twice the log evidence, how
    much more probable a bar is than none, and by how much its misfit is less; and the blur, px."""

    line: np.ndarray
    covariance: np.ndarray
    evidence: float
    for_bar: float
    clearness: float
    blur_px: float
    log_blur_sigma: float
    log_blur_step: float


def _chances(cameras: Iterable[Sequence[_Posterior]]) -> np.ndarray:
    """Of each transfer curve: the cameras of a bench are of one kind."""
    total = np.sum([[one.evidence for one in by_gamma] for by_gamma in cameras], axis=0)
    chance = np.exp(-0.5 * (total - total.min()))
    return chance / chance.sum()


def _bar_line(pieces: Pieces, found: Sequence[_Posterior], chances) -> BarLine:
    """The line by all transfer curves, each by its chance."""
    lines = np.array([one.line for one in found])
    line = chances @ lines
    own = np.array([one.covariance for one in found])
    covariance = np.einsum("g,gij->ij", chances, own + np.einsum("gi,gj->gij", lines - line, lines - line))
    for_bar, clearness = (float(chances @ [getattr(one, what) for one in found]) for what in ("for_bar", "clearness"))
    return BarLine(_two_points(pieces, line, covariance), float(np.sum(np.abs(line))), for_bar, clearness)


def _shows(pieces: Pieces) -> bool:
    """Whether more than a half of the pixels are there, and not saturated."""
    return bool(np.mean((pieces.weight > 0) & (pieces.grey < SATURATED)) > _LEAST_SHOWN)


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
    seen = profiles(pieces, _STRETCHES, off_px, 1.0)
    found = [evidence(seen, off_px, _FAR_BLUR_PX)]
    misfit, lines, _ = _over_lines(found, seen, _Window(np.full(2, off_px), np.array([_FAR_BLUR_PX])))
    return lines[np.argmin(misfit.min(axis=(1, 2)))]


def _posterior(pieces: Pieces, window: _Window, gamma: float, parts: int = 1) -> _Posterior:
    """Over lines within a window, the lens blur mixed over as all that is not known."""
    reach_px = min(float(window.most_px @ [1.0, _LEVER]), 3.0)
    seen = profiles(pieces, _STRETCHES, reach_px, gamma)
    found = [evidence(seen, reach_px, blur_px, parts) for blur_px in window.blurs_px]
    misfit, lines, log_blurs = _over_lines(found, seen, window)
    chance = np.exp(-0.5 * (misfit - misfit.min()))
    total = chance.sum()
    of_line, of_blur = chance.sum(axis=(1, 2)) / total, chance.sum(axis=(0, 1)) / total
    mean, log_blur = of_line @ lines, of_blur @ log_blurs
    away = lines - mean
    best = min(found, key=lambda one: one.of_bar.min(axis=(1, 2)).sum())
    for_bar = float(np.sum((best.of_none - best.of_bar.min(axis=(1, 2))) / _temper(best, seen)))
    return _Posterior(mean, (of_line * away.T) @ away, float(misfit.min() - 2.0 * np.log(total / chance.size)), for_bar,
                      _clearness(best), float(np.exp(log_blur)), float(np.sqrt(of_blur @ (log_blurs - log_blur) ** 2)),
                      float(np.max(np.diff(log_blurs), initial=0.0)))


def _clearness(found: Evidence) -> float:
    """The log of how many times worse the light is explained without a bar: of the median stretch."""
    return float(np.median(np.log(np.maximum(found.misfit_of_none, 1.0) / np.maximum(found.misfit, 1.0))))


def _temper(found: Evidence, seen: Profiles) -> np.ndarray:
    """By how much (k,) each stretch's evidence is overstated."""
    return TEMPER(seen) * np.maximum(found.misfit, 1.0)


def TEMPER(seen):
    import os
    return float(os.environ.get('TT',1.0))*seen.alike


def _over_lines(found: Sequence[Evidence], seen: Profiles, window: _Window) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Minus twice the log probability (n, b) of lines (n, 2), shift and tilt in px, and logarithms of blurs (b,).

    Where the stretches' own middles lie on no line to their sigmas, these are taken to be as much larger.
    """
    ends = [np.linspace(-most, most, _GRID) for most in window.most_px]
    lines = np.stack(np.meshgrid(*ends, indexing="ij"), axis=-1).reshape(-1, 2)
    shift, logs = found[0].shift_px, np.log(window.blurs_px)
    fine = np.max(np.diff(logs), initial=0.0) < _SPLINE_BLURS
    log_blurs = np.linspace(logs[0], logs[-1], _BLUR_GRID) if fine else logs
    best = min(found, key=lambda one: one.of_bar.min(axis=(1, 2)).sum())
    own = np.stack([one.of_bar for one in found], axis=-1) / _temper(best, seen)[:, None, None, None]
    if fine:
        own = CubicSpline(logs, own, axis=-1)(log_blurs)
    own = own.reshape(len(seen), len(shift), -1)
    least = own.min(axis=1)
    total = np.zeros((len(lines), own.shape[-1]))
    for place_mm, curve, low in zip(seen.place_mm, own, least):
        there = np.clip(lines @ [1.0, place_mm / ARM_MM], shift[0], shift[-1])
        against = np.maximum(CubicSpline(shift, curve - low)(there), 0.0)
        total += -2.0 * np.logaddexp(-0.5 * against, -0.5 * _MOST)
    scatter = max(1.0, total.min() / max(len(seen) - 2, 1))
    total = np.sum(least, axis=0) + total / scatter
    return total.reshape(len(lines), -1, len(log_blurs)), lines, log_blurs


def _two_points(pieces: Pieces, line, covariance) -> LinePoints:
    """The line as two points at ± ARM_MM, each with its sigma."""
    place, foot, normal, _ = at_arms(pieces)
    lever = place / ARM_MM
    across = np.stack([np.ones(2), lever], axis=1)
    sigma = np.sqrt(np.einsum("ni,ij,nj->n", across, covariance, across))
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return LinePoints(foot + (line[0] + line[1] * lever)[:, None] * normal, normal, sigma, place)
