"""By how much all of a rod's segments may lie to one side of where they were found.

Only the rod's rims show such a shift, and shading can stand in for it: the prior of the shading
decides, and nobody knows beforehand how strong each of its Fourier coefficients is. Here each has
the strength that makes the pixels most probable (empirical Bayes, MacKay 1992). The probability of
shifts is then computed on a grid, for it often is not Gaussian.

Light that hides an edge hides a share of the width: a common shift is in proportion to each
segment's half-width (`Pieces.relative_radius`), and its px are those at the mean half-width.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.interpolate import CubicSpline, RectBivariateSpline
from scipy.linalg.lapack import dtrtri

from vision.wire.bands import Pieces
from vision.wire.gathered import GatheredEquations, exactly_if_needed
from vision.wire.shaded_segments import ShadedSegments
from vision.wire.shading import WAVE_SHARE, Knots, between_knots, contrast_of
from vision.wire.summed_segments import ShadingEquations

# [1] Of the widest shift: the grid below. Derived.
_PARTS = np.linspace(-1.0, 1.0, 15)
# [px] Shifts whose probability is computed, densest about none; lines were off by 0.9 px at most.
# Study: wire_scenes.py.
_SHIFTS_PX = 1.5 * _PARTS * np.sqrt(np.abs(_PARTS))
# [1] Logarithms of blurs over the one found: over shifts up to 1 px the most probable blur changes
# by a tenth. Study: wire_scenes.py.
_LOG_BLURS = np.linspace(-0.3, 0.3, 5)
# [nodes] Of the spline through the grid: 0.01 px. Derived.
_FINE = 301
# [1] Least strength of a coefficient over the contrast: a weaker one does not show. Bounds of 0.02
# and 0.7, or of a third of what is usual, change the median error by 0.005 px. Study: wire_scenes.py.
_LEAST_STRENGTH = 0.05
# [1] Greatest strength over the contrast: a stronger one is more than the rod. Study: wire_scenes.py.
_MOST_STRENGTH = 1.0
# [rounds] Of fitting strengths: they change by less than a twentieth then. Study: wire_scenes.py.
_ROUNDS = 12
# [rounds] After which shifts without a chance are dropped. Study: wire_scenes.py.
_FIRST_ROUNDS = 2
# [1] A shift is dropped where after the first rounds minus twice its log evidence exceeds the best
# by this. In seven scenes every shift that ended within 80 of the best (a weight of e⁻²⁰) was at most
# 125 above it at that stage. Study: thresholds.py wire.common_shift NO_CHANCE ….
NO_CHANCE = 200.0
# [1] Of the evidence: strengths are fitted to the pixels that they explain, and what the model
# lacks is alike in all segments. In 65 views of 30 path-traced scenes the log probability of the
# true shift is 1.32 in the mean; with the value 1 it is 1.26, with a Gaussian 1.15. Study: wire_scenes.py.
EVIDENCE_COUNTS = 0.5
# [sigma] Of a common shift: segments lie elsewhere where its mean is farther from them. Four lines of
# a steel wire that ended in a wrong minimum, 0.2 to 0.4 px off, were 3.0 to 4.2 off by it, the right
# ones 0.6 at most; three of some 32 path-traced lines are 2.5 to 3.8 off. Study: wire_scenes.py.
_ELSEWHERE_SIGMAS = 2.0


@dataclass(frozen=True)
class CommonShift:
    """The posterior of a shift of all segments, counted from where they lie.

    mean_px, sigma_px: of the shift. log_blur: mean logarithm of the blur over the one found there.
    """

    mean_px: float
    sigma_px: float
    log_blur: float

    @property
    def is_elsewhere(self) -> bool:
        """Return whether the segments hardly lie where they are found."""
        return abs(self.mean_px) > _ELSEWHERE_SIGMAS * self.sigma_px

    @property
    def rms_px(self) -> float:
        """Return the RMS of all shifts, each by its probability."""
        return float(np.hypot(self.mean_px, self.sigma_px))


def common_shift(task: ShadedSegments, robust: np.ndarray, blur_px: float) -> CommonShift:
    """Return the posterior of a common shift of segments, over all probable blurs.

    robust (s,): weight of each segment. blur_px: found where they lie.
    """
    blurs_px = blur_px * np.exp(_LOG_BLURS)
    found = evidences_of(task, robust, _SHIFTS_PX, blurs_px, no_chance=NO_CHANCE)
    evidences = EVIDENCE_COUNTS * found[0]
    evidences += task.blur_deviation(np.log(blurs_px)) ** 2
    shift = np.linspace(_SHIFTS_PX[0], _SHIFTS_PX[-1], _FINE)
    log_blur = np.linspace(_LOG_BLURS[0], _LOG_BLURS[-1], _FINE)
    fine = RectBivariateSpline(_SHIFTS_PX, _LOG_BLURS, evidences)(shift, log_blur)
    density = np.exp(-0.5 * (fine - fine.min()))
    probability = density / density.sum()  # (shifts, blurs)
    of_shift = probability.sum(axis=1)
    mean_px = float(of_shift @ shift)
    variance_px2 = float(of_shift @ (shift - mean_px) ** 2)
    return CommonShift(mean_px, variance_px2**0.5, float(probability.sum(axis=0) @ log_blur))


def best_evidences(
    task: ShadedSegments,
    shifts_px: np.ndarray,
    blurs_px: np.ndarray,
    *,
    wider: Sequence[float] = (1.0,),
    no_chance: float = np.inf,
) -> np.ndarray:
    """Return minus twice the log evidence (w,) of widths, at the best common shift and blur of each.

    Arguments as of `evidences_of`; here the prior of the blur is counted.
    """
    every = np.ones(len(task.pieces))
    evidences = evidences_of(task, every, shifts_px, blurs_px, wider=wider, no_chance=no_chance)
    evidences += task.blur_deviation(np.log(blurs_px)) ** 2
    fine = np.linspace(shifts_px[0], shifts_px[-1], _FINE)
    return np.min(CubicSpline(shifts_px, evidences, axis=1)(fine), axis=(1, 2))


def evidences_of(
    task: ShadedSegments,
    robust: np.ndarray,
    shifts_px: np.ndarray,
    blurs_px: np.ndarray,
    *,
    wider: Sequence[float] = (1.0,),
    no_chance: float = np.inf,
) -> np.ndarray:
    """Return minus twice the log evidence (w, m, b) of widths, common shifts and blurs.

    The shading has knots at the first, middle and last place along the rod; each coefficient is as
    strong as is most probable. The prior of the blur is not counted.
    robust (s,): weight of each segment. shifts_px (m,), blurs_px (b,). wider (w,): how many times as
    thick the rods are. no_chance: those above the least by so much need not be computed to the end.
    """
    pieces = task.pieces
    knots = _three_along(task.knots)
    # knots are mixed so that each coefficient of a mixture has a variance of its own
    own, mixing = np.linalg.eigh(between_knots(knots))
    knot_weights = knots.weights(pieces) @ mixing
    models = list(product(wider, blurs_px))
    contrast = np.tile(_contrasts(pieces, models), len(shifts_px))

    def compute(each_pixel: bool) -> np.ndarray:
        """Return the evidences (m w b,), from summed pixels or from each pixel."""
        gathered = GatheredEquations(pieces, knot_weights, robust, each_pixel=each_pixel)
        normal = gathered.normal(shifts_px, models, task.terms)
        return _evidences(normal, own, contrast, no_chance)

    evidences = exactly_if_needed(compute)
    return evidences.reshape(len(shifts_px), len(wider), len(blurs_px)).transpose(1, 0, 2)


def _contrasts(pieces: Pieces, models: Sequence[tuple[float, float]]) -> np.ndarray:
    """Return the contrast (models,) of the rod, as many times as thick as each model says, grey
    levels.
    """
    contrasts = []
    for wider, _ in models:
        contrasts.append(contrast_of(replace(pieces, radius_px=wider * pieces.radius_px)))
    return np.array(contrasts)


def _three_along(knots: Knots) -> Knots:
    """Return the first, middle and last of the knots along the rod, at all of its turns."""
    last = len(knots.place_mm) - 1
    chosen = sorted({0, len(knots.place_mm) // 2, last})
    return Knots(knots.place_mm[chosen], knots.turn_rad, knots.turns)


def _evidences(
    normal: ShadingEquations, own: np.ndarray, contrast: np.ndarray, no_chance: float
) -> np.ndarray:
    """Return minus twice the log evidence (g,) of g normal equations, coefficients of the best
    strength.

    own (knots,): inverse variances of a coefficient over its strength's. contrast (g,): grey
    levels.
    """
    terms = normal.right.shape[1] // len(own)
    strength = contrast[:, None] * WAVE_SHARE[:terms]
    evidences = np.empty(len(contrast))
    some = np.arange(len(contrast))
    for number in range(_ROUNDS + 1):
        stiff = own[:, None] * strength[some, None] ** -2.0  # (some, knots, terms)
        evidences[some], squares = _integrate(normal.select(some), stiff.reshape(len(some), -1))
        fitted = _fitted_strength(squares.reshape(stiff.shape), own)
        strength[some, 1:] = _bound(fitted, contrast[some])
        if number >= _FIRST_ROUNDS:
            some = some[evidences[some] < evidences.min() + no_chance]
    return evidences


def _fitted_strength(squares: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Return the most probable strengths (g, terms − 1) of all terms but the first, grey levels.

    squares (g, knots, terms): expected, of the coefficients. own (knots,): as of `_evidences`.
    """
    mean_squares = own @ squares / len(own)
    return np.sqrt(mean_squares[:, 1:])


def _bound(strength: np.ndarray, contrast: np.ndarray) -> np.ndarray:
    """Return strengths (g, terms) within what the contrasts (g,) allow, grey levels."""
    level = contrast[:, None]
    return np.clip(strength, _LEAST_STRENGTH * level, _MOST_STRENGTH * level)


def _integrate(normal: ShadingEquations, stiff: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Integrate out the coefficients of g normal equations, with prior precisions stiff (g, size).

    Returned are minus twice the log evidence (g,), and the coefficients' expected squares (g,
    size).
    """
    root = normal.left.copy()
    diagonal = np.einsum("gii->gi", root)
    diagonal += stiff
    root = np.linalg.cholesky(root)
    inverse = np.array([dtrtri(one.T)[0] for one in root])  # of the roots' transposes
    found = (inverse @ (normal.right[:, None] @ inverse).transpose(0, 2, 1))[..., 0]
    explained = np.sum(normal.right * found, axis=1)
    log_posterior = 2.0 * np.sum(np.log(np.einsum("gii->gi", root)), axis=1)
    log_prior = np.sum(np.log(stiff), axis=1)
    evidence = normal.power - explained + log_posterior - log_prior
    return evidence, found**2 + np.sum(inverse**2, axis=2)
