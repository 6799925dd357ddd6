"""When the whisker begins to bend, as the pictures show it.

Two cameras know bar and whisker in space, and so when they touch. To one camera both may be
millimetres off along its sight; but that they touch while the whisker bends, and not before, shows
in any view that sees it bend.
"""

from dataclasses import dataclass

import numpy as np

from vision.geometry.robust import mean_and_sigma

# [1] Of the bend: how far it may leave the curve through the first degrees, where the whisker
# begins to slide or sticks. Half or twice it moves slopes through one camera alone by 0.4 sigma,
# touch by 0.2. Study: thresholds.py fit.bend_onset _MODEL_SHARE … --cameras 1.
_MODEL_SHARE = 0.05
# [rad] A line that bows by a tenth of a pixel more in one frame than in the next. Study:
# coverage.py alone.
_LINE_RAD = np.radians(0.02)
# [rad⁻¹] A rod pushed by a bar bends in proportion, to a tenth for each degree. Study:
# coverage.py alone.
_CURVED_PER_RAD = 0.1 / np.radians(1.0)
# [rad] Past touch, over which the bend is a parabola to the share above. By 2.9° or 5.2° slopes
# through one camera alone move by 0.4 sigma. Study: thresholds.py fit.bend_onset _WINDOW_RAD …
# --cameras 1.
_WINDOW_RAD = np.radians(4.0)
# [rad] Between onsets that are tried: a fifth of the least sigma. Derived.
_STEP_RAD = np.radians(0.02)
# [rad] Added to an onset's sigma: it is determined no better than this. Study: coverage.py alone.
_LEAST_SIGMA_RAD = np.radians(0.1)
# [frames] Two for a parabola from nothing, and one left over. Derived.
_FEWEST_BENT = 3
# [chi²] Against no bend at all: five sigma. Derived.
_LEAST_BEND = 25.0


@dataclass(frozen=True)
class Onset:
    """Motor angle at which the whisker begins to bend, rad."""

    motor_rad: float
    sigma_rad: float


def seen_bend(bend_rad: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the component (f,) of bends (f, 2) that the pictures determine best, and its
    covariance (f, f).

    covariance (2 f, 2 f): of the bends.
    """
    frames = len(bend_rad)
    by_frame = covariance.reshape(frames, 2, frames, 2)
    information = np.linalg.inv(np.einsum("fifj->fij", by_frame))
    _, directions = np.linalg.eigh(np.sum(information, axis=0))
    best = directions[:, -1]
    return bend_rad @ best, np.einsum("i,figj,j->fg", best, by_frame, best)


def onset(motor_rad: np.ndarray, bend_rad: np.ndarray, covariance: np.ndarray) -> Onset | None:
    """Estimate the onset by a component of the bend (f,), in frames in order of the motor angle.

    covariance (f, f). The bend is none before the onset, then a parabola. Returns None where fewer
    than three frames are seen to bend.
    """
    tries = np.arange(motor_rad[0], motor_rad[-1], _STEP_RAD)
    chi2 = np.array([_misfit(motor_rad, bend_rad, covariance, at) for at in tries])
    possible = np.isfinite(chi2)
    if not np.any(possible) or _chi2_of_none(bend_rad, covariance) < _LEAST_BEND:
        return None
    least = np.min(chi2)
    scatter = max(1.0, least / len(motor_rad))
    above = np.where(possible, chi2 - least, np.inf)
    mean, spread = mean_and_sigma(tries, np.exp(-0.5 * above / scatter))
    return Onset(mean, float(np.hypot(spread, _LEAST_SIGMA_RAD)))


def _chi2_of_none(bend_rad: np.ndarray, covariance: np.ndarray) -> float:
    """Return chi² of no bend at all."""
    whole = covariance + np.eye(len(bend_rad)) * _LINE_RAD**2
    return float(bend_rad @ np.linalg.solve(whole, bend_rad))


def _misfit(
    motor_rad: np.ndarray, bend_rad: np.ndarray, covariance: np.ndarray, at_rad: float
) -> float:
    """Return chi² of the best parabola from nothing at an angle; a frame far beyond it adds 1.

    Infinite where fewer than three frames come after it.
    """
    past = motor_rad - at_rad
    near = past < _WINDOW_RAD
    if np.sum(near & (past > 0)) < _FEWEST_BENT:
        return np.inf
    chi2 = _misfit_of_parabola(past[near], bend_rad[near], covariance[np.ix_(near, near)])
    return chi2 + float(np.sum(~near))


def _misfit_of_parabola(past: np.ndarray, bend_rad: np.ndarray, covariance: np.ndarray) -> float:
    """Return chi² of bends (f,) about the best parabola from nothing, at angles past (f,) it."""
    model_variance = _LINE_RAD**2 + (_MODEL_SHARE * bend_rad) ** 2
    root = np.linalg.cholesky(covariance + np.diag(model_variance))
    after = np.maximum(past, 0.0)
    whitened = np.linalg.solve(root, np.stack([after, after**2, bend_rad], axis=1))
    linear, square, bend = whitened.T
    slope = abs(linear @ bend) / (linear @ linear)
    curvature_sigma = max(slope * _CURVED_PER_RAD, 1e-9)
    # The last row is the prior of the curvature, which is expected to be 0.
    by_slope = np.append(linear, 0.0)
    by_curvature = np.append(square, 1.0 / curvature_sigma)
    design = np.stack([by_slope, by_curvature], axis=1)
    wanted = np.append(bend, 0.0)
    solution = np.linalg.lstsq(design, wanted, rcond=None)[0]
    return float(np.sum((wanted - design @ solution) ** 2))
