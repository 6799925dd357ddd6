"""A fit that has converged: what it says, and how uncertain that is by points, priors and cameras."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.ndimage import correlate1d

from vision.fit.object_rows import object_rows
from vision.fit.problem import (
    Problem,
    State,
    bar_axes,
    bar_axis,
    bends,
    curves_of,
    point_rows,
    rest_shape,
    shifts_mm,
    wire_of,
)
from vision.fit.quantities import Jacobians, Measured, jacobians
from vision.fit.solve import Linear, linearise, residuals
from vision.geometry.camera import N_PARAMETERS
from vision.geometry.centreline import Curves
from vision.geometry.rods import Wire
from vision.geometry.touched import Axis
from vision.wire.points import Observed

# [rad] Step of differences of a frame's turn: the tip moves by 0.01 mm. Derived.
_STEP_TURN_RAD = 1e-4
# [points] Beyond, nothing is shared: at the highest correlation that `_MOST_ALIKE` allows, 7/9,
# 0.7 % is left. Derived.
_FARTHEST = 20


@dataclass(frozen=True, eq=False)
class ConvergedFit:
    """A problem and the state in which its fit has converged."""

    problem: Problem
    state: State

    @cached_property
    def curves(self) -> Curves:
        """Return the wire's centrelines in all frames."""
        return curves_of(self.problem, self.state.vector, self.state.arcs_mm)[0]

    @property
    def wire(self) -> Wire:
        """Return the whisker, with the taper that the fit has."""
        return wire_of(self.problem, self.state.vector, 0)

    @property
    def axis(self) -> Axis:
        """Return the object's axis, from which one that moves is counted."""
        return bar_axis(self.problem, self.state.vector)

    @property
    def rest_mm(self) -> np.ndarray:
        """Return the wire's rest shape (2, 4), mm."""
        return rest_shape(self.problem, self.state.vector)

    @property
    def bend_rad(self) -> np.ndarray:
        """Return the wire's bends (f, 2) in all frames, rad."""
        return bends(self.problem, self.state.vector)

    @property
    def axes(self) -> Axis:
        """Return the object's axis (f, 3) in each frame, (1, 3) where it stands."""
        return bar_axes(self.problem, self.state.vector)

    @property
    def shifts_mm(self) -> np.ndarray:
        """Return how far (f, 3) the object is from its axis in each frame, (1, 3) of 0 where it stands."""
        return shifts_mm(self.problem, self.state.vector)

    @cached_property
    def linear(self) -> Linear:
        """Return residuals and Jacobian of all observations."""
        return linearise(self.problem, self.state)[0]

    @cached_property
    def weighted(self) -> Linear:
        """Return residuals and Jacobian as the fit weighs them: times the roots of robust weights."""
        return self.linear.weighted()

    @cached_property
    def inverse_normal(self) -> np.ndarray:
        """Return (JᵀWJ)⁻¹, (size, size): the factor of JᵀW in the parameters' sensitivity to
        observations.
        """
        jacobian = self.weighted.jacobian
        return np.linalg.inv(jacobian.T @ jacobian)

    @cached_property
    def by_turn(self) -> np.ndarray:
        """Return derivatives (n,) of all residuals by the whisker's turn, beyond the motor's angle, in the
        frame that each is of.
        """
        problem = self.problem
        turned = replace(problem, motor_rad=problem.motor_rad + _STEP_TURN_RAD)
        return (residuals(turned, self.state) - self.linear.residual) / _STEP_TURN_RAD

    @cached_property
    def by_camera(self) -> np.ndarray:
        """Return derivatives (points, 15 cameras) of the line points' residuals by the cameras'
        parameters.
        """
        seen = self.problem.seen
        by_camera = [_by_camera(self.problem, one, self.state, self.curves) for one in seen]
        return np.concatenate(by_camera)

    @cached_property
    def weighted_by_camera(self) -> np.ndarray:
        """Return derivatives (n, 15 cameras) of `weighted` residuals by the cameras' parameters: 0 but
        for line points.
        """
        return self.linear.weigh(self.by_camera)

    @cached_property
    def parameters_by_camera(self) -> np.ndarray:
        """Return derivatives (size, 15 cameras) of the fit's parameters by the cameras'.

        They are -(JᵀWJ)⁻¹ JᵀW J_c. With the weights W of the fit itself, a move of all cameras
        together moves the whole scene and changes nothing within it.
        """
        return -self.inverse_normal @ (self.weighted.jacobian.T @ self.weighted_by_camera)

    @cached_property
    def by_camera_error(self) -> np.ndarray:
        """Return how the parameters change (size, k) with each unit error of the cameras
        (`Cameras.by_error`).
        """
        return self.parameters_by_camera @ self.problem.cameras.by_error

    @cached_property
    def noise_covariance(self) -> np.ndarray:
        """Return the covariance (size, size) of the parameters by the observations' and priors' own
        errors.

        Neighbouring line points of the wire have correlated errors. Their sigmas are as wide as is
        right for what changes slowly along the wire, and too wide for what does not, so that the
        errors are propagated with their correlation.
        """
        by_row = self.inverse_normal @ self.weighted.jacobian.T
        return times_residual_covariance(self.problem, by_row) @ by_row.T

    @property
    def camera_covariance(self) -> np.ndarray:
        """Return the covariance (size, size) of the parameters by the cameras' errors."""
        return self.by_camera_error @ self.by_camera_error.T

    @property
    def fit_covariance(self) -> np.ndarray:
        """Return the covariance (size, size) of the parameters by observations, priors and cameras."""
        return self.noise_covariance + self.camera_covariance

    def spread(self, rows: np.ndarray) -> np.ndarray:
        """Return the covariance (k, k) of rows (k, n) times the `weighted` residuals, by the errors of
        observations and cameras.
        """
        by_camera = rows @ self.weighted_by_camera
        by_noise = times_residual_covariance(self.problem, rows) @ rows.T
        return by_noise + by_camera @ self.problem.cameras.covariance @ by_camera.T

    @cached_property
    def _quantities(self) -> tuple[Measured, Jacobians]:
        """Return the values and derivatives of all that a user asks for."""
        return jacobians(self.problem, self.state)

    @property
    def measured(self) -> Measured:
        """Return the values of what a user asks for."""
        return self._quantities[0]

    @property
    def by_parameter(self) -> Jacobians:
        """Return the derivatives of what a user asks for by the fit's parameters."""
        return self._quantities[1]

    @property
    def last_frame(self) -> int:
        """Return the touching frame of the largest pushing angle."""
        return int(np.flatnonzero(self.problem.touching)[-1])


def times_residual_covariance(problem: Problem, rows: np.ndarray) -> np.ndarray:
    """Return rows (k, n) over all observations times the covariance (n, n) of their residuals.

    It is the unit matrix but for points of the wire: points i and j of a line have the correlation
    ρ^|i − j|, scaled so that the variance of a line's mean is that of independent points.
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


def _by_camera(problem: Problem, seen: Observed, state: State, curves: Curves) -> np.ndarray:
    """Return derivatives (n, 15 cameras) of one observation's residuals by the cameras' parameters.

    A line point may show several points in space (both edges of a bar): each derivative is their
    mean. The points in space are held: one that moves along its sight moves nothing in the picture.
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
