"""Four gauge coefficients from pairs of moment and volts: one weighted regression, errors on both sides."""

from collections.abc import Sequence

import numpy as np
from scipy.special import chdtri

from bench.gauges.gauge_faults import Undetermined, check_channels, check_heard
from bench.gauges.gauge_readings import Pairs
from bench.gauges.matrix import FROM_TRIALS, GaugeMatrix, Gauges

# Below this share of the stronger direction, the weaker one is not known to the per cent that is wanted: a mount that
# was turned by 6° instead of 90°, or one slope only.
_LEAST_DIRECTION = 0.1
_ROUNDS = 5  # in which the weights follow the coefficients. Set by eye
_CHANCE = 0.01  # that sound residuals are taken for too large
RECORD = "record gauge trials with the follicle unturned and turned by 90° (follicle_roll_deg = 90)"
_SQUARE_DEG = 20.0  # a follicle turned by 0° or 90° within this reads one channel at a time


def fit_gauges(pairs: Sequence[Pairs]) -> Gauges:
    """Coefficients from all pairs, and for each trial those without it; the paper's way beside them.

    Raises Undetermined where the pairs do not fix the four coefficients, saying what to record, and BadInput where the
    channels are swapped, reversed or silent.
    """
    if fixes_matrix(pairs):
        check_heard(pairs)
    fitted = fit_matrix(pairs)
    if fitted is None:
        raise Undetermined(
            f"the gauge trials do not fix both channels ({_recorded(pairs)}); {RECORD}",
            file="trials",
        )
    check_channels(fitted)
    full_scale = np.abs(np.concatenate([p.moments for p in pairs])).max(axis=0)
    return Gauges(
        fitted,
        FROM_TRIALS,
        leave_out(pairs, fitted),
        one_factor(pairs),
        four_at_angle(pairs),
        full_scale,
    )


def _recorded(pairs: Sequence[Pairs]) -> str:
    return (
        ", ".join(f"{p.trial} with the follicle at {p.roll_deg:g}°" for p in pairs)
        or "no whisk could be read"
    )


def fit_matrix(pairs: Sequence[Pairs]) -> GaugeMatrix | None:
    """Generalised least squares of M · volts = moments, all that pairs of a whisk share in their covariance.

    Where the residuals are wider than stated, so is the result. None where the pairs do not fix the matrix.
    """
    if not fixes_matrix(pairs):
        return None
    volts, moments = (
        np.concatenate([p.volts for p in pairs]),
        np.concatenate([p.moments for p in pairs]),
    )
    matrix = np.linalg.lstsq(volts, moments, rcond=None)[0].T
    for _ in range(_ROUNDS):
        parts = [_normal(p, matrix) for p in pairs]
        matrix = _solve(parts)[0].reshape(2, 2)
    covariance = np.linalg.inv(sum(normal for normal, _ in parts))
    return GaugeMatrix(matrix, covariance * widening(pairs, matrix))


def leave_out(pairs: Sequence[Pairs], fitted: GaugeMatrix) -> dict[str, GaugeMatrix | None]:
    """For each trial, the coefficients without its pairs; None where the rest do not fix them.

    The weights are those of the whole fit, so that hundreds of trials cost hundreds of subtractions.
    """
    parts, wider = [_normal(p, fitted.matrix) for p in pairs], widening(pairs, fitted.matrix)
    without: dict[str, GaugeMatrix | None] = {}
    for name in dict.fromkeys(p.trial for p in pairs):
        rest = [part for p, part in zip(pairs, parts) if p.trial != name]
        if fixes_matrix([p for p in pairs if p.trial != name]):
            coefficients, covariance = _solve(rest)
            without[name] = GaugeMatrix(coefficients.reshape(2, 2), covariance * wider)
        else:
            without[name] = None
    return without


def fixes_matrix(pairs: Sequence[Pairs]) -> bool:
    """Do the moments point in two directions?"""
    return bool(pairs) and in_two_directions(np.concatenate([p.moments for p in pairs]))


def in_two_directions(vectors: np.ndarray) -> bool:
    """Do vectors (n, 2), moments or the volts of them, fix a matrix?"""
    weak, strong = np.sqrt(np.maximum(np.linalg.eigvalsh(vectors.T @ vectors), 0.0))
    return bool(weak > _LEAST_DIRECTION * strong)


def _normal(p: Pairs, matrix) -> tuple[np.ndarray, np.ndarray]:
    """Normal matrix (4, 4) and right-hand side (4,) of one whisk's pairs."""
    rows, weight = _rows(p), _weight(p, matrix)
    return rows.T @ weight @ rows, rows.T @ weight @ p.moments.ravel()


def _solve(parts) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (4,) and covariance (4, 4) of the summed normal equations."""
    covariance = np.linalg.inv(sum(normal for normal, _ in parts))
    return covariance @ sum(right for _, right in parts), covariance


def _rows(p: Pairs) -> np.ndarray:
    """Design (2n, 4): moment of each pair over the coefficients."""
    return np.concatenate([np.kron(np.eye(2), v[None, :]) for v in p.volts])


def _weight(p: Pairs, matrix) -> np.ndarray:
    """Inverse covariance (2n, 2n) of the residuals.

    What scales all moments of a whisk counts as a share of the fitted moments: a share of the known ones would draw the
    coefficients towards zero, the more so the wider the residuals (Peelle's puzzle).
    """
    through, fitted = np.kron(np.eye(len(p)), matrix), p.scale_sigma * (p.volts @ matrix.T).ravel()
    return np.linalg.inv(
        p.moments_covariance + np.outer(fitted, fitted) + through @ p.volts_covariance @ through.T
    )


def widening(pairs: Sequence[Pairs], matrix: np.ndarray) -> float:
    """By how much the residuals' squares exceed what was stated; 1 where they do so no more than chance allows.

    Sound sigmas, widened whenever chance makes the residuals large, would be too wide in the mean: 95 % intervals would
    hold in 97 %.
    """
    residuals = [(p.volts @ matrix.T - p.moments).ravel() for p in pairs]
    freedom = sum(len(r) for r in residuals) - 4
    squares = sum(r @ _weight(p, matrix) @ r for p, r in zip(pairs, residuals))
    return squares / freedom if freedom > 0 and squares > chdtri(freedom, _CHANCE) else 1.0


def four_at_angle(pairs: Sequence[Pairs]) -> GaugeMatrix | None:
    """Four coefficients from one pair a whisk, (2) at one pushing angle: the paper's readings in both positions."""
    read = [p for p in pairs if np.isfinite(p.paper_volts).all()]
    if not fixes_matrix(read):
        return None
    moments, volts = (
        np.array([p.paper_moment for p in read]),
        np.array([p.paper_volts for p in read]),
    )
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
