"""By how much all of a rod's pieces may lie to one side of where they were found.

Such a shift is told by the rims alone, and shading can stand in for it: what is believed of the light decides, and how
strong each wave of it is nobody knows beforehand. Here each has the strength that makes the pixels most probable
(empirical Bayes, MacKay 1992). How probable each shift is then is looked up on a grid, for it often is no Gauss curve.
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
# [px] Shifts whose probability is looked up, densest about none; lines were off by 0.9 px at
# most. Study: wire_scenes.py.
_SHIFTS_PX = 1.5 * _PARTS * np.sqrt(np.abs(_PARTS))
# [1] Blurs beside the one found, of their logarithm: over shifts up to 1 px the most probable
# blur changes by a tenth. Study: wire_scenes.py.
_LOG_BLURS = np.linspace(-0.3, 0.3, 5)
# [nodes] Of the spline through the grid: 0.01 px. Derived.
_FINE = 301
# [1] Of the contrast: a weaker wave does not show, a stronger one is more than the rod. Bounds of
# 0.02 and 0.7, or of a third of what is usual, change the median error by 0.005 px. Study:
# wire_scenes.py.
_STRENGTHS = 0.05, 1.0
# [rounds] Of fitting strengths: they change by less than a twentieth then; and after which shifts
# without a chance are not asked on. Study: wire_scenes.py.
_ROUNDS, _FIRST_ROUNDS = 12, 2
# [1] Twice the log of how much less probable a shift is after the first rounds: in seven scenes
# none that ended within 80 of the best, where its weight is e⁻²⁰, was more than 125 above it
# then. Not measured by a script.
NO_CHANCE = 200.0
# [1] Of the evidence: strengths are fitted to the pixels that they explain, and what the model
# lacks is alike in all pieces. In 65 views of 30 path-traced scenes the log probability of the
# true shift is 1.32 in the mean, with 1 1.26, with one Gauss curve 1.15. Study: wire_scenes.py.
EVIDENCE_COUNTS = 0.5


def common_spread_px(
    pieces: Pieces,
    blur_px: float,
    terms: int,
    knots: Knots,
    robust: np.ndarray,
    blur_prior: tuple[float, float],
) -> float:
    """RMS distance from where pieces lie of all common shifts, each as it is probable, px.

    terms, robust: see `doubts_of`; blur_px: found where they lie; blur_prior: blur, px, and sigma of its logarithm.
    """
    doubts = (
        EVIDENCE_COUNTS
        * doubts_of(
            pieces, _SHIFTS_PX, blur_px * np.exp(_LOG_BLURS), terms, knots, robust, NO_CHANCE
        )[0]
    )
    doubts += ((_LOG_BLURS + np.log(blur_px / blur_prior[0])) / blur_prior[1]) ** 2
    shift, log_blur = (np.linspace(grid[0], grid[-1], _FINE) for grid in (_SHIFTS_PX, _LOG_BLURS))
    fine = RectBivariateSpline(_SHIFTS_PX, _LOG_BLURS, doubts)(shift, log_blur)
    chance = np.exp(-0.5 * (fine - fine.min())).sum(axis=1)
    return float(np.sqrt(np.average(shift**2, weights=chance)))


def doubts_of(
    pieces: Pieces,
    shifts_px: np.ndarray,
    blurs_px: np.ndarray,
    terms: int,
    knots: Knots,
    robust: np.ndarray,
    no_chance: float = np.inf,
    wider: Sequence[float] = (1.0,),
) -> np.ndarray:
    """Minus twice the log evidence (w, m, b) of rods so many times as thick, wider (w,), at common shifts, shifts_px
    (m,), and blurs, blurs_px (b,), by so many waves at the first, middle and last of the knots along the rod, each wave
    as strong as is most probable. robust (s,): weight of each piece. no_chance: those above the least by so much need
    not be the most probable."""
    along = knots.place_mm[sorted({0, len(knots.place_mm) // 2, len(knots.place_mm) - 1})]
    knots = Knots(along, knots.turn_rad, knots.turns)
    own, turned = np.linalg.eigh(
        between_knots(knots)
    )  # of knots so mixed each wave has a variance of its own
    models = [(factor, blur) for factor in wider for blur in blurs_px]
    contrasts = [
        contrast_of(replace(pieces, radius_px=factor * pieces.radius_px)) for factor in wider
    ]
    contrast = np.tile(np.repeat(contrasts, len(blurs_px)), len(shifts_px))

    def asked(each_pixel: bool) -> np.ndarray:
        normal = GatheredEquations(
            pieces, knots.weights(pieces) @ turned, robust, each_pixel=each_pixel
        ).normal(shifts_px, models, terms)
        return _doubts(
            *(part.reshape(-1, *part.shape[2:]) for part in normal), own, contrast, no_chance
        )

    doubts = exactly_if_needed(asked)
    return doubts.reshape(len(shifts_px), len(wider), len(blurs_px)).transpose(1, 0, 2)


def _doubts(left, right, power, own, contrast, no_chance: float) -> np.ndarray:
    """Minus twice the log evidence (g,) of such normal equations, each wave as strong as is most probable; see
    `doubts_of`. own (knots,): inverse variances of a wave's coefficients over its strength's; contrast (g,)."""
    count, terms = len(own), left.shape[1] // len(own)
    strength = contrast[:, None] * WAVE_SHARE[:terms]
    low, high = (contrast[:, None] * share for share in _STRENGTHS)
    doubts, some = np.empty(len(left)), np.arange(len(left))
    for number in range(_ROUNDS + 1):
        stiff = (own[:, None] * strength[some, None] ** -2.0).reshape(len(some), -1)
        waves, variances, log_det = _most_probable(left[some], right[some], stiff)
        doubts[some] = (
            power[some]
            - np.sum(right[some] * waves, axis=1)
            + log_det
            - np.sum(np.log(stiff), axis=1)
        )
        asked = own @ (waves**2 + variances).reshape(-1, count, terms)
        strength[some, 1:] = np.clip(np.sqrt(asked / count), low[some], high[some])[:, 1:]
        if number >= _FIRST_ROUNDS:
            some = some[doubts[some] < doubts.min() + no_chance]
    return doubts


def _most_probable(left, right, stiff) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coefficients (g, size) by normal equations with priors of these inverse variances (g, size); their variances
    (g, size); and the log (g,) of each one's determinant."""
    root = left.copy()
    diagonal = np.einsum("gii->gi", root)
    diagonal += stiff
    root = np.linalg.cholesky(root)
    inverse = np.array([dtrtri(one.T)[0] for one in root])  # of the roots' transposes
    waves = (inverse @ (right[:, None] @ inverse).transpose(0, 2, 1))[..., 0]
    return (
        waves,
        np.sum(inverse**2, axis=2),
        2.0 * np.sum(np.log(np.einsum("gii->gi", root)), axis=1),
    )
