"""By how much all of a rod's segments may lie to one side of where they were found.

Only the rod's rims show such a shift, and shading can stand in for it: the prior of the shading
decides, and nobody knows beforehand how strong each of its Fourier coefficients is. Here each has
the strength that makes the pixels most probable (empirical Bayes, MacKay 1992). The probability of
shifts is then computed on a grid, for it often is not Gaussian.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import RectBivariateSpline
from scipy.linalg.lapack import dtrtri

from vision.wire.bands import Pieces
from vision.wire.gathered import GatheredEquations, exactly_if_needed
from vision.wire.shading import WAVE_SHARE, Knots, between_knots, contrast_of

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
# 125 above it at that stage. Not measured by a script.
NO_CHANCE = 200.0
# [1] Of the evidence: strengths are fitted to the pixels that they explain, and what the model
# lacks is alike in all segments. In 65 views of 30 path-traced scenes the log probability of the
# true shift is 1.32 in the mean, with 1 1.26, with a Gaussian 1.15. Study: wire_scenes.py.
EVIDENCE_COUNTS = 0.5


def common_spread_px(
    pieces: Pieces,
    blur_px: float,
    terms: int,
    knots: Knots,
    robust: np.ndarray,
    blur_prior: tuple[float, float],
) -> float:
    """Return the RMS of all common shifts, each by its probability, from where the segments lie, px.

    terms, robust: see `evidences_of`. blur_px: found where they lie. blur_prior: blur, px, and sigma
    of its logarithm.
    """
    blurs_px = blur_px * np.exp(_LOG_BLURS)
    found = evidences_of(pieces, _SHIFTS_PX, blurs_px, terms, knots, robust, NO_CHANCE)
    evidences = EVIDENCE_COUNTS * found[0]
    prior_px, prior_sigma = blur_prior
    evidences += ((_LOG_BLURS + np.log(blur_px / prior_px)) / prior_sigma) ** 2
    shift = np.linspace(_SHIFTS_PX[0], _SHIFTS_PX[-1], _FINE)
    log_blur = np.linspace(_LOG_BLURS[0], _LOG_BLURS[-1], _FINE)
    fine = RectBivariateSpline(_SHIFTS_PX, _LOG_BLURS, evidences)(shift, log_blur)
    probability = np.exp(-0.5 * (fine - fine.min())).sum(axis=1)
    return float(np.sqrt(np.average(shift**2, weights=probability)))


def evidences_of(
    pieces: Pieces,
    shifts_px: np.ndarray,
    blurs_px: np.ndarray,
    terms: int,
    knots: Knots,
    robust: np.ndarray,
    no_chance: float = np.inf,
    wider: Sequence[float] = (1.0,),
) -> np.ndarray:
    """Return minus twice the log evidence (w, m, b) of widths, common shifts and blurs.

    wider (w,): how many times as thick the rods are. shifts_px (m,), blurs_px (b,).
    terms: number of shading functions, at the first, middle and last of the knots along the rod; each
    coefficient is as strong as is most probable. robust (s,): weight of each segment. no_chance: those
    above the least by so much need not be computed to the end.
    """
    last = len(knots.place_mm) - 1
    places = knots.place_mm[sorted({0, len(knots.place_mm) // 2, last})]
    knots = Knots(places, knots.turn_rad, knots.turns)
    # knots are mixed so that each coefficient of a mixture has a variance of its own
    own, mixing = np.linalg.eigh(between_knots(knots))
    knot_weights = knots.weights(pieces) @ mixing
    models = []
    contrasts = []
    for factor in wider:
        thick = replace(pieces, radius_px=factor * pieces.radius_px)
        contrasts.append(contrast_of(thick))
        models += [(factor, blur_px) for blur_px in blurs_px]
    contrast = np.tile(np.repeat(contrasts, len(blurs_px)), len(shifts_px))

    def compute(each_pixel: bool) -> np.ndarray:
        """Return the evidences (m w b,), from summed pixels or from each pixel."""
        gathered = GatheredEquations(pieces, knot_weights, robust, each_pixel=each_pixel)
        left, right, power = gathered.normal(shifts_px, models, terms)
        left = left.reshape(-1, *left.shape[2:])
        right = right.reshape(-1, *right.shape[2:])
        return _evidences(left, right, power.ravel(), own, contrast, no_chance)

    evidences = exactly_if_needed(compute)
    return evidences.reshape(len(shifts_px), len(wider), len(blurs_px)).transpose(1, 0, 2)


def _evidences(
    left: np.ndarray,
    right: np.ndarray,
    power: np.ndarray,
    own: np.ndarray,
    contrast: np.ndarray,
    no_chance: float,
) -> np.ndarray:
    """Return minus twice the log evidence (g,) of g normal equations, coefficients of the best strength.

    own (knots,): inverse variances of a coefficient over its strength's. contrast (g,): grey levels.
    """
    count = len(own)
    terms = left.shape[1] // count
    strength = contrast[:, None] * WAVE_SHARE[:terms]
    low = contrast[:, None] * _LEAST_STRENGTH
    high = contrast[:, None] * _MOST_STRENGTH
    evidences = np.empty(len(left))
    some = np.arange(len(left))
    for number in range(_ROUNDS + 1):
        stiff = (own[:, None] * strength[some, None] ** -2.0).reshape(len(some), -1)
        found, variances, log_det = _most_probable(left[some], right[some], stiff)
        explained = np.sum(right[some] * found, axis=1)
        log_prior = np.sum(np.log(stiff), axis=1)
        evidences[some] = power[some] - explained + log_det - log_prior
        squares = own @ (found**2 + variances).reshape(-1, count, terms)
        fitted = np.clip(np.sqrt(squares / count), low[some], high[some])
        strength[some, 1:] = fitted[:, 1:]
        if number >= _FIRST_ROUNDS:
            some = some[evidences[some] < evidences.min() + no_chance]
    return evidences


def _most_probable(
    left: np.ndarray, right: np.ndarray, stiff: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Solve g normal equations with priors of these inverse variances (g, size).

    Returned are the coefficients (g, size), their variances (g, size), and the log (g,) of each
    matrix's determinant.
    """
    root = left.copy()
    diagonal = np.einsum("gii->gi", root)
    diagonal += stiff
    root = np.linalg.cholesky(root)
    inverse = np.array([dtrtri(one.T)[0] for one in root])  # of the roots' transposes
    found = (inverse @ (right[:, None] @ inverse).transpose(0, 2, 1))[..., 0]
    log_det = 2.0 * np.sum(np.log(np.einsum("gii->gi", root)), axis=1)
    return found, np.sum(inverse**2, axis=2), log_det
