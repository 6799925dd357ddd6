"""The posterior of a straight bar's line in one camera: a mean shift and tilt with their
covariance.

A line is a shift c₀ in the bar's middle and a tilt c₁ over ARM_MM, both in px across the bar. In
the segment at place s_k along it, the bar's middle is then at c₀ + c₁ s_k / ARM_MM, and
`evidence.py` gives the evidence of that position. Segments are independent, so their deviances D =
−2 log evidence add up:

    −2 log p(c₀, c₁, β, r) = sum_k D_k(c₀ + c₁ s_k / ARM_MM, β, r) / T_k

T_k ≥ 1 is a temperature: it tempers the evidence of a segment whose errors are correlated or larger
than stated. The lens blur β and the smoothness r of the light round the bar are shared by all
segments. Neither is chosen; the posterior is summed over both, for a bar whose edge is dim may lie
a fifth of a pixel elsewhere under another blur. The sums run over a grid of lines and blurs; each
refinement places a smaller grid about the last posterior, until its steps resolve the posterior: a
clear edge is known to a hundredth of a pixel, and its blur to half a per cent.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from vision.geometry.optics import UNKNOWN, Optics
from vision.geometry.sampling import grid_points
from vision.touched.evidence import Evidence, LitRod, compute_evidence
from vision.touched.pieces import ARM_MM
from vision.touched.profiles import STEP_PX, Profiles, compute_profiles
from vision.wire.bands import Pieces
from vision.wire.rod_width import mean_and_sigma_between

# [segments] Of the bar, each with its own light: two for a line, the others show one that shows
# something else. With six, nine in ten of 65 path-traced scenes had d_x within 0.042 mm, the slope
# within 0.24°; with nine within 0.036 mm and 0.18°. Study: path_traced.py.
SEGMENTS = 9
# [sigma] Half the width of a refined window: 6 in 100 000 Gaussian lines lie beyond. Derived.
_WITHIN_SIGMAS = 4.0
# [px] Least and largest half width of a refined window of lines: the steps of the least are a tenth
# of the smallest sigma of a line. Derived.
_LINE_LIMITS_PX = (0.02, 2.0)
# [1] Least and largest half width of a refined window of the blur's logarithm: in the steps of the
# least a line changes by less than a tenth of its sigma. Derived.
_LOG_BLUR_LIMITS = (0.01, 0.5)
# [passes] Of one refinement, at most: one resolves four of five posteriors of 65 path-traced scenes,
# three all. Study: bar_scenes.py.
_MOST_PASSES = 10
# [sigma] Least half width of a window that holds a posterior: of a flat one it is 1.7. Derived.
_HELD_SIGMAS = 2.5
# [sigma] Largest step of a grid that resolves a posterior: variances of a Gaussian are then exact to
# 0.5 %. Derived.
_RESOLVED_SIGMAS = 1.5
# [px] Lens blurs of the first pass, where none is known. Study: bar_starts.py.
BLURS_PX = (0.6, 0.85, 1.2, 1.7)
# [sigma] Of the logarithm of a known blur, for the first pass. Derived.
_BLUR_SIGMAS = np.array([-2.0, -0.7, 0.7, 2.0])
# [px] The one lens blur of a quick pass, which distinguishes a bar from none. Study:
# bar_scenes.py.
QUICK_BLUR_PX = 1.0
# [blurs] Between positions of a coarse pass, with a cubic spline between: at 0.83 of a blur that
# undershot, and a transfer curve's probability was 0.2 in place of 0.99 in one of 18 scenes.
# Study: bar_scenes.py.
_SPACING_BLURS = 0.5
# [1] Steps of the blur's logarithm below this are interpolated by a cubic spline; at larger ones
# it undershoots. Study: bar_starts.py.
_LARGEST_SPLINE_STEP = 0.25
# [lines] Of the grid by shift and by tilt: a third of a sigma apart; sums over a Gaussian are
# then exact to 1e-8. Derived.
_LINES = 25
# [blurs] Of the interpolated grid: a sigma apart. Derived.
_BLURS = 9
# [px] Largest step between lines of a wide window. Study: bar_scenes.py.
_SPACING_PX = 0.1
# [blurs] Of a refined window, at least: fewer allow no spline. Derived.
_REFINED_BLURS = 4
# [px] Largest reach of a pass. Derived.
_LARGEST_REACH_PX = 3.0
# [px] Distance of the middle of a bar of another width from where it is expected: half of what a
# bar of 4 mm in place of 6 is wider by. Derived.
_WIDTH_REACH_PX = 2.0
# [log] Other widths that are tried: a bar of 4 mm in place of 6 is 0.41 off; two sigma of a clear
# bar apart, with a cubic spline between. Study: bar_scenes.py, faults.py.
_LOG_WIDTHS = np.linspace(-0.48, 0.48, 25)
# [widths] Those within 0.16, which are tried first. Study: bar_scenes.py, faults.py.
_NEAR_WIDTHS = slice(8, -8)
# [arms] The outermost segment's place, over `ARM_MM`: 30 of 36 mm. Derived.
_SEGMENT_ARM = 1.5
# [chi²] Largest deviance of one segment against a line, 6.3 sigma; a clamp or a hole in the bench
# may show anything. Study: thresholds.py touched.posterior _LARGEST_DEVIANCE ….
_LARGEST_DEVIANCE = 40.0


@dataclass(frozen=True)
class LineWindow:
    """The grid of lines and blurs over which a posterior is summed.

    most_px (2,): largest shift, and largest tilt over ARM_MM. blurs_px (n,): lens blurs. is_coarse:
    only the roughest prior of the light, and positions half a blur apart. positions: how many for
    each step of the profiles' grid.
    optics: prior of the blurs.
    """

    most_px: np.ndarray
    blurs_px: np.ndarray
    is_coarse: bool = True
    positions: int = 1
    optics: Optics = UNKNOWN

    @property
    def lines(self) -> int:
        """Return how many lines are tried by shift, and how many by tilt."""
        return max(_LINES, 1 + int(np.ceil(2.0 * np.max(self.most_px) / _SPACING_PX)))

    @property
    def step_px(self) -> np.ndarray:
        """Return the steps (2,) between lines of the grid, by shift and by tilt."""
        return 2.0 * self.most_px / (self.lines - 1)

    @property
    def cell_px2(self) -> float:
        """Return the area that each line of the grid stands for, px by shift times px by tilt."""
        return float(np.prod(self.step_px))

    def holds(self, sigma_px: np.ndarray) -> bool:
        """Return whether lines of these sigmas (2,) by shift and tilt lie within, or none is wider."""
        least_px = np.minimum(_HELD_SIGMAS * sigma_px, _LINE_LIMITS_PX[1])
        return bool(np.all(self.most_px >= least_px))

    def grid(self) -> np.ndarray:
        """Return the lines (lines², 2): shift and tilt, px."""
        return grid_points(*[np.linspace(-most, most, self.lines) for most in self.most_px])

    @classmethod
    def about(cls, posterior: "Posterior", positions: int, optics: Optics) -> "LineWindow":
        """Return the refined window about a posterior, with `positions` for each step across."""
        sigma_px = np.sqrt(np.diag(posterior.covariance))
        most_px = np.hypot(_WITHIN_SIGMAS * sigma_px, posterior.line_step_px)
        most_px = np.clip(most_px, *_LINE_LIMITS_PX)
        wide = np.hypot(_WITHIN_SIGMAS * posterior.log_blur_sigma, posterior.log_blur_step)
        wide = np.clip(wide, *_LOG_BLUR_LIMITS)
        number = max(_REFINED_BLURS, 2 + int(2.0 * wide / _LARGEST_SPLINE_STEP))
        blurs_px = posterior.blur_px * np.exp(np.linspace(-wide, wide, number))
        return cls(most_px, blurs_px, is_coarse=False, positions=positions, optics=optics)


@dataclass(frozen=True)
class Posterior:
    """The posterior of a bar's line under one transfer curve.

    line (2,), covariance (2, 2): of shift, and tilt over ARM_MM, px.
    segment_deviance (k,): −2 log evidence of each segment at the best line. temperature (k,): of
    each segment.
    volume_deviance: −2 log of the posterior's volume about the best line.
    evidence_for_bar: 2 log of the odds of a bar against none. detection_score: see
    `LitRod.detection_score`.
    searched_px2: half widths of the first window, multiplied.
    blur_px, log_blur_sigma: mean and sigma of the blur's logarithm; log_blur_step: the grid's step
    in it. line_step_px (2,): the grid's step in the line, and what the line changes by from one blur
    of the grid to the next. is_resolved: whether the grid's steps are narrow and its window wide
    enough for the posterior.
    """

    line: np.ndarray
    covariance: np.ndarray
    segment_deviance: np.ndarray
    temperature: np.ndarray
    volume_deviance: float
    evidence_for_bar: float
    detection_score: float
    searched_px2: float
    blur_px: float
    log_blur_sigma: float
    log_blur_step: float
    line_step_px: np.ndarray
    is_resolved: bool

    @property
    def unresolved_share(self) -> float:
        """Return the share that remains probable of the lines that were tried first, 1 where flat.

        A flat posterior over a window of half widths a, b has the determinant (a b)² / 9.
        """
        return float(3.0 * np.sqrt(np.linalg.det(self.covariance)) / self.searched_px2)


@dataclass(frozen=True)
class _LineGrid:
    """Deviances on a grid of n lines, r priors of the light and b blurs.

    lines (n, 2): shift and tilt, px. log_blurs (b,). deviance (n, r, b). segment_deviance (k,): of
    each segment at the best of these, untempered. temperature (k,).
    """

    lines: np.ndarray
    log_blurs: np.ndarray
    deviance: np.ndarray
    segment_deviance: np.ndarray
    temperature: np.ndarray

    @cached_property
    def _density(self) -> np.ndarray:
        """Return the density (n, r, b) of the posterior over that at its highest."""
        return np.exp(-0.5 * (self.deviance - self.deviance.min()))

    @property
    def volume(self) -> float:
        """Return the sum of the posterior's density over that at its highest."""
        return self._density.sum()

    @property
    def blur_step(self) -> float:
        """Return the largest step between log blurs, 0 of one."""
        return float(np.max(np.diff(self.log_blurs), initial=0.0))

    def average_line(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the posterior's mean line (2,) and its covariance (2, 2)."""
        probability = self._density.sum(axis=(1, 2)) / self.volume
        mean = probability @ self.lines
        residual = self.lines - mean
        return mean, (probability * residual.T) @ residual

    def change_between_blurs(self) -> np.ndarray:
        """Return by how much (2,) the mean line changes from the most probable blur to the next, px."""
        best = int(np.argmax(self._density.sum(axis=(0, 1))))
        nearby = self.deviance[
            ..., max(best - 1, 0) : best + 2
        ]  # of improbable blurs _density is 0
        density = np.exp(-0.5 * (nearby - nearby.min(axis=(0, 1)))).sum(axis=1)
        lines = (density / density.sum(axis=0)).T @ self.lines
        change_px = np.abs(lines - lines[min(best, 1)])
        return np.max(change_px, axis=0)

    def average_log_blur(self) -> tuple[float, float]:
        """Return the posterior's mean of the blur's logarithm, and its sigma."""
        probability = self._density.sum(axis=(0, 1)) / self.volume
        mean = float(probability @ self.log_blurs)
        return mean, float(np.sqrt(probability @ (self.log_blurs - mean) ** 2))


def fit_coarse(
    pieces: Pieces, line: np.ndarray, reach_px: float, gamma: float, optics: Optics
) -> Posterior:
    """Return the posterior about a line (2,) that may be reach_px off, on a coarse grid of blurs.

    optics: prior of the blur.
    """
    blurs_px = np.array(BLURS_PX)
    if np.isfinite(optics.log_blur_sigma):
        blurs_px = optics.blur_px * np.exp(optics.log_blur_sigma * _BLUR_SIGMAS)
    window = LineWindow(np.full(2, reach_px), blurs_px, optics=optics)
    return _fit(pieces, line, window, gamma)


def refine(
    pieces: Pieces, before: Posterior, gamma: float, positions: int, optics: Optics
) -> Posterior:
    """Return the posterior on finer grids about an earlier one, until one resolves it, with
    `positions` for each step across.

    optics: prior of the blur.
    """
    posterior = before
    for _ in range(_MOST_PASSES):
        window = LineWindow.about(posterior, positions, optics)
        posterior = _fit(pieces, posterior.line, window, gamma)
        if posterior.is_resolved:
            break
    covariance = posterior.covariance
    if not posterior.is_resolved:
        covariance = covariance + np.diag(posterior.line_step_px**2)
    return replace(posterior, covariance=covariance, searched_px2=before.searched_px2)


def _resolves(step: np.ndarray | float, sigma: np.ndarray | float, least: float) -> bool:
    """Return whether no step is wider than _RESOLVED_SIGMAS, or all are less than `least`."""
    return bool(np.all(step < np.maximum(_RESOLVED_SIGMAS * sigma, least)))


def fit_quick(pieces: Pieces, line: np.ndarray, reach_px: float) -> Posterior:
    """Return the posterior under a single blur, good enough to distinguish a bar from none."""
    window = LineWindow(np.full(2, reach_px), np.array([QUICK_BLUR_PX]))
    return _fit(pieces, line, window, 1.0)


def estimate_log_width(pieces: Pieces) -> tuple[float, float]:
    """Return mean and sigma of the logarithm of the bar's width over the given one.

    The bar's middle may be _WIDTH_REACH_PX from where it is expected.
    """
    for log_widths in (_LOG_WIDTHS[_NEAR_WIDTHS], _LOG_WIDTHS):
        deviance = _evaluate_widths(pieces, log_widths)
        if 0 < np.argmin(deviance) < len(log_widths) - 1:
            break
    return mean_and_sigma_between(log_widths, deviance)


def _evaluate_widths(pieces: Pieces, log_widths: np.ndarray) -> np.ndarray:
    """Evaluate the deviance (n,) of widths over the given one, each at its best middle."""
    widening_px = float(np.median(pieces.radius_px)) * float(np.expm1(log_widths[-1]))
    profiles = compute_profiles(pieces, SEGMENTS, max(widening_px, _WIDTH_REACH_PX), 1.0)
    rod = LitRod(profiles)
    evidences = []
    for width_factor in np.exp(log_widths):
        evidence = compute_evidence(
            rod,
            _WIDTH_REACH_PX,
            QUICK_BLUR_PX,
            with_smooth_priors=False,
            every=coarse_steps(QUICK_BLUR_PX),
            width_factor=width_factor,
        )
        evidences.append(evidence)
    temperature = estimate_temperature(best_of(evidences), profiles)
    deviances = np.array([evidence.bar_deviance[..., 0] for evidence in evidences])  # (n, k, g)
    tempered = deviances / temperature[:, None]
    excess = _bound_deviance(tempered - tempered.min(axis=(0, 2), keepdims=True))
    total = np.sum(excess, axis=1)  # (n, g)
    return np.min(total, axis=1) / _misfit_of_line(total, profiles)


def move_to_line(pieces: Pieces, line: np.ndarray) -> Pieces:
    """Return the pieces with offsets counted from a line (2,)."""
    return pieces.moved(line[0] + line[1] * pieces.place / ARM_MM)


def _fit(pieces: Pieces, line: np.ndarray, window: LineWindow, gamma: float) -> Posterior:
    """Return the posterior over a window about a line (2,)."""
    reach_px = min(float(window.most_px @ [1.0, _SEGMENT_ARM]), _LARGEST_REACH_PX)
    profiles = compute_profiles(move_to_line(pieces, line), SEGMENTS, reach_px, gamma)
    rod = LitRod(profiles)
    evidences = _evidences(rod, window, reach_px)
    grid = _evaluate_lines(evidences, profiles, window)
    mean, covariance = grid.average_line()
    log_blur, log_blur_sigma = grid.average_log_blur()
    line_step_px = np.hypot(grid.change_between_blurs(), window.step_px)
    sigma_px = np.sqrt(np.diag(covariance))
    cell = window.cell_px2 * max(grid.blur_step, 1e-300)
    best = best_of(evidences)
    odds = (best.no_bar_deviance - best.least_deviance) / grid.temperature
    return Posterior(
        line=line + mean,
        covariance=covariance,
        segment_deviance=grid.segment_deviance,
        temperature=grid.temperature,
        volume_deviance=-2.0 * np.log(grid.volume * cell),
        evidence_for_bar=float(np.sum(odds)),
        detection_score=rod.detection_score(best),
        searched_px2=float(np.prod(window.most_px)),
        blur_px=np.exp(log_blur),
        log_blur_sigma=log_blur_sigma,
        log_blur_step=grid.blur_step,
        line_step_px=line_step_px,
        is_resolved=window.holds(sigma_px)
        and _resolves(line_step_px, sigma_px, _LINE_LIMITS_PX[0])
        and _resolves(grid.blur_step, log_blur_sigma, _LOG_BLUR_LIMITS[0]),
    )


def _evidences(rod: LitRod, window: LineWindow, reach_px: float) -> list[Evidence]:
    """Compute the evidence under each blur of a window, of positions within reach_px."""
    evidences = []
    for blur_px in window.blurs_px:
        evidence = compute_evidence(
            rod,
            reach_px,
            blur_px,
            positions=window.positions,
            with_smooth_priors=not window.is_coarse,
            every=coarse_steps(blur_px) if window.is_coarse else 1,
        )
        evidences.append(evidence)
    return evidences


def coarse_steps(blur_px: float) -> int:
    """Return how many steps of the grid lie between positions of a coarse pass."""
    return max(1, int(_SPACING_BLURS * blur_px / STEP_PX))


def best_of(evidences: Sequence[Evidence]) -> Evidence:
    """Return the evidence under the blur that has the most of it."""
    return min(evidences, key=lambda evidence: evidence.least_deviance.sum())


def estimate_temperature(evidence: Evidence, profiles: Profiles) -> np.ndarray:
    """Estimate the temperature (k,) of each segment: the factor by which its deviance is
    overstated.

    Noise is correlated between bins as the patches show (`variance_inflation`). Misfit beyond noise
    is light that the model cannot have; it is correlated as far as the lens blurs it, with exp(−x²
    / 4 blur²).
    """
    blurred = 2.0 * np.sqrt(np.pi) * evidence.blur_px / STEP_PX
    inflation = max(profiles.variance_inflation, blurred)
    return profiles.variance_inflation + inflation * np.maximum(evidence.misfit - 1.0, 0.0)


def _bound_deviance(deviance: np.ndarray) -> np.ndarray:
    """Return deviances of segments that show anything else with a probability of
    exp(−_LARGEST_DEVIANCE / 2)."""
    return -2.0 * np.log(np.exp(-0.5 * deviance) + np.exp(-0.5 * _LARGEST_DEVIANCE))


def _misfit_of_line(deviance: np.ndarray, profiles: Profiles) -> float:
    """Return the least deviance per degree of freedom of the segments' middles about a line, at
    least 1."""
    return max(1.0, float(deviance.min()) / max(len(profiles) - 2, 1))


def _evaluate_lines(
    evidences: Sequence[Evidence], profiles: Profiles, window: LineWindow
) -> _LineGrid:
    """Evaluate the deviance of each line of a window under each prior of the light and each blur.

    Where the segments' own middles lie on no line to within their sigmas, all deviances are divided
    by their misfit.
    """
    lines = window.grid()
    temperature = estimate_temperature(best_of(evidences), profiles)
    shift_px = evidences[0].shift_px  # of the narrowest blur, which has the most positions
    deviance = _at_shifts(evidences, shift_px) / temperature[:, None, None, None]
    log_blurs, deviance = _at_fine_blurs(np.log(window.blurs_px), deviance)
    segments, shifts, priors, blurs = deviance.shape
    deviance = deviance.reshape(segments, shifts, -1)
    least = deviance.min(axis=1)
    excess = _excess_of_lines(profiles, lines, shift_px, deviance - least[:, None])
    total = _total_deviance(least, excess, profiles)
    total += np.tile(window.optics.deviance_of_blurs(log_blurs), priors)
    line, other = np.unravel_index(np.argmin(total), total.shape)
    segment_deviance = temperature * (least[:, other] + excess[:, line, other])
    total = total.reshape(-1, priors, blurs)
    return _LineGrid(lines, log_blurs, total, segment_deviance, temperature)


def _total_deviance(least: np.ndarray, excess: np.ndarray, profiles: Profiles) -> np.ndarray:
    """Return the deviance (n, m) of lines, of all segments.

    least (k, m): of each segment at its own best shift. excess (k, n, m): over that, at the line.
    """
    total = excess.sum(axis=0)
    return least.sum(axis=0) + total / _misfit_of_line(total, profiles)


def _excess_of_lines(
    profiles: Profiles, lines: np.ndarray, shift_px: np.ndarray, excess: np.ndarray
) -> np.ndarray:
    """Return the bounded deviance (k, n, m) of each segment at lines (n, 2) over its least.

    excess (k, g, m): the deviance over its least, at shifts (g,).
    """
    middle_px = lines[:, 0] + profiles.place_mm[:, None] / ARM_MM * lines[:, 1]  # (k, n)
    middle_px = np.clip(middle_px, shift_px[0], shift_px[-1])
    return _bound_deviance(np.maximum(_interpolate(shift_px, excess, middle_px), 0.0))


def _at_shifts(evidences: Sequence[Evidence], shift_px: np.ndarray) -> np.ndarray:
    """Return the deviance (k, g, r, b) of each blur's evidence at the same shifts (g,)."""
    curves = []
    for evidence in evidences:
        curve = evidence.bar_deviance
        if len(evidence.shift_px) != len(shift_px):
            curve = CubicSpline(evidence.shift_px, curve, axis=1)(shift_px)
        curves.append(curve)
    return np.stack(curves, axis=-1)


def _at_fine_blurs(log_blurs: np.ndarray, deviance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Interpolate a deviance (..., b) between log blurs (b,), where these lie near each other.

    Returns the log blurs and the deviance at them.
    """
    if len(log_blurs) <= 2 or np.max(np.diff(log_blurs)) >= _LARGEST_SPLINE_STEP:
        return log_blurs, deviance
    fine = np.linspace(log_blurs[0], log_blurs[-1], _BLURS)
    return fine, CubicSpline(log_blurs, deviance, axis=-1)(fine)


def _interpolate(knots: np.ndarray, curves: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Interpolate curves (k, g, m), given at knots (g,), at other places (k, n) each: cubic splines
    (k, n, m)."""
    coefficients = CubicSpline(knots, curves, axis=1).c
    cell = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, len(knots) - 2)
    beyond = (at - knots[cell])[..., None]
    curve = np.arange(len(curves))[:, None]
    value = coefficients[0][cell, curve]
    for coefficient in coefficients[1:]:  # Horner's scheme
        value *= beyond
        value += coefficient[cell, curve]
    return value
