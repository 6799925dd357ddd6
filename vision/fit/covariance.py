"""How uncertain a fit is, and by which causes: line points, touching, givens, priors, cameras, the
rig's place.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.ndimage import correlate1d
from scipy.special import chdtrc

from vision.fit.blocks import columns_of
from vision.fit.object_rows import object_rows
from vision.fit.problem import Problem, State, curves_of, point_rows
from vision.fit.solve import linear_at, weighted_jacobian
from vision.geometry.camera import N_PARAMETERS
from vision.geometry.centreline import Curves
from vision.wire.points import Observed

# [points] Beyond, nothing is shared: at the highest correlation that `_MOST_ALIKE` allows, 7/9,
# 0.7 % is left. Derived.
_FARTHEST = 20
CAUSES = ("wire", "bar", "touch", "diameters", "light", "priors", "cameras", "placement")


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Covariances of the fit's parameters, (size, size) each.

    inverse_normal: (JᵀWJ)⁻¹, the factor of JᵀW in the parameters' sensitivity to observations.
    noise: the covariance by the observations' and priors' own errors. by_camera_error (size, k):
    how the parameters change with each unit error of the cameras (`Cameras.by_error`).
    """

    inverse_normal: np.ndarray
    noise: np.ndarray
    by_camera_error: np.ndarray

    @property
    def lens(self) -> np.ndarray:
        """Return the covariance by the cameras' errors."""
        return self.by_camera_error @ self.by_camera_error.T

    @property
    def covariance(self) -> np.ndarray:
        """Return the whole covariance."""
        return self.noise + self.lens


def uncertainty(problem: Problem, state: State, inverse_normal: np.ndarray) -> Uncertainty:
    """Return the uncertainty of a fit. inverse_normal (size, size): the second result of `solve`.

    Neighbouring line points of the wire have correlated errors. Their sigmas are as wide as is
    right for what changes slowly along the wire, and too wide for what does not, so that the errors
    are propagated with their correlation.
    """
    by_row = inverse_normal @ weighted_jacobian(problem, state).T
    noise = times_residual_covariance(problem, by_row) @ by_row.T
    by_camera_error = by_lens(problem, state, inverse_normal) @ problem.cameras.by_error
    return Uncertainty(inverse_normal, noise, by_camera_error)


def times_residual_covariance(problem: Problem, rows: np.ndarray) -> np.ndarray:
    """Return rows (k, n) over all observations times the covariance (n, n) of their residuals.

    It is the unit matrix, but for points of the wire: points i and j of a line have the correlation
    ρ^|i − j|, and their sigmas are widened so that the variance of a mean stays what it is.
    """
    product = rows.copy()
    if not problem.neighbour_correlation:
        return product
    for seen, mine in point_rows(problem):
        if seen.on_wire:
            correlation = problem.neighbour_correlation[seen.camera]
            shared = correlation ** np.abs(np.arange(-_FARTHEST, _FARTHEST + 1))
            weights = shared / shared.sum()
            product[:, mine] = correlate1d(rows[:, mine], weights, axis=1, mode="constant")
    return product


def by_lens(problem: Problem, state: State, inverse_normal: np.ndarray) -> np.ndarray:
    """Return derivatives (size, 15 cameras) of the fit's parameters by the cameras'.

    They are -(JᵀWJ)⁻¹ JᵀW J_c: those residuals are what the fit is made of, and with W as in the
    fit a move of all cameras together moves the whole scene and nothing in it.
    """
    linear = linear_at(problem, state)
    weights = linear.weights()[linear.is_point]
    by_camera = weights[:, None] * camera_rows(problem, state)
    return -inverse_normal @ (linear.jacobian[linear.is_point].T @ by_camera)


def chance_of(values: np.ndarray, covariance: np.ndarray) -> float:
    """Return the chance that what has this covariance (k, k) is so far (k,) from 0, by chi²; 1 where
    nothing is determined, NaN where the covariance is not finite.
    """
    if not np.all(np.isfinite(covariance)):
        return float("nan")
    sigma = np.sqrt(np.maximum(np.diag(covariance), 1e-300))  # 0 of what is not determined
    z = values / sigma
    correlation = covariance / np.outer(sigma, sigma)
    return float(chdtrc(len(z), z @ np.linalg.pinv(correlation, hermitian=True) @ z))


def shared_covariance(problem: Problem, state: State, fitted: Uncertainty) -> np.ndarray:
    """Return the part (size, size) of a fit's covariance that all whisks of a session have in
    common: by the object's stated place, diameters, light, cameras and placement.
    """
    blocks = problem.blocks
    in_common = [blocks.bar_axis, blocks.reach, *blocks.wire_offsets, *blocks.bar_offsets]
    priors = weighted_jacobian(problem, state)[problem.prior_rows]
    rows = priors[columns_of(*in_common)]
    by_row = fitted.inverse_normal @ rows.T
    return by_row @ by_row.T + fitted.lens


def variance_by_cause(
    problem: Problem, state: State, fitted: Uncertainty, gradient: np.ndarray
) -> dict[str, float]:
    """Return the variance that each cause adds to a quantity with this gradient (size,); the parts
    add up to it.

    wire, bar: scatter of their line points, and of the bar its stated place; touch: roundness of bar and wire; diameters: their
    sigmas; light: lines off as a whole; priors: those of rest shape and bend; cameras: lenses, and
    poses towards the rig board; placement: where the rig frame is, by rig board and free strokes
    (NaN where the cameras do not distinguish it: it is in `cameras` then). An observation's part is
    its row's sensitivity times the row's covariance with all others. The placement errs apart from
    corners and lenses, so that there are no cross-terms.
    """
    by_row = weighted_jacobian(problem, state) @ (fitted.inverse_normal @ gradient)
    parts = by_row * times_residual_covariance(problem, by_row[None])[0]
    variances = _sum_by_cause(problem, parts)
    whole = float(gradient @ fitted.lens @ gradient)
    placement = _placement_variance(problem, state, fitted.inverse_normal, gradient)
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
    reach = blocks.reach.start
    behind_light = blocks.motion.start
    return {
        "wire": np.sum(by_point[is_wire]),
        "bar": np.sum(by_point[~is_wire]) + np.sum(priors[blocks.bar_axis.slice]),
        "touch": np.sum(parts[problem.contact_rows]),
        "diameters": priors[reach],
        "light": np.sum(priors[reach + 1 : behind_light]),
        "priors": np.sum(priors[blocks.rest_shape.slice]) + np.sum(priors[behind_light:]),
    }


def _placement_variance(
    problem: Problem, state: State, inverse_normal: np.ndarray, gradient: np.ndarray
) -> float:
    """Return the variance by the rig frame's placement; NaN where the cameras do not distinguish
    it.
    """
    cameras = problem.cameras
    if cameras.placement is None:
        return float("nan")
    by_placement = gradient @ by_lens(problem, state, inverse_normal) @ cameras.by_placement
    return float(by_placement @ cameras.placement @ by_placement)


@lru_cache(maxsize=1)
def camera_rows(problem: Problem, state: State) -> np.ndarray:
    """Return derivatives (n, 15 cameras) of the line points' residuals by the cameras'
    parameters.
    """
    curves, _ = curves_of(problem, state.vector, state.arcs_mm)
    return np.concatenate([_by_cameras(problem, seen, state, curves) for seen in problem.seen])


def _by_cameras(problem: Problem, seen: Observed, state: State, curves: Curves) -> np.ndarray:
    """Return derivatives (n, 15 cameras) of one observation's residuals by the cameras' parameters.

    Each is the mean over the points in space that a line point shows. These count as fixed: where a
    sight grazes a rod's edge, a move of the grazing point along the sight moves no edge.
    """
    points = seen.points
    camera = problem.cameras.cameras[seen.camera]
    each = []
    for on_rod_mm in _on_rod(problem, seen, state, curves):
        _, _, by_parameter = camera.project_with_jacobians(on_rod_mm)
        each.append(by_parameter)
    by_camera = np.mean(each, axis=0)  # (n, 2, 15) px
    rows = np.zeros((len(points), N_PARAMETERS * len(problem.cameras)))
    first = N_PARAMETERS * seen.camera
    across_px = np.einsum("ni,nij->nj", points.normal, by_camera)
    rows[:, first : first + N_PARAMETERS] = across_px / points.sigma_px[:, None]
    return rows


def _on_rod(problem: Problem, seen: Observed, state: State, curves: Curves) -> list[np.ndarray]:
    """Return points (n, 3) that line points are pictures of: of the wire's axis, or as the object's
    form has them.
    """
    if not seen.on_wire:
        return object_rows(problem).shown_mm(seen, state.vector)
    points_mm, _ = curves.one(seen.frame).at(seen.points.place)
    return [points_mm]
