"""The bar's line in one camera: shift and tilt against where it was expected, by the evidence of both its edges.

The bar stands still, so its frames are averaged. Each stretch of it says by itself how probable a middle is; together
they give the posterior of a straight line. Where an edge is as dark as what is behind it, or a shadow's border may be
taken for it, the posterior is wide or has several peaks, and the line's sigma is as wide.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.bar.evidence import FULL_SCALE, SATURATED
from vision.bar.pieces import ARM_MM, FEWEST_PIECES, at_arms, bar_pieces
from vision.bar.posterior import Posterior, closer_look, first_look, most_probable, roughly
from vision.geometry.contact import BarAxis
from vision.geometry.settings import VisionSettings
from vision.lines.bands import Pieces
from vision.lines.points import LinePoints
from vision.pictures.view import View

FAR_PX, NEAR_PX = 9.0, 3.0  # how far off an axis may be: found among the changes, and settled on coarse lines
_WIDE_PX = 2.0  # lines are looked for as far off, at least
_GAMMAS = (1.0, 2.2)  # of a sensor itself, and of a picture that was encoded for a screen
_POSITIONS = (1, 2)  # of the closer looks, for each step across
_LEAST_CHANCE = 0.001  # of a transfer curve that is still looked at
_MOST = 20.0  # chi²: what one stretch may say against a transfer curve
_LEAST_SHOWN = 0.5
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
                 settings: VisionSettings, *, off_px: float = 0.0, rough: bool = False) -> dict[str, BarLine]:
    """The bar's line in the mean of each view's pictures, by camera; without those where too little of it is clear.

    wires_px: by camera lines (m, 2) where the wire lies in some frame. off_px: how far off the axis may be. rough: one
    quick look, for an axis that may be no bar's.
    """
    pieces = {view.camera.name: _pieces(view, axis, radius_mm, wires_px.get(view.camera.name, []), settings)
              for view in views}
    pieces = {name: some for name, some in pieces.items() if len(some) >= FEWEST_PIECES and _shows(some)}
    first = {name: most_probable(some, off_px) if off_px > NEAR_PX else np.zeros(2) for name, some in pieces.items()}
    reach_px = max(_WIDE_PX, min(off_px, NEAR_PX))
    if rough:
        sure = np.ones(1)
        return {name: _bar_line(some, [roughly(some, first[name], reach_px)], sure, reach_px)
                for name, some in pieces.items()}
    return _settled(pieces, first, reach_px) if pieces else {}


def _settled(pieces: Mapping[str, Pieces], first: Mapping[str, np.ndarray], reach_px: float) -> dict[str, BarLine]:
    """The lines after looks ever closer by, under each transfer curve and then the likely ones alone."""
    gammas = np.array(_GAMMAS)
    seen = {name: [first_look(some, first[name], reach_px, gamma) for gamma in gammas] for name, some in pieces.items()}
    likely = np.ones(len(gammas), dtype=bool)
    for positions in _POSITIONS:
        seen = {name: [closer_look(pieces[name], before, gamma, positions)
                       for before, gamma, is_likely in zip(by_gamma, gammas, likely) if is_likely]
                for name, by_gamma in seen.items()}
        chances, gammas = _chances(seen.values()), gammas[likely]
        likely = chances > _LEAST_CHANCE
    return {name: _bar_line(some, seen[name], chances, reach_px) for name, some in pieces.items()}


def _chances(cameras: Iterable[Sequence[Posterior]]) -> np.ndarray:
    """Of each transfer curve: the cameras of a bench are of one kind. All stretches of a bar are lit nearly alike, so
    that what they say of a curve by their light counts once a camera; one that no curve explains says little."""
    total = 0.0
    for by_gamma in cameras:
        least = np.array([one.least / np.max([other.temper for other in by_gamma], axis=0) for one in by_gamma])
        against = -2.0 * np.logaddexp(-0.5 * (least - least.min(axis=0)), -0.5 * _MOST)
        total = total + against.mean(axis=1) + [one.room for one in by_gamma]
    chance = np.exp(-0.5 * (total - total.min()))
    return chance / chance.sum()


def _bar_line(pieces: Pieces, by_gamma: Sequence[Posterior], chances, reach_px: float) -> BarLine:
    """The line by all transfer curves, each by its chance."""
    lines, own = np.array([one.line for one in by_gamma]), np.array([one.covariance for one in by_gamma])
    line = chances @ lines
    covariance = np.einsum("g,gij->ij", chances, own + np.einsum("gi,gj->gij", lines - line, lines - line))
    for_bar, clearness = chances @ np.array([[one.for_bar, one.clearness] for one in by_gamma])
    unresolved = 3.0 * np.sqrt(np.linalg.det(covariance)) / reach_px**2  # a flat one's variance is reach² / 3
    moved_px = float(np.sum(np.abs(line)))
    return BarLine(_two_points(pieces, line, covariance), moved_px, float(for_bar), float(clearness), float(unresolved))


def _shows(pieces: Pieces) -> bool:
    """Whether more than a half of the pixels are there, and not saturated."""
    return bool(np.mean((pieces.weight > 0) & (pieces.grey < SATURATED)) > _LEAST_SHOWN)


def _pieces(view: View, axis: BarAxis, radius_mm: float, wires_px, settings: VisionSettings) -> Pieces:
    """Pieces of the bar in the view's mean picture, with its noise, in grey levels of 8 bit."""
    quiet = replace(view, noise=view.noise.times(view.mean_share))
    pieces = bar_pieces(quiet, view.mean, axis, radius_mm, wires_px, settings)
    scale = FULL_SCALE / view.full_scale
    return replace(pieces, grey=pieces.grey * scale, background=pieces.background * scale,
                   slope=pieces.slope * scale, weight=pieces.weight / scale)


def _two_points(pieces: Pieces, line, covariance) -> LinePoints:
    """The line as two points at ± ARM_MM, each with its sigma."""
    place, foot, normal, _ = at_arms(pieces)
    lever = place / ARM_MM
    across = np.stack([np.ones(2), lever], axis=1)
    sigma = np.sqrt(np.einsum("ni,ij,nj->n", across, covariance, across))
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return LinePoints(foot + (line[0] + line[1] * lever)[:, None] * normal, normal, sigma, place)
