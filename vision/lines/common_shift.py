"""By how much all of a rod's pieces may lie to one side of where they were found.

Such a shift is told by the rims alone, and shading can stand in for it: what is believed of the light decides, and how
strong each wave of it is nobody knows beforehand. Here each has the strength that makes the pixels most probable
(empirical Bayes, MacKay 1992). How probable each shift is then is looked up on a grid, for it often is no Gauss curve.
"""

import numpy as np
from scipy.interpolate import RectBivariateSpline

from vision.lines.bands import Pieces
from vision.lines.shading import WAVE_SHARE, Equations, Knots, between_knots, contrast_of, stiffness

_PARTS = np.linspace(-1.0, 1.0, 15)
_SHIFTS_PX = 1.5 * _PARTS * np.sqrt(np.abs(_PARTS))  # denser in the middle
_LOG_BLURS = np.linspace(-0.3, 0.3, 5)
_FINE = 301
_STRENGTHS = 0.05, 1.0  # of the contrast: less does not show, more is more than the rod itself
_ROUNDS = 12
# What the evidence counts: strengths are fitted to the pixels that they explain, and what the model lacks of the light
# is alike in all pieces. In 65 views the true shift is most probable so (tests/ladder/wire_scenes.py).
EVIDENCE_COUNTS = 0.5


def common_spread_px(pieces: Pieces, blur_px: float, terms: int, knots: Knots, robust: np.ndarray,
                     blur_prior: tuple[float, float]) -> float:
    """RMS distance from where pieces lie of all common shifts, each as it is probable, px.

    terms, robust: see `doubts_of`; blur_px: found where they lie; blur_prior: blur, px, and sigma of its logarithm.
    """
    doubts = EVIDENCE_COUNTS * doubts_of(pieces, _SHIFTS_PX, blur_px * np.exp(_LOG_BLURS), terms, knots, robust)
    doubts += ((_LOG_BLURS + np.log(blur_px / blur_prior[0])) / blur_prior[1]) ** 2
    shift, log_blur = (np.linspace(grid[0], grid[-1], _FINE) for grid in (_SHIFTS_PX, _LOG_BLURS))
    fine = RectBivariateSpline(_SHIFTS_PX, _LOG_BLURS, doubts)(shift, log_blur)
    chance = np.exp(-0.5 * (fine - fine.min())).sum(axis=1)
    return float(np.sqrt(np.average(shift**2, weights=chance)))


def doubts_of(pieces: Pieces, shifts_px: np.ndarray, blurs_px: np.ndarray, terms: int, knots: Knots,
              robust: np.ndarray) -> np.ndarray:
    """Minus twice the log evidence (m, b) of common shifts, shifts_px (m,), and blurs, blurs_px (b,), by so many waves
    at the first, middle and last of the knots along the rod, each wave as strong as is most probable. robust (s,):
    weight of each piece."""
    along = knots.place_mm[sorted({0, len(knots.place_mm) // 2, len(knots.place_mm) - 1})]
    knots = Knots(along, knots.turn_rad, knots.turns)
    normal = _normal_equations(pieces, shifts_px, blurs_px, terms, knots.weights(pieces), robust)
    return _doubts(*normal, knots, contrast_of(pieces)).reshape(len(shifts_px), len(blurs_px))


def _normal_equations(pieces: Pieces, shifts_px, blurs_px, terms: int, hats, robust):
    """Normal matrices (g, size, size), right sides (g, size) and squares (g,) at each shift and blur."""
    normal = []
    for shift in shifts_px:
        moved = pieces.moved(np.full(len(pieces), shift))
        for blur in blurs_px:
            equations = Equations(moved, blur, terms)
            normal.append((*equations.shared(hats, robust), robust @ equations.power))
    left, right, power = (np.array(column) for column in zip(*normal))
    return left, right, power


def _doubts(left, right, power, knots: Knots, contrast: float) -> np.ndarray:
    """Minus twice the log evidence (g,) of such normal equations, each wave as strong as is most probable."""
    between, count, terms = between_knots(knots), len(knots), left.shape[1] // len(knots)
    strength = np.tile(contrast * WAVE_SHARE[:terms], (len(left), 1))
    low, high = contrast * np.array(_STRENGTHS)
    for _ in range(_ROUNDS):
        inverse = np.linalg.inv(left + stiffness(strength, knots))
        waves = (inverse @ right[..., None]).reshape(-1, count, terms)
        asked = np.einsum("gat,ab,gbt->gt", waves, between, waves)
        asked += np.einsum("ab,gbtat->gt", between, inverse.reshape(-1, count, terms, count, terms))
        strength[:, 1:] = np.clip(np.sqrt(asked / count), low, high)[:, 1:]
    stiff = stiffness(strength, knots)
    waves = np.linalg.solve(left + stiff, right[..., None])[..., 0]
    return power - np.sum(right * waves, axis=1) + np.linalg.slogdet(left + stiff)[1] - np.linalg.slogdet(stiff)[1]
