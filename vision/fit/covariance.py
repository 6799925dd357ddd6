"""How uncertain a fit is by which causes: line points, touching, givens, priors, cameras, the rig's
place; and what chance says of a departure.
"""

import numpy as np
from scipy.special import chdtrc

from vision.fit.blocks import columns_of
from vision.fit.converged_fit import ConvergedFit, times_residual_covariance
from vision.fit.problem import Problem

# [chance] By which a departure that chance makes is reported, a whisk. Study: chosen.
FALSE_ALARM = 1e-3
# [sigma] A shift of so many stated sigmas, or one as unsure, matters: less adds no more than an
# eighth to an error, √(1 + 0.5²). Derived.
MATTERS = 0.5
CAUSES = ("wire", "bar", "touch", "diameters", "light", "priors", "cameras", "placement")


def chance_of(values: np.ndarray, covariance: np.ndarray) -> float:
    """Return the chance that Gaussian errors of this covariance (k, k) are as far from 0 as values
    (k,), by chi²; 1 where nothing is determined, NaN where the covariance is not finite.
    """
    if not np.all(np.isfinite(covariance)):
        return float("nan")
    sigma = np.sqrt(np.maximum(np.diag(covariance), 1e-300))  # 0 of what is not determined
    z = values / sigma
    correlation = covariance / np.outer(sigma, sigma)
    return float(chdtrc(len(z), z @ np.linalg.pinv(correlation, hermitian=True) @ z))


def shared_covariance(fit: ConvergedFit) -> np.ndarray:
    """Return the part (size, size) of a fit's covariance that all whisks of a session have in
    common: by the object's stated place, diameters, light, cameras and placement.
    """
    blocks = fit.problem.blocks
    of_lines = [*blocks.wire_offsets, *blocks.bar_offsets]
    in_common = [blocks.bar_axis, blocks.reach, blocks.taper, *of_lines]
    priors = fit.weighted.jacobian[fit.problem.prior_rows]
    rows = priors[columns_of(*in_common)]
    by_row = fit.inverse_normal @ rows.T
    return by_row @ by_row.T + fit.camera_covariance


def variance_by_cause(fit: ConvergedFit, gradient: np.ndarray) -> dict[str, float]:
    """Return the variance that each cause adds to a quantity with this gradient (size,); the parts
    add up to it.

    wire, bar: scatter of their line points, and of the bar its stated place; touch: roundness of bar and wire;
    diameters: their sigmas, and the length's of a whisker that tapers; light: lines off as a whole; priors: those
    of rest shape and bend; cameras: lenses, and poses towards the rig board; placement: where the rig frame
    is, by rig board and free strokes (NaN where the cameras do not distinguish it: it is in `cameras` then).
    An observation's part is its row's sensitivity times the row's covariance with all others. The placement
    errs apart from corners and lenses, so that there are no cross-terms.
    """
    by_row = fit.weighted.jacobian @ (fit.inverse_normal @ gradient)
    parts = by_row * times_residual_covariance(fit.problem, by_row[None])[0]
    variances = _sum_by_cause(fit.problem, parts)
    whole = float(gradient @ fit.camera_covariance @ gradient)
    placement = _placement_variance(fit, gradient)
    known = 0.0 if np.isnan(placement) else placement
    variances["cameras"] = max(whole - known, 0.0)  # rounding may leave less than nothing
    variances["placement"] = placement
    return {name: float(variance) for name, variance in variances.items()}


def _sum_by_cause(problem: Problem, parts: np.ndarray) -> dict[str, float]:
    """Return the sums of all residuals' parts (n,) by the cause that each belongs to."""
    blocks = problem.blocks
    on_wire = [seen.on_wire for seen in problem.seen]
    is_wire = np.repeat(on_wire, [len(seen.points) for seen in problem.seen])
    by_point = parts[: len(is_wire)]
    priors = parts[problem.prior_rows.start :]
    behind_light = blocks.motion.start
    return {
        "wire": np.sum(by_point[is_wire]),
        "bar": np.sum(by_point[~is_wire]) + np.sum(priors[blocks.bar_axis.slice]),
        "touch": np.sum(parts[problem.contact_rows]),
        "diameters": np.sum(priors[columns_of(blocks.reach, blocks.taper)]),
        "light": np.sum(priors[blocks.taper.slice.stop : behind_light]),
        "priors": np.sum(priors[blocks.rest_shape.slice]) + np.sum(priors[behind_light:]),
    }


def _placement_variance(fit: ConvergedFit, gradient: np.ndarray) -> float:
    """Return the variance by the rig frame's placement; NaN where the cameras do not distinguish
    it.
    """
    cameras = fit.problem.cameras
    if cameras.placement is None:
        return float("nan")
    by_placement = gradient @ fit.parameters_by_camera @ cameras.by_placement
    return float(by_placement @ cameras.placement @ by_placement)
