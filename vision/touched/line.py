"""The bar's line in one camera: shift and tilt against where it was expected, by the evidence of both its edges.

The bar stands still, so its frames are averaged. Each stretch of it says by itself how probable a middle is; together
they give the posterior of a straight line. Where an edge is as dark as what is behind it, or a shadow's border may be
taken for it, the posterior is wide or has several peaks, and the line's sigma is as wide.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.geometry.contact import BarAxis
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.view import SATURATED, View
from vision.touched.pieces import ARM_MM, FEWEST_PIECES, at_arms, bar_pieces, beside_wires
from vision.touched.posterior import Posterior, closer_look, first_look, most_probable, roughly
from vision.touched.profiles import FULL_SCALE
from vision.wire.bands import Pieces
from vision.wire.points import SHARED, LinePoints

# [px] How far off an axis may be: found by a highlight in place of both edges, and settled by its
# lines. Study: bar_scenes.py.
FAR_PX, NEAR_PX = 9.0, 3.0
# [px] An axis that rough lines settled is less far off: 1.7 at most in 61 path-traced scenes.
# Study: bar_scenes.py.
_WIDE_PX = 2.0
# [1] Transfer curves: of a sensor itself, and of a picture that was encoded for a screen (sRGB,
# nearly). All cameras weigh them together. Stated.
_GAMMAS = (1.0, 2.2)
# [chance] Of a transfer curve that is still looked at closer by, and of one after a first look:
# in 15 path-traced scenes that was wrong by 150 times at most. Study: chosen.
_LEAST_CHANCE, _LEAST_AT_FIRST = 1e-3, 1e-6
# [chi²] What one stretch may say against a transfer curve: odds of 22 000 to one; one with
# squares behind it says anything. Study: bar_starts.py.
_MOST = 20.0
# [1] Share of a bar's pixels that are there and not saturated; with fewer there is no line. Set
# by eye. Study: bar_scenes.py.
_LEAST_SHOWN = 0.5
# [chi²] Tempered, for a bar and against none: odds of 22 000 to one. Derived.
_LEAST_EVIDENCE = 20.0
# [1] Share of the possible lines that are left: bars leave 0.13 at most, clamps and shadows 0.2
# to 1. Study: bar_scenes.py.
_MOST_UNRESOLVED = 1.0 / 6.0
# [px] What a bar's line is off by as a whole, and by tilt, beyond its own sigma, times the root
# of by how much its evidence is overstated beyond 1: the true lines of 79 path-traced views are
# most probable with 0.02 to 0.025, 95.6 % of their points are within 1.96 with the latter; the
# second is half of it. Study: bar_starts.py.
OVERSTATED_PX = np.array([0.025, 0.0125])
# [1] No light is so plain. Stated.
_LEAST_BEYOND = 0.01


@dataclass(frozen=True)
class BarLine:
    """Line points (two) of the bar's middle, `place` mm along the axis they were expected on; and how much more
    probable a bar is there than none: twice the log of the ratio; and how clearly it is one, whatever its contrast: the
    log of how many times worse the light is explained without it; and what share of the lines that were possible in the
    last look still are. looks: the posterior under each transfer curve that is likely; line (2,): what they have
    together, shift and tilt in px. pieces: what was looked at."""

    points: LinePoints
    for_bar: float
    clearness: float
    unresolved: float
    looks: Mapping[float, Posterior]
    line: np.ndarray
    pieces: Pieces

    @property
    def is_bar(self) -> bool:
        """Whether what is seen is a bar."""
        return self.for_bar > _LEAST_EVIDENCE

    @property
    def has_edges(self) -> bool:
        """Whether that bar's edges are seen, too, in a rough look: it lies somewhere among the lines that were
        possible."""
        return self.is_bar and self.unresolved < _MOST_UNRESOLVED

    def seen_from(self, pieces: Pieces) -> dict[float, Posterior]:
        """The looks, about another axis."""
        place, foot, normal, _ = at_arms(pieces)
        off = np.sum((self.points.px - foot) * normal, axis=1) / np.sum(normal**2, axis=1)
        moved = np.linalg.solve(np.stack([np.ones(2), place / ARM_MM], axis=1), off) - self.line
        return {gamma: replace(one, line=one.line + moved) for gamma, one in self.looks.items()}


def find_lines(
    views: Sequence[View],
    axis: BarAxis,
    radius_mm: float,
    wires_px: Mapping[str, Sequence[np.ndarray]],
    settings: VisionSettings,
) -> dict[str, BarLine]:
    """The lines by one quick look, for an axis that is NEAR_PX off, or no bar's. See `measure_bars`."""
    pieces = clear_pieces(views, axis, radius_mm, wires_px, settings)
    return {name: _quick(some, np.zeros(2)) for name, some in pieces.items()}


def look_farther(lines: Mapping[str, BarLine]) -> dict[str, BarLine]:
    """Quick looks at the same about the most probable lines up to FAR_PX off; where that lies within what a quick look
    has seen, this one's."""
    farther = {}
    for name, line in lines.items():
        there = most_probable(line.pieces, FAR_PX)
        farther[name] = line if np.all(np.abs(there) < NEAR_PX) else _quick(line.pieces, there)
    return farther


def _quick(pieces: Pieces, about: np.ndarray) -> BarLine:
    return _bar_line(pieces, {1.0: roughly(pieces, about, NEAR_PX)}, np.ones(1))


def measure_bars(
    views: Sequence[View],
    axis: BarAxis,
    radius_mm: float,
    wires_px: Mapping[str, Sequence[np.ndarray]],
    settings: VisionSettings,
    before: Mapping[str, BarLine] | None = None,
) -> dict[str, BarLine]:
    """The bar's line in the mean of each view's pictures, by camera; without those where too little of it is clear.

    wires_px: by camera lines (m, 2) where the wire lies in some frame. before: what was measured about an axis nearby,
    by which the lines are measured finely; without it, to some tenths of their sigma.
    """
    pieces = clear_pieces(views, axis, radius_mm, wires_px, settings)
    if not pieces:
        return {}
    if before:
        gammas = list(next(iter(before.values())).looks)
        seen = {
            name: before[name].seen_from(some)
            if name in before
            else _closer(some, _first(some, gammas), 1)
            for name, some in pieces.items()
        }
    else:
        seen = {name: _first(some, _GAMMAS) for name, some in pieces.items()}
        gammas = [
            gamma
            for gamma, chance in zip(_GAMMAS, _chances(seen.values()))
            if chance > _LEAST_AT_FIRST
        ]
        seen = {name: {gamma: looks[gamma] for gamma in gammas} for name, looks in seen.items()}
    seen = {name: _closer(pieces[name], looks, 2 if before else 1) for name, looks in seen.items()}
    chances = _chances(seen.values())
    likely = chances > _LEAST_CHANCE
    kept = [gamma for gamma, is_likely in zip(gammas, likely) if is_likely]
    chances = chances[likely] / chances[likely].sum()
    return {
        name: _bar_line(pieces[name], {gamma: looks[gamma] for gamma in kept}, chances)
        for name, looks in seen.items()
    }


def _first(pieces: Pieces, gammas: Iterable[float]) -> dict[float, Posterior]:
    """First looks, by transfer curve."""
    return {gamma: first_look(pieces, np.zeros(2), _WIDE_PX, gamma) for gamma in gammas}


def _closer(
    pieces: Pieces, looks: Mapping[float, Posterior], positions: int
) -> dict[float, Posterior]:
    """The next looks, at so many positions for each step across."""
    return {gamma: closer_look(pieces, one, gamma, positions) for gamma, one in looks.items()}


def clear_pieces(
    views: Sequence[View],
    axis: BarAxis,
    radius_mm: float,
    wires_px: Mapping[str, Sequence[np.ndarray]],
    settings: VisionSettings,
) -> dict[str, Pieces]:
    """By camera the pieces of the bar, where enough are clear. wires_px: see `measure_bars`."""
    pieces = {
        view.camera.name: _pieces(
            view, axis, radius_mm, wires_px.get(view.camera.name, []), settings
        )
        for view in views
    }
    return {
        name: some for name, some in pieces.items() if len(some) >= FEWEST_PIECES and _shows(some)
    }


def _chances(cameras: Iterable[Mapping[float, Posterior]]) -> np.ndarray:
    """Of each transfer curve: the cameras of a bench are of one kind. All stretches of a bar are lit nearly alike, so
    that what they say of a curve by their light counts once a camera; one that no curve explains says little."""
    total = 0.0
    for looks in cameras:
        temper = np.max([one.temper for one in looks.values()], axis=0)
        least = np.array([one.least for one in looks.values()]) / temper
        against = -2.0 * np.logaddexp(-0.5 * (least - least.min(axis=0)), -0.5 * _MOST)
        total = total + against.mean(axis=1) + [one.room for one in looks.values()]
    chance = np.exp(-0.5 * (total - total.min()))
    return chance / chance.sum()


def _bar_line(pieces: Pieces, looks: Mapping[float, Posterior], chances) -> BarLine:
    """The line by all transfer curves, each by its chance."""
    seen = looks.values()
    lines, own = np.array([one.line for one in seen]), np.array([one.covariance for one in seen])
    line = chances @ lines
    covariance = np.einsum(
        "g,gij->ij", chances, own + np.einsum("gi,gj->gij", lines - line, lines - line)
    )
    mixed = chances @ np.array([[one.for_bar, one.clearness, one.unresolved] for one in seen])
    beyond = chances @ np.array([np.median(one.temper) for one in seen]) - 1.0
    points = _two_points(
        pieces, line, covariance, np.sqrt(max(beyond, _LEAST_BEYOND)) * OVERSTATED_PX
    )
    return BarLine(points, *map(float, mixed), looks, line, pieces)


def _shows(pieces: Pieces) -> bool:
    """Whether more than a half of the pixels are there, and not saturated."""
    return bool(np.mean(pieces.weight > 0) > _LEAST_SHOWN)


def _pieces(
    view: View, axis: BarAxis, radius_mm: float, wires_px, settings: VisionSettings
) -> Pieces:
    """Pieces of the bar in the view's mean picture, with its noise, in grey levels of 8 bit; saturated pixels weigh
    nothing."""
    noise = view.noise.times(view.mean_share)
    pieces = bar_pieces(view, noise, axis, radius_mm, wires_px, settings)
    if len(pieces) < FEWEST_PIECES and view.itself is None:
        pieces = beside_wires(bar_pieces(view, noise, axis, radius_mm, (), settings), wires_px)
    pieces = pieces.below(SATURATED * view.full_scale)
    scale = FULL_SCALE / view.full_scale
    return replace(
        pieces,
        grey=pieces.grey * scale,
        background=pieces.background * scale,
        slope=pieces.slope * scale,
        weight=pieces.weight / scale,
    )


def _two_points(pieces: Pieces, line, covariance, shared_px) -> LinePoints:
    """The line as two points at ± ARM_MM, each with its sigma; shared_px (2,): sigma of a shift and a tilt besides."""
    place, foot, normal, _ = at_arms(pieces)
    lever = place / ARM_MM
    across = np.stack([np.ones(2), lever], axis=1)
    sigma = np.sqrt(np.einsum("ni,ij,nj->n", across, covariance, across))
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    shared = np.hstack([across * shared_px, np.zeros((2, SHARED - 2))])
    return LinePoints(
        foot + (line[0] + line[1] * lever)[:, None] * normal, normal, sigma, place, shared
    )
