"""Four gauge coefficients from pairs of moment and volts: one weighted regression, errors on both sides."""

from collections.abc import Sequence

import numpy as np

from bench.errors import BadInput
from bench.gauge_readings import Pairs
from bench.gauges import FROM_TRIALS, GaugeMatrix, Gauges

# Below this share of the stronger direction, the weaker one is not known to the per cent that is wanted: a mount that
# was turned by 6° instead of 90°, or one slope only.
_LEAST_DIRECTION = 0.1
_ROUNDS = 5
_SQUARE_DEG = 20.0  # a follicle turned by 0° or 90° within this reads one channel at a time


def fit_gauges(pairs: Sequence[Pairs]) -> Gauges:
    """Coefficients from all pairs, and for each trial those without it; the paper's way beside them.

    Raises BadInput where the pairs do not fix the four coefficients, saying what to record.
    """
    fitted = fit_matrix(pairs)
    if fitted is None:
        raise BadInput(
            f"the gauge trials do not fix both channels ({_recorded(pairs)}); record gauge trials with the "
            "follicle unturned and turned by 90° (follicle_roll_deg = 90)",
            file="trials",
        )
    names = list(dict.fromkeys(p.trial for p in pairs))
    without = {name: fit_matrix([p for p in pairs if p.trial != name]) for name in names}
    return Gauges(fitted, FROM_TRIALS, without, one_factor(pairs), four_at_angle(pairs))


def _recorded(pairs: Sequence[Pairs]) -> str:
    return ", ".join(f"{p.trial} with the follicle at {p.roll_deg:g}°" for p in pairs) or "no whisk could be read"


def fit_matrix(pairs: Sequence[Pairs]) -> GaugeMatrix | None:
    """Generalised least squares of M · volts = moments, all that pairs of a whisk share in their covariance.

    Where the residuals are wider than stated, so is the result. None where the pairs do not fix the matrix.
    """
    if not fixes_matrix(pairs):
        return None
    volts, moments = np.concatenate([p.volts for p in pairs]), np.concatenate([p.moments for p in pairs])
    matrix = np.linalg.lstsq(volts, moments, rcond=None)[0].T
    for _ in range(_ROUNDS):
        normal, right = np.zeros((4, 4)), np.zeros(4)
        weights = [_weight(p, matrix) for p in pairs]
        for p, weight in zip(pairs, weights):
            rows = _rows(p)
            normal += rows.T @ weight @ rows
            right += rows.T @ weight @ p.moments.ravel()
        matrix = np.linalg.solve(normal, right).reshape(2, 2)
    return GaugeMatrix(matrix, np.linalg.inv(normal) * max(1.0, _reduced_chi2(pairs, weights, matrix)))


def fixes_matrix(pairs: Sequence[Pairs]) -> bool:
    """Do the moments point in two directions?"""
    moments = np.concatenate([p.moments for p in pairs]) if pairs else np.zeros((0, 2))
    if len(moments) < 2:
        return False
    strong, weak = np.linalg.svd(moments, compute_uv=False)
    return bool(weak > _LEAST_DIRECTION * strong)


def _rows(p: Pairs) -> np.ndarray:
    """Design (2n, 4): moment of each pair over the coefficients."""
    return np.concatenate([np.kron(np.eye(2), v[None, :]) for v in p.volts])


def _weight(p: Pairs, matrix) -> np.ndarray:
    through = np.kron(np.eye(len(p)), matrix)
    return np.linalg.inv(p.moments_covariance + through @ p.volts_covariance @ through.T)


def _reduced_chi2(pairs, weights, matrix) -> float:
    residuals = [(p.volts @ matrix.T - p.moments).ravel() for p in pairs]
    freedom = sum(len(r) for r in residuals) - 4
    return sum(r @ w @ r for r, w in zip(residuals, weights)) / freedom if freedom > 0 else 1.0


def four_at_angle(pairs: Sequence[Pairs]) -> GaugeMatrix | None:
    """Four coefficients from one pair a whisk, (2) at one pushing angle: the paper's readings in both positions."""
    read = [p for p in pairs if np.isfinite(p.paper_volts).all()]
    if not fixes_matrix(read):
        return None
    moments, volts = np.array([p.paper_moment for p in read]), np.array([p.paper_volts for p in read])
    return GaugeMatrix(np.linalg.lstsq(volts, moments, rcond=None)[0].T)


def one_factor(pairs: Sequence[Pairs]) -> GaugeMatrix:
    """The paper's way (section V): each channel's factor from the whisks in which it senses the push, no cross-talk."""
    return GaugeMatrix(np.diag([_factor(pairs, 0, 90.0), _factor(pairs, 1, 0.0)]))


def _factor(pairs: Sequence[Pairs], channel: int, roll_deg: float) -> float:
    """Mean ratio of moment to volts of one channel at the pushing angle; NaN where no follicle was turned so."""
    ratios = [
        p.paper_moment[channel] / p.paper_volts[channel]
        for p in pairs
        if abs((p.roll_deg - roll_deg + 90.0) % 180.0 - 90.0) < _SQUARE_DEG
    ]
    return float(np.nanmean(ratios)) if np.isfinite(ratios).any() else float("nan")
