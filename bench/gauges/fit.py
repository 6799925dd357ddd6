"""Four gauge coefficients from pairs of moment and volts: one weighted regression, errors on both sides.

The cameras' errors move the moments of all whisks together, so that more whisks do not average them
away. They are unknowns of the regression as the coefficients are, each with its unit variance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from bench.gauges.gauge_faults import Undetermined, check_channels, check_heard
from bench.gauges.gauge_readings import Pairs
from bench.gauges.matrix import FROM_TRIALS, GaugeCalibration, GaugeMatrix

# [1] Below this share of the stronger direction, the weaker one is not known to the per cent that is wanted: a mount that
# was turned by 6° instead of 90°, or one slope only. Derived.
_LEAST_DIRECTION = 0.1
# [rounds] In which the weights follow the coefficients: after two no estimate moves by 2e-5 of its sigma. Study:
# bench_thresholds.py gauges.fit _ROUNDS 1 2 3 10.
_ROUNDS = 5
# [1] Probability that sound residuals are taken for too large. Stated.
_CHANCE = 0.01
RECORD = "record gauge trials with the follicle unturned and turned by 90° (follicle_roll_deg = 90)"
# [°] A follicle turned by 0° or 90° within this reads one channel at a time.
_SQUARE_DEG = 20.0


def fit_gauges(pairs: Sequence[Pairs]) -> GaugeCalibration:
    """Fit coefficients to all pairs, and for each trial to those of the others; and the paper's way.

    Raises Undetermined where the pairs do not fix the four coefficients, saying what to record, and
    BadInput where the channels are swapped, reversed or silent.
    """
    if fixes_matrix(pairs):
        check_heard(pairs)
    fitted = fit_matrix(pairs)
    if fitted is None:
        trials = ", ".join(f"{p.trial} with the follicle at {p.roll_deg:g}°" for p in pairs)
        found = f"the gauge trials do not fix both channels ({trials or 'no whisk could be read'})"
        raise Undetermined(f"{found}; {RECORD}", file="trials")
    check_channels(fitted)
    return GaugeCalibration(
        fitted,
        FROM_TRIALS,
        leave_out(pairs, fitted),
        one_factor(pairs),
        four_at_angle(pairs),
        np.abs(_moments(pairs)).max(axis=0),
    )


def _moments(pairs: Sequence[Pairs]) -> np.ndarray:
    """Return the moments (n, 2) of all pairs."""
    return np.concatenate([p.moments for p in pairs])


def fit_matrix(pairs: Sequence[Pairs]) -> GaugeMatrix | None:
    """Fit M · volts = moments by generalised least squares.

    All that pairs of a whisk share is in their covariance, and the cameras' errors are what all
    whisks share. Where the residuals are wider than stated, so is the result. None where the pairs
    do not fix the matrix.
    """
    if not fixes_matrix(pairs):
        return None
    volts = np.concatenate([p.volts for p in pairs])
    matrix = np.linalg.lstsq(volts, _moments(pairs), rcond=None)[0].T
    for _ in range(_ROUNDS):
        solution = _solve([_normal_equations(p, matrix) for p in pairs])
        matrix = solution.gauges.matrix
    return solution.widened(widening(pairs, solution))


def leave_out(pairs: Sequence[Pairs], fitted: GaugeMatrix) -> dict[str, GaugeMatrix | None]:
    """Fit the coefficients without each trial's pairs; None where the rest do not fix them.

    The weights are those of the whole fit, so that hundreds of trials cost hundreds of
    subtractions.
    """
    equations = [_normal_equations(p, fitted.matrix) for p in pairs]
    wider = widening(pairs, _solve(equations))
    without: dict[str, GaugeMatrix | None] = {}
    for name in dict.fromkeys(p.trial for p in pairs):
        without[name] = None
        if fixes_matrix([p for p in pairs if p.trial != name]):
            rest = _solve([part for p, part in zip(pairs, equations) if p.trial != name])
            without[name] = rest.widened(wider)
    return without


def fixes_matrix(pairs: Sequence[Pairs]) -> bool:
    """Return whether the moments point in two directions."""
    return bool(pairs) and in_two_directions(_moments(pairs))


def in_two_directions(vectors: np.ndarray) -> bool:
    """Return whether vectors (n, 2), moments or the volts of them, fix a matrix."""
    weak, strong = np.sqrt(np.maximum(np.linalg.eigvalsh(vectors.T @ vectors), 0.0))
    return bool(weak > _LEAST_DIRECTION * strong)


@dataclass(frozen=True)
class _Solution:
    """The coefficients of a regression, and the cameras' errors (k,) as it has them."""

    gauges: GaugeMatrix
    camera_errors: np.ndarray

    def widened(self, factor: float) -> GaugeMatrix:
        """Return the coefficients with their covariance times a factor of 1 or more."""
        return replace(self.gauges, covariance=factor * self.gauges.covariance)


def _normal_equations(p: Pairs, matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the normal matrix (4 + k, 4 + k) and right-hand side (4 + k,) of one whisk's pairs.

    The unknowns are the coefficients and the k errors of the cameras.
    """
    # moment of each pair over the coefficients, (2n, 4)
    by_coefficient = np.concatenate([np.kron(np.eye(2), v[None, :]) for v in p.volts])
    design = np.hstack([by_coefficient, p.by_camera_error])
    weighted = design.T @ _weight(p, matrix)
    return weighted @ design, weighted @ p.moments.ravel()


def _solve(equations: Sequence[tuple[np.ndarray, np.ndarray]]) -> _Solution:
    """Solve summed normal equations of the coefficients and the cameras' errors, of unit variance."""
    size = max(len(right) for _, right in equations)
    normal = np.diag(np.repeat([0.0, 1.0], [4, size - 4]))
    right = np.zeros(size)
    for own_normal, own_right in equations:
        own = len(own_right)  # 4 of moments that no camera saw
        normal[:own, :own] += own_normal
        right[:own] += own_right
    posterior = np.linalg.inv(normal)  # covariance of the unknowns: truth less estimate
    estimate = posterior @ right
    matrix = estimate[:4].reshape(2, 2)
    # The coefficients change with a camera's error by their covariance with it, as its variance is 1.
    # Their error is estimate less truth, where the posterior has truth less estimate: hence the sign.
    by_camera_error = -posterior[:4, 4:]
    return _Solution(GaugeMatrix(matrix, posterior[:4, :4], by_camera_error), estimate[4:])


def _weight(p: Pairs, matrix: np.ndarray) -> np.ndarray:
    """Return the inverse covariance (2n, 2n) of the residuals.

    An error that scales all moments of a whisk counts as a share of the fitted moments: a share of
    the known ones would draw the coefficients towards zero, the more so the wider the residuals
    (Peelle's puzzle).
    """
    through = np.kron(np.eye(len(p)), matrix)
    common = p.scale_sigma * (p.volts @ matrix.T).ravel()
    covariance = p.moments_covariance + np.outer(common, common)
    return np.linalg.inv(covariance + through @ p.volts_covariance @ through.T)


def widening(pairs: Sequence[Pairs], solution: _Solution) -> float:
    """Return by how much the residuals' squares exceed what was stated.

    It is 1 where they do so no more than chance allows. Sound sigmas, widened whenever chance makes
    the residuals large, would be too wide in the mean: 95 % intervals would hold in 97 %.
    """
    matrix = solution.gauges.matrix
    errors = solution.camera_errors
    squares = errors @ errors
    for p in pairs:
        by_cameras = p.by_camera_error @ errors[: p.by_camera_error.shape[1]]
        residuals = p.residuals(matrix).ravel() + by_cameras
        squares += residuals @ _weight(p, matrix) @ residuals
    freedom = 2 * sum(len(p) for p in pairs) - 4
    return squares / freedom if freedom > 0 and squares > chdtri(freedom, _CHANCE) else 1.0


def four_at_angle(pairs: Sequence[Pairs]) -> GaugeMatrix | None:
    """Fit four coefficients to one pair a whisk, (2) at one pushing angle.

    These are the paper's readings in both positions. None where they do not fix them.
    """
    read = [p for p in pairs if np.isfinite(p.paper_volts).all()]
    if not fixes_matrix(read):
        return None
    moments = np.array([p.paper_moment for p in read])
    volts = np.array([p.paper_volts for p in read])
    return GaugeMatrix(np.linalg.lstsq(volts, moments, rcond=None)[0].T)


def one_factor(pairs: Sequence[Pairs]) -> GaugeMatrix:
    """Return each channel's factor from the whisks in which it senses the push, without cross-talk.

    This is the paper's way (section V).
    """
    return GaugeMatrix(np.diag([_factor(pairs, 0, 90.0), _factor(pairs, 1, 0.0)]))


def _factor(pairs: Sequence[Pairs], channel: int, roll_deg: float) -> float:
    """Return the mean ratio of moment to volts of one channel at the pushing angle.

    NaN where no follicle was turned so.
    """
    ratios = []
    for p in pairs:
        off_deg = (p.roll_deg - roll_deg + 90.0) % 180.0 - 90.0  # half a turn makes no difference
        if abs(off_deg) < _SQUARE_DEG:
            ratios.append(p.paper_moment[channel] / p.paper_volts[channel])
    return float(np.nanmean(ratios)) if np.isfinite(ratios).any() else float("nan")
