"""One reprojection fit over all cameras and frames of a whisk: bar, rest shape, and the bend in
each frame.

Shared by all frames: the bar's axis and the whisker's rest shape. Each touching frame adds the two
components of its bend and one observation, that axis and centreline are bar radius + whisker radius
apart. What the pictures may be wrong in as a whole (a shift of the seen line from the rod's axis,
by light and lens) enters as twelve displacements a camera with priors (`Blocks.wire_offsets`,
`Blocks.bar_offsets`), and so ends up in the stated uncertainty.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from vision.fit.bend_onset import Onset
from vision.fit.blocks import Blocks
from vision.fit.differences import Perturbed, perturb
from vision.fit.object_rows import CameraPoints, Part, object_rows
from vision.fit.problem import (
    CONTACT_SIGMA_MM,
    Problem,
    State,
    bar_axes,
    bar_axis,
    curves_of,
    reach_mm,
    resting_curves,
    wire_modes,
    wire_of,
)
from vision.geometry.centreline import Curves
from vision.geometry.contact import clearance
from vision.geometry.newton import cauchy_weights
from vision.wire.points import Observed

# [sigma] Width of the Cauchy weights once the state is near: 95 % efficient on Gaussian noise at
# 2.4, more at 4. Study: coverage.py points.
LAST_SCALE = 4.0
# [steps] A state that moved by fewer steps of the differences (that is by 0.1 mm, 1 mrad; bends
# 10 mrad) keeps its Jacobian. Study: gradients.py.
_ALIKE = 1000.0
# [sigma] A step that moves all parameters together by less is the last. Derived.
_CONVERGED_SIGMA = 0.01
# [sigmas] Of the Cauchy weights, round by round: wide while the state is still off by many. At once
# 4, or from 100 on, touch moves by 0.01 sigma. Study: thresholds.py fit.solve _SCALES ….
_SCALES = (30.0, 10.0, *[LAST_SCALE] * 4)
# [1] Share of a column's length that the columns before it leave: below, normal equations lose ten digits
# of sixteen. Fits of six path-traced whisks leave 0.002 at least. Derived.
_LEAST_INDEPENDENT = 1e-5
# [rad] Of bend in one step: the rod's shape is not linear beyond. Stated.
_LONGEST_RAD = 0.3


@dataclass(frozen=True)
class Linear:
    """Residuals (n,) over their sigma, their Jacobian (n, size), and which are line points (robust
    weights).
    """

    residual: np.ndarray
    jacobian: np.ndarray
    is_point: np.ndarray

    def weights(self, scale: float = LAST_SCALE) -> np.ndarray:
        """Return Cauchy weights (n,) of line points, scale in sigmas, and 1 of touching and priors."""
        return np.where(self.is_point, cauchy_weights(self.residual, scale), 1.0)

    def weighted(self, scale: float = LAST_SCALE) -> "Linear":
        """Return residuals and Jacobian times the roots of their weights."""
        root = np.sqrt(self.weights(scale))
        return replace(self, residual=self.residual * root, jacobian=self.jacobian * root[:, None])

    def weigh(self, rows: np.ndarray) -> np.ndarray:
        """Return rows (m, k) of the first observations times the roots of their weights, and zeros
        below them: (n, k).
        """
        weighted = np.zeros((len(self.residual), rows.shape[1]))
        weighted[: len(rows)] = rows * np.sqrt(self.weights())[: len(rows), None]
        return weighted


def linearise(
    problem: Problem, state: State, jacobian: np.ndarray | None = None
) -> tuple[Linear, State]:
    """Return residuals and Jacobian at a state, and the state with its contact arcs brought up to
    date.

    jacobian: that of a state nearby, taken as it is, which saves nine tenths of the work.
    """
    perturbed = Perturbed(state.vector[None])
    if jacobian is None:
        perturbed = perturb(problem, state.vector)
    parts, arcs_mm = _parts(problem, state, perturbed)
    residual = np.concatenate([part[0] for part in parts])
    if jacobian is None:
        jacobian = np.concatenate([part[1] for part in parts])
    is_point = np.arange(len(residual)) < problem.contact_rows.start
    return Linear(residual, jacobian, is_point), replace(state, arcs_mm=arcs_mm)


def residuals(problem: Problem, state: State) -> np.ndarray:
    """Return the residuals (n,) over their sigma alone: a tenth of the work of `linearise`."""
    parts, _ = _parts(problem, state, Perturbed(state.vector[None]))
    return np.concatenate([part[0] for part in parts])


def _parts(problem: Problem, state: State, perturbed: Perturbed) -> tuple[list[Part], np.ndarray]:
    """Return residuals and Jacobian rows of all observations, and the contact arcs (f,), mm.

    The rows are empty of derivatives where no copy of the vector is moved.
    """
    curves, arcs_mm = curves_of(problem, perturbed.vectors, state.arcs_mm)
    parts = _point_parts(problem, curves, perturbed)
    parts.append(_contact_part(problem, curves, arcs_mm, perturbed))
    parts.append(_prior_part(problem, state.vector))
    if problem.onset is not None:
        parts.append(_onset_part(problem, problem.onset, perturbed))
    return parts, arcs_mm[0]


def _point_parts(problem: Problem, curves: Curves, perturbed: Perturbed) -> list[Part]:
    """Return residuals and Jacobian rows of all line points, by camera and rod."""
    touched = object_rows(problem)
    parts = []
    for (camera, on_wire), group in groupby(problem.seen, key=_camera_and_rod):
        seen = CameraPoints.joined(camera, list(group))
        if on_wire:
            parts.append(_wire_part(problem, seen, curves, perturbed))
        else:
            parts.append(touched.part(seen, bool(perturbed.moves), perturbed.vector))
    return parts


def _camera_and_rod(seen: Observed) -> tuple[int, bool]:
    """Return the camera of an observation and whether it is of the wire: those alike are predicted
    together.
    """
    return seen.camera, seen.on_wire


def _wire_part(problem: Problem, seen: CameraPoints, curves: Curves, perturbed: Perturbed) -> Part:
    """Return residuals and Jacobian rows of one camera's points of the wire, all frames."""
    points = seen.points
    positions = curves.at_one_each(seen.frame, points.place)  # (copies, n, 3) mm
    camera = problem.cameras.cameras[seen.camera]
    px, by_point, _ = camera.project_with_jacobians(positions[0])
    along_normal = np.einsum("ni,nij->nj", points.normal, by_point)
    change_px = np.einsum("cnj,nj->cn", positions[1:] - positions[0], along_normal)
    jacobian = perturbed.jacobian(change_px, seen.frame)
    swing_rad = problem.motor_rad
    modes = wire_modes(problem.wire.length_mm, points.place, swing_rad[seen.frame], swing_rad)
    modes = np.hstack([modes, points.shared_px])
    offsets = problem.blocks.wire_offsets[seen.camera]
    return seen.over_sigma(px, jacobian, offsets, modes, perturbed.vector)


def _contact_part(
    problem: Problem, curves: Curves, arcs_mm: np.ndarray, perturbed: Perturbed
) -> Part:
    """Return residuals and Jacobian rows of touching frames: distance from axis to centreline is
    reach + its error.
    """
    vectors = perturbed.vectors
    axes = bar_axes(problem, vectors)
    distance, arc, _ = clearance(curves, axes, wire_of(problem, vectors, 2), arcs_mm)
    gap = (distance - reach_mm(problem, vectors, arc))[:, problem.touching]  # (copies, touching) mm
    reach = problem.blocks.reach.start
    jacobian = perturbed.jacobian(gap[1:] - gap[0], np.flatnonzero(problem.touching))
    jacobian[:, reach] = -1.0
    residual = gap[0] - perturbed.vector[reach]
    return residual / CONTACT_SIGMA_MM, jacobian / CONTACT_SIGMA_MM


def _onset_part(problem: Problem, onset: Onset, perturbed: Perturbed) -> Part:
    """Return residual and Jacobian row of the onset: the unbent whisker is then the reach away from
    the axis.
    """
    vectors = perturbed.vectors
    motor_rad = np.full(len(vectors), onset.motor_rad) + _later_rad(problem, vectors)
    curves = resting_curves(problem, vectors, motor_rad)
    axis = bar_axis(problem, vectors)
    distance, arc, _ = clearance(curves, axis, wire_of(problem, vectors, 1))
    gap = distance - reach_mm(problem, vectors, arc)  # (copies,) mm
    sigma_mm = onset.sigma_rad * arc[0]
    reach = problem.blocks.reach.start
    gradient = perturbed.shared_gradient(gap[1:] - gap[0])
    gradient[reach] = -1.0
    residual = gap[:1] - perturbed.vector[reach]
    return residual / sigma_mm, gradient[None] / sigma_mm


def _later_rad(problem: Problem, vector: np.ndarray) -> np.ndarray | float:
    """Return by how much (…) a bar that gives way is touched later than `Gives` states."""
    if problem.motion is None or not problem.motion.from_touch:
        return 0.0
    return np.radians(vector[..., problem.blocks.motion.start])


def _prior_part(problem: Problem, vector: np.ndarray) -> Part:
    """Return residuals and Jacobian rows of the parameters' priors."""
    sigma = problem.blocks.prior_sigma
    return vector / sigma, np.diag(1.0 / sigma)


def solve(
    problem: Problem, state: State, *, scales: Sequence[float] = _SCALES
) -> tuple[State, np.ndarray]:
    """Return the fit's state and its covariance (size, size) from noise and priors alone.

    Gauss-Newton with Cauchy weights that narrow as `scales` (in sigmas) say; it ends early once a
    step is negligible.
    """
    blocks = problem.blocks
    geometry = blocks.geometry
    near = _ALIKE * blocks.steps[geometry]
    near_jacobian = None
    for scale in scales:
        linear, state = linearise(problem, state, near_jacobian)
        step, jacobian = _step_of(blocks, linear, scale)
        state = replace(state, vector=state.vector + step)
        if scale == scales[-1] and np.linalg.norm(jacobian @ step) < _CONVERGED_SIGMA:
            break
        is_near = np.all(np.abs(step[geometry]) < near)
        near_jacobian = linear.jacobian if is_near else None
    else:
        jacobian = linearise(problem, state, near_jacobian)[0].weighted(scales[-1]).jacobian
    return state, np.linalg.inv(jacobian.T @ jacobian)


def _step_of(blocks: Blocks, linear: Linear, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Return Gauss–Newton's step (size,), within _LONGEST_RAD of bend, and the Jacobian that it was
    found with, robustly weighted.
    """
    weighted = linear.weighted(scale)
    step = least_squares(weighted.jacobian, -weighted.residual)
    most_bend_rad = np.max(np.abs(step[blocks.bends.slice]), initial=0.0)
    share = min(1.0, _LONGEST_RAD / max(most_bend_rad, 1e-9))
    return share * step, weighted.jacobian


def least_squares(matrix: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the solution (size,) of least squares for a matrix (n, size) and targets (n,).

    It is by Cholesky's factor of the normal equations, their columns scaled to one length, a fifth
    of the work of singular values; these do it where columns are too nearly dependent. Raises
    LinAlgError where a value is not finite.
    """
    normal = matrix.T @ matrix
    length = np.sqrt(np.diag(normal))
    with np.errstate(divide="ignore", invalid="ignore"):
        factor, failed = dpotrf(normal / np.outer(length, length))
    # NaN, of a fit that diverges or a column of zeros, is not determined either.
    is_determined = not failed and np.min(np.diag(factor)) >= _LEAST_INDEPENDENT
    if not is_determined:
        return np.linalg.lstsq(matrix, target, rcond=None)[0]
    scaled, _ = dpotrs(factor, matrix.T @ target / length)
    return scaled / length
