"""Where a straight bar lies, by the evidence of its stretches: a posterior of shift and tilt, all else mixed over.

The lens blur, and how smooth the light round the bar is, are numbers of the whole camera. Neither is chosen: a bar
whose edge is dim may lie a fifth of a pixel elsewhere under another blur.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from vision.touched.evidence import Evidence, LitRod, evidence
from vision.touched.pieces import ARM_MM
from vision.touched.profiles import STEP_PX, Profiles, profiles
from vision.wire.bands import Pieces

# [stretches] Of the bar, each with its own light: two for a line, four left over to show one that
# sees something else. Study: thresholds.py bar.posterior STRETCHES ….
STRETCHES = 6
# [sigma] A next look reaches as far: 6 in 100 000 Gaussian lines lie beyond. Derived.
_WITHIN_SIGMAS = 4.0
# [px, 1] Least and most that a next look reaches: a step of the grid; and in the logarithm of the
# blur, where a tenth has three places of its posterior. Study: bar_starts.py.
_LINE_PX, _LOG_BLUR = (0.25, 2.0), (0.1, 0.5)
# [px] Lens blurs of a first look. Study: bar_starts.py.
_BLURS_PX = 0.6, 0.85, 1.2, 1.7
# [px] Lens blur of a quick look, by which a bar is told from what is none; and of the far look:
# the widest, so that no peak lies between its positions. Study: bar_scenes.py.
_ROUGH_BLUR_PX, _FAR_BLUR_PX = 1.0, 1.6
# [blurs] Between positions of a look that is not close, a cubic spline between: at 0.83 of a blur
# that undershot, and a transfer curve's chance was 0.2 in place of 0.99 in one of 18 scenes.
# Study: bar_scenes.py.
_APART_BLURS = 0.5
# [1] Blurs nearer to each other, in their logarithm, have a cubic spline between; farther apart
# it undershoots. Study: bar_starts.py.
_SPLINE = 0.25
# [lines, blurs] Of the grid: a third of a sigma apart, by shift and by tilt; and a sigma by blur:
# sums over a Gaussian are exact to 1e-8. Derived.
_LINES, _BLURS = 25, 9
# [px] Lines of a wide window lie so near at least, and of the far look, of which another begins:
# at 0.56 px they stepped over the right one in one of 53 path-traced scenes. Study:
# bar_scenes.py.
_APART_PX, _FAR_APART_PX = 0.1, 0.3
# [blurs] Of a next look: fewer leave no spline. Derived.
_NEXT_BLURS = 4
# [px] A look goes no farther. Derived.
_LONGEST_PX = 3.0
# [px] The middle of a bar of another width, from where it is expected: half of what a bar of 4 mm
# for 6 is wider by. Derived.
_ASIDE_PX = 2.0
# [1, log] Other widths that are tried, those within 0.16 first: a bar of 4 mm for 6 is 0.41 off;
# a cubic spline between, two sigma of a clear bar apart. Study: bar_scenes.py, faults.py.
_LOG_WIDTHS, _NEAR_WIDTHS = (
    np.linspace(-0.48, 0.48, 25),
    slice(8, -8),
)
# [arms] The outermost stretch's place, over `ARM_MM`: 30 of 36 mm. Derived.
_STRETCH_ARM = 1.5
# [chi²] What one stretch may say against a line, 6.3 sigma; a clamp or a hole in the bench says
# anything. Study: thresholds.py bar.posterior _MOST ….
_MOST = 40.0


@dataclass(frozen=True)
class Window:
    """Where a line is looked for: up to so far off (2,), px, in the middle and over ARM_MM; under lens blurs (n,), px;
    whether closely: under all kinds of light and at each step of the grid, or roughly, under the roughest alone; and at
    how many positions for each step."""

    most_px: np.ndarray
    blurs_px: np.ndarray
    closely: bool = True
    positions: int = 1
    apart_px: float = _APART_PX

    @property
    def lines(self) -> int:
        """How many lines are tried, by shift and by tilt."""
        return max(_LINES, 1 + int(np.ceil(2.0 * np.max(self.most_px) / self.apart_px)))

    @classmethod
    def after(cls, one: "Posterior", positions: int) -> "Window":
        """The next, about a posterior, at so many positions for each step across."""
        most = np.clip(_WITHIN_SIGMAS * np.sqrt(np.diag(one.covariance)), *_LINE_PX)
        wide = np.clip(np.hypot(_WITHIN_SIGMAS * one.log_blur_sigma, one.log_blur_step), *_LOG_BLUR)
        return cls(
            most, one.blur_px * np.exp(np.linspace(-wide, wide, _NEXT_BLURS)), positions=positions
        )


@dataclass(frozen=True)
class Posterior:
    """Of shift and tilt over ARM_MM (2,), px, under one transfer curve: mean, covariance; minus twice the log evidence
    (k,) of each stretch at its best, by how much that is overstated (k,), and minus twice the log of how much room
    there is about the best; how much more probable a bar is than none, how clearly it is one, and what share of the
    lines that were possible still are; mean and sigma of the logarithm of the blur, and the step in which it was looked
    at."""

    line: np.ndarray
    covariance: np.ndarray
    least: np.ndarray
    temper: np.ndarray
    room: float
    for_bar: float
    clearness: float
    unresolved: float
    blur_px: float
    log_blur_sigma: float
    log_blur_step: float


def first_look(pieces: Pieces, line: np.ndarray, reach_px: float, gamma: float) -> Posterior:
    """The posterior about a line (2,) that may be reach_px off, under coarse blurs."""
    return _look(
        pieces, line, Window(np.full(2, reach_px), np.array(_BLURS_PX), closely=False), gamma
    )


def closer_look(pieces: Pieces, before: Posterior, gamma: float, positions: int) -> Posterior:
    """The posterior about another one, at so many positions for each step across."""
    return _look(pieces, before.line, Window.after(before, positions), gamma)


def roughly(pieces: Pieces, line: np.ndarray, reach_px: float) -> Posterior:
    """The posterior of one quick look, good enough to tell a bar from what is none."""
    return _look(
        pieces, line, Window(np.full(2, reach_px), np.array([_ROUGH_BLUR_PX]), closely=False), 1.0
    )


def most_probable(pieces: Pieces, off_px: float) -> np.ndarray:
    """The most probable line (2,) by blurred pictures, up to off_px off, to _FAR_APART_PX."""
    window = Window(
        np.full(2, off_px), np.array([_FAR_BLUR_PX]), closely=False, apart_px=_FAR_APART_PX
    )
    seen = profiles(pieces, STRETCHES, off_px, 1.0)
    under = [
        evidence(LitRod(seen), off_px, _FAR_BLUR_PX, all_light=False, every=_every(_FAR_BLUR_PX))
    ]
    lines, _, misfit, *_ = _over_lines(under, seen, window)
    return lines[np.argmin(misfit[:, 0, 0])]


def log_width(pieces: Pieces) -> tuple[float, float]:
    """Mean and sigma of the logarithm of the bar's width over the given one, its middle as far as _ASIDE_PX off."""
    for logs in (_LOG_WIDTHS[_NEAR_WIDTHS], _LOG_WIDTHS):
        against = _against_widths(pieces, logs)
        if 0 < np.argmin(against) < len(logs) - 1:
            break
    fine = np.linspace(logs[0], logs[-1], 10 * len(logs))
    chance = np.exp(-0.5 * (CubicSpline(logs, against)(fine) - against.min()))
    mean = float(chance @ fine / chance.sum())
    return mean, float(np.sqrt(chance @ (fine - mean) ** 2 / chance.sum()))


def _against_widths(pieces: Pieces, logs: np.ndarray) -> np.ndarray:
    """Minus twice the log probability (n,) of widths over the given one, of these logarithms, each at its best middle."""
    reach_px = max(float(np.median(pieces.radius_px)) * float(np.expm1(logs[-1])), _ASIDE_PX)
    seen = profiles(pieces, STRETCHES, reach_px, 1.0)
    rod = LitRod(seen)
    under = [
        evidence(rod, _ASIDE_PX, _ROUGH_BLUR_PX, 1, False, _every(_ROUGH_BLUR_PX), wider)
        for wider in np.exp(logs)
    ]
    own = np.array([one.of_bar[..., 0] for one in under]) / overstated(_best(under), seen)[:, None]
    total = np.sum(_tempered(own - own.min(axis=(0, 2), keepdims=True)), axis=1)
    return np.min(total, axis=1) / max(1.0, float(total.min()) / max(len(seen) - 2, 1))


def moved(pieces: Pieces, line: np.ndarray) -> Pieces:
    """The pieces seen from a line (2,)."""
    return pieces.moved(line[0] + line[1] * pieces.place / ARM_MM)


def _look(pieces: Pieces, line, window: Window, gamma: float) -> Posterior:
    """Over lines within a window about one (2,)."""
    reach_px = min(float(window.most_px @ [1.0, _STRETCH_ARM]), _LONGEST_PX)
    seen = profiles(moved(pieces, line), STRETCHES, reach_px, gamma)
    rod, closely = LitRod(seen), window.closely
    under = [
        evidence(
            rod, reach_px, blur_px, window.positions, closely, 1 if closely else _every(blur_px)
        )
        for blur_px in window.blurs_px
    ]
    lines, log_blurs, misfit, least, temper = _over_lines(under, seen, window)
    chance = np.exp(-0.5 * (misfit - misfit.min()))
    total = chance.sum()
    of_line, of_blur = chance.sum(axis=(1, 2)) / total, chance.sum(axis=(0, 1)) / total
    mean, log_blur = of_line @ lines, float(of_blur @ log_blurs)
    away, step = lines - mean, float(np.max(np.diff(log_blurs), initial=0.0))
    cell = float(np.prod(2.0 * window.most_px / (window.lines - 1))) * max(step, 1e-300)
    best, covariance = _best(under), (of_line * away.T) @ away
    unresolved = float(
        3.0 * np.sqrt(np.linalg.det(covariance)) / np.prod(window.most_px)
    )  # 1 of a flat one
    return Posterior(
        line + mean,
        covariance,
        least,
        temper,
        -2.0 * np.log(total * cell),
        float(np.sum((best.of_none - best.least) / temper)),
        rod.clearness(best),
        unresolved,
        np.exp(log_blur),
        float(np.sqrt(of_blur @ (log_blurs - log_blur) ** 2)),
        step,
    )


def _between(places: np.ndarray, curves: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Curves (k, g, m), given at places (g,), at others (k, n) for each: cubic splines, (k, n, m)."""
    parts = CubicSpline(places, curves, axis=1).c
    cell = np.clip(np.searchsorted(places, there, side="right") - 1, 0, len(places) - 2)
    beyond, each = (there - places[cell])[..., None], np.arange(len(curves))[:, None]
    value = parts[0][cell, each]
    for part in parts[1:]:
        value *= beyond
        value += part[cell, each]
    return value


def _tempered(against: np.ndarray) -> np.ndarray:
    """What stretches say against lines, as chi², where one may say anything with a chance of exp(-_MOST / 2)."""
    return -2.0 * np.log(np.exp(-0.5 * against) + np.exp(-0.5 * _MOST))


def _every(blur_px: float) -> int:
    """Of how many steps of the grid one is looked at."""
    return max(1, int(_APART_BLURS * blur_px / STEP_PX))


def _best(under: Sequence[Evidence]) -> Evidence:
    """By the blur with the most evidence."""
    return min(under, key=lambda one: one.least.sum())


def overstated(one: Evidence, seen: Profiles) -> np.ndarray:
    """By how much (k,) the evidence of each stretch is: noise goes together as far as pieces show it; what is left
    beyond noise is light that no such model has, and goes together as far as the lens blurs it: exp(-x² / 4 blur²).
    """
    smeared = 2.0 * np.sqrt(np.pi) * one.blur_px / STEP_PX
    return seen.alike + max(seen.alike, smeared) * np.maximum(one.misfit - 1.0, 0.0)


def _over_lines(under: Sequence[Evidence], seen: Profiles, window: Window):
    """Lines (n, 2), shift and tilt in px; logarithms of blurs (b,); minus twice the log probability (n, r, b) of each
    under each kind of light and blur; minus twice the log evidence (k,) at the best of these, as it stands; and by how
    much (k,) that is overstated.

    Where the stretches' own middles lie on no line to their sigmas, these are taken to be as much larger.
    """
    ends = [np.linspace(-most, most, window.lines) for most in window.most_px]
    lines = np.stack(np.meshgrid(*ends, indexing="ij"), axis=-1).reshape(-1, 2)
    logs, log_blurs = (np.log(window.blurs_px) for _ in range(2))
    temper = overstated(_best(under), seen)
    shift = under[0].shift_px  # of the narrowest blur
    own = [
        one.of_bar
        if len(one.shift_px) == len(shift)
        else CubicSpline(one.shift_px, one.of_bar, axis=1)(shift)
        for one in under
    ]
    own = np.stack(own, axis=-1) / temper[:, None, None, None]
    if len(logs) > 2 and np.max(np.diff(logs)) < _SPLINE:
        log_blurs = np.linspace(logs[0], logs[-1], _BLURS)
        own = CubicSpline(logs, own, axis=-1)(log_blurs)
    shape = len(lines), own.shape[2], len(log_blurs)
    own = own.reshape(len(seen), len(shift), -1)
    least = own.min(axis=1)
    there = np.clip(
        lines[:, 0] + seen.place_mm[:, None] / ARM_MM * lines[:, 1], shift[0], shift[-1]
    )
    against = np.maximum(_between(shift, own - least[:, None], there), 0.0)
    against = _tempered(against)
    total = against.sum(axis=0)
    total = least.sum(axis=0) + total / max(1.0, float(total.min()) / max(len(seen) - 2, 1))
    line, other = np.unravel_index(np.argmin(total), total.shape)
    return (
        lines,
        log_blurs,
        total.reshape(shape),
        temper * (least[:, other] + against[:, line, other]),
        temper,
    )
