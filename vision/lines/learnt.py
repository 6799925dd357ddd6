"""How far all of a rod's pieces lie to one side, by the evidence of light whose strength is learnt from them.

Such a shift is told by the rims alone, and shading can stand in for it: what is believed of the light decides. How
strong each wave of it is nobody knows beforehand. Here each has the strength that makes the pixels most probable
(empirical Bayes; MacKay 1992): waves that no pixel asks for vanish, so that light which is alike on both sides keeps a
rod in the middle, and a dark rim is not explained by five waves that happen to cancel there. How probable each shift is
then is looked up on a grid, for it often is no Gauss curve.
"""

import numpy as np
from scipy.interpolate import RectBivariateSpline

from vision.lines.bands import Pieces
from vision.lines.shading import Equations, Knots, between_knots, contrast_of, wave_prior

_SHIFTS_PX = 1.5 * np.linspace(-1.0, 1.0, 15) * np.sqrt(np.abs(np.linspace(-1.0, 1.0, 15)))  # denser in the middle
_LOG_BLURS = np.linspace(-0.3, 0.3, 5)
_FINE = 301
_STRENGTHS = 0.05, 1.0  # of the contrast: less does not show, more is more than the rod itself
_ROUNDS = 12
# What the evidence counts: strengths are fitted to the same pixels, and what the model lacks of the light is alike in
# all. In 65 views the shift's probability is the best so, and it keeps to its sigma (tests/ladder/wire_scenes.py).
_COUNTS = 0.5


def shift_by_learnt_light(pieces: Pieces, blur_px: float, terms: int, knots: Knots, robust: np.ndarray,
                          blur_prior: tuple[float, float]) -> tuple[float, float, float]:
    """Mean and sigma, px, of the shift of all pieces from where they lie, and the blur, px, that goes with it.

    Of light of so many waves, its three knots along the rod among these. robust (s,): weight of each piece. blur_px:
    found where they lie; blur_prior: blur, px, and sigma of its logarithm.
    """
    along = knots.place_mm[[0, len(knots.place_mm) // 2, -1]] if len(knots.place_mm) > 3 else knots.place_mm
    knots = Knots(along, knots.turn_rad, knots.turns)
    hats = knots.weights(pieces)
    normal = []
    for shift in _SHIFTS_PX:
        moved = pieces.moved(np.full(len(pieces), shift))
        for blur in blur_px * np.exp(_LOG_BLURS):
            equations = Equations(moved, blur, terms)
            normal.append((*equations.shared(hats, robust), robust @ equations.power))
    left, right, power = (np.array(column) for column in zip(*normal))
    usual, between = wave_prior(pieces, terms), between_knots(knots)
    off = ((_LOG_BLURS + np.log(blur_px / blur_prior[0])) / blur_prior[1]) ** 2
    chances = [_chance(_doubts(left, right, power, between, usual, rounds, contrast_of(pieces)).reshape(
        len(_SHIFTS_PX), len(_LOG_BLURS)), off) for rounds in (0, _ROUNDS)]
    return _moments(sum(chances) / len(chances), blur_px)


def _doubts(left, right, power, between, strength, rounds: int, contrast: float) -> np.ndarray:
    """Minus twice the log evidence (g,) of normal matrices left (g, size, size), right sides (g, size) and squares
    (g,), waves as strong as believed (terms,), grey levels, or in some rounds made as strong as is most probable;
    between (k, k): see `between_knots`."""
    count, terms = len(between), len(strength)
    strength = np.tile(strength, (len(left), 1))
    low, high = contrast * np.array(_STRENGTHS)
    for _ in range(rounds):
        inverse = np.linalg.inv(left + _stiffness(strength, between))
        waves = (inverse @ right[..., None]).reshape(-1, count, terms)
        asked = np.einsum("gat,ab,gbt->gt", waves, between, waves)
        asked += np.einsum("ab,gbtat->gt", between, inverse.reshape(-1, count, terms, count, terms))
        strength[:, 1:] = np.clip(np.sqrt(asked / count), low, high)[:, 1:]
    stiff = _stiffness(strength, between)
    waves = np.linalg.solve(left + stiff, right[..., None])[..., 0]
    return power - np.sum(right * waves, axis=1) + np.linalg.slogdet(left + stiff)[1] - np.linalg.slogdet(stiff)[1]


def _stiffness(strength, between) -> np.ndarray:
    """Inverse covariances (g, size, size) of the coefficients of waves this strong (g, terms)."""
    size = len(between) * strength.shape[1]
    both = between[None, :, None, :, None] * (strength**-2.0)[:, None, :, None, None] * np.eye(strength.shape[1])[:, None]
    return both.reshape(len(strength), size, size)


def _chance(doubts, off) -> np.ndarray:
    """Probability (_FINE, _FINE) of shift and blur."""
    fine = RectBivariateSpline(_SHIFTS_PX, _LOG_BLURS, _COUNTS * doubts + off)(_fine(_SHIFTS_PX), _fine(_LOG_BLURS))
    chance = np.exp(-0.5 * (fine - fine.min()))
    return chance / chance.sum()


def _moments(chance, blur_px: float) -> tuple[float, float, float]:
    """Mean and sigma of the shift, and mean blur, px."""
    of_shift, shift = chance.sum(axis=1), _fine(_SHIFTS_PX)
    mean = float(of_shift @ shift)
    return (mean, float(np.sqrt(of_shift @ (shift - mean) ** 2)),
            float(blur_px * np.exp(chance.sum(axis=0) @ _fine(_LOG_BLURS))))


def _fine(grid) -> np.ndarray:
    return np.linspace(grid[0], grid[-1], _FINE)
