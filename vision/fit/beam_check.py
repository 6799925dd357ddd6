"""Is the wire bent as a beam with a point load? Its curve once more, the shape of the bend left
free.

The fit believes that all deflection is that of a clamped rod of the stated profile under one force.
Here, on the same line points with the same sigmas, the deflection of each frame may depart from the
beam's by a spline along the wire, in mm for each rad of the frame's bend. What gives way with the
load (a softer or tapering shaft, a joint, the clamp) departs so, the same in all frames and, in a
round rod, in both directions across: so one spline serves, and all frames determine it. At the base
it is zero and has any slope, which is the clamp's giving way. What lines of free and of touching
frames show alike is no bend: each camera's lines may wander along the wire.

The departure is small, so one linear step from the fit's solution does. Where the beam is right,
what the step moves has mean 0 and a covariance that follows from those of line points and cameras,
and its square over that covariance is a chi² (the test of Hausman, Econometrica 46, 1251, 1978).
"""

from dataclasses import dataclass

import numpy as np

from vision.fit.converged_fit import ConvergedFit
from vision.fit.covariance import FALSE_ALARM, MATTERS, chance_of
from vision.fit.problem import (
    WANDER_PX,
    Problem,
    columns_of_camera,
    wandering,
)
from vision.fit.reshaped import reshape
from vision.geometry.centreline import Curves, rotation_z

# [knots] Beside the one at the base: 20 mm apart on a wire of 100 mm. Set by eye. Study:
# broken_beams.py.
KNOTS = 5
# [mm/rad] Prior sigma of the departure: as much as the beam itself deflects at a contact 50 mm
# out, so that nothing is believed beforehand. Derived.
_DEPARTURE_MM_PER_RAD = 50.0
# [mm/rad] Of differences: far above rounding, far below what bends. Derived.
_STEP_MM_PER_RAD = 1e-4


@dataclass(frozen=True)
class Compared:
    """A quantity by the beam and by the spline, the sigma of their difference, and that stated for
    the beam's.
    """

    beam: float
    spline: float
    difference_sigma: float
    sigma: float

    @property
    def shift(self) -> float:
        """Return the difference in stated sigmas."""
        return (self.spline - self.beam) / self.sigma


@dataclass(frozen=True)
class BeamCheck:
    """Beam against spline in one whisk: d_x (mm), touch (rad), and slip (mm) at the largest pushing
    angle theta_rad.

    chance: by which a wire that bends as a beam departs from it so far; NaN where the fit is
    nowhere.
    """

    d_x: Compared
    touch: Compared
    slip: Compared
    theta_rad: float
    chance: float

    @property
    def alarm(self) -> str:
        """Return what is wrong, or '' where the curves differ by no more than chance, or the truth
        by less than what matters.
        """
        slip = f"slip at {np.degrees(self.theta_rad):.1f} deg"
        compared = [
            (self.d_x, "d_x", 1.0, "mm"),
            (self.touch, "touch", np.degrees(1.0), "deg"),
            (self.slip, slip, 1.0, "mm"),
        ]
        moved, what, scale, unit = max(compared, key=lambda row: abs(row[0].shift))
        if not (self.chance <= FALSE_ALARM and abs(moved.shift) >= MATTERS):
            return ""
        change = scale * (moved.spline - moved.beam)
        by = f"{change:+.4f} ± {scale * moved.difference_sigma:.4f} {unit}"
        return (
            "the wire does not bend as a beam with a point load "
            f"(chance {self.chance:.1g}): by a spline {what} is {by} from the beam's, "
            f"{abs(moved.shift):.1f} of its stated sigma; check the whisker's shape, its clamp, "
            "and its shaft for joints"
        )


def check_beam(fit: ConvergedFit, covariance: np.ndarray) -> BeamCheck:
    """Check the beam in a whisk that touches. covariance (size, size): of its parameters, as stated."""
    measured = fit.measured
    by = fit.by_parameter
    last = fit.last_frame
    departure, slip_by = _estimate_departure(fit)
    comparison = _Comparison(departure, covariance)
    touch = measured.whisk["touch"]
    return BeamCheck(
        d_x=comparison.of(measured.whisk["d_x"], by.whisk["d_x"], 0.0),
        touch=comparison.of(touch, by.whisk["touch"], 0.0),
        slip=comparison.of(measured.frame["slip"][last], by.frame["slip"][last], slip_by),
        theta_rad=float(fit.problem.motor_rad[last] - touch),
        chance=chance_of(departure.values, departure.covariance),
    )


@dataclass(frozen=True, eq=False)
class _LeastSquares:
    """The least-squares problem of n observations about a fit's solution, weighted.

    residual (n,). jacobian (n, p): by the fit's parameters, and by others that have priors alone;
    prior (m, p): rows of these priors. by_camera (n, c): by the cameras' parameters, with their
    covariance (c, c).
    """

    residual: np.ndarray
    jacobian: np.ndarray
    prior: np.ndarray
    by_camera: np.ndarray
    covariance: np.ndarray


@dataclass(frozen=True, eq=False)
class _Departure:
    """The departure from the beam.

    values (k,): mm/rad. covariance (k, k): where the beam is right. parameters_by (p, k):
    derivatives of the fit's parameters, which follow it.
    """

    values: np.ndarray
    covariance: np.ndarray
    parameters_by: np.ndarray


@dataclass(frozen=True, eq=False)
class _Comparison:
    """Beam and spline, as quantities are compared.

    covariance (size, size): of the fit's parameters, as it is stated.
    """

    departure: _Departure
    covariance: np.ndarray

    def of(self, value: float, gradient: np.ndarray, directly: np.ndarray | float) -> Compared:
        """Return a quantity by beam and by spline.

        gradient (size,): by the fit's parameters. directly (k,): derivatives by the departure, the
        parameters standing still.
        """
        departure = self.departure
        row = gradient @ departure.parameters_by[: len(gradient)] + directly
        difference_sigma = float(np.sqrt(row @ departure.covariance @ row))
        sigma = float(np.sqrt(gradient @ self.covariance @ gradient))
        beam = float(value)
        return Compared(beam, beam + float(row @ departure.values), difference_sigma, sigma)


def _estimate_departure(fit: ConvergedFit) -> tuple[_Departure, np.ndarray]:
    """Estimate the departure (k,) by one linear step from the fit.

    Returns with it the change (k,) of the slip in the last frame by the departure, the parameters
    standing still.
    """
    by_departure, slip_by = reshape(fit, _moves(fit), _STEP_MM_PER_RAD)
    return _fit_added(_wandering(fit), fit.linear.weigh(by_departure)), slip_by


def _wandering(fit: ConvergedFit) -> _LeastSquares:
    """Return the fit with lines that may wander."""
    wander = fit.linear.weigh(_wander_rows(fit.problem))
    jacobian = np.hstack([fit.weighted.jacobian, wander])
    return _LeastSquares(
        residual=fit.weighted.residual,
        jacobian=jacobian,
        prior=np.eye(jacobian.shape[1])[fit.problem.size :] / WANDER_PX,
        by_camera=fit.weighted_by_camera,
        covariance=fit.problem.cameras.covariance,
    )


def _fit_added(problem: _LeastSquares, rows: np.ndarray) -> _Departure:
    """Fit parameters (k,) with Jacobian `rows` (n, k) that are added to a fit that has converged.

    Their covariance is that by noise and cameras if the true parameters are 0.
    """
    own = problem.jacobian
    basis, triangle = np.linalg.qr(np.vstack([own, problem.prior]))
    basis = basis[: len(own)]
    explained = basis.T @ rows
    free = rows - basis @ explained
    information = rows.T @ free
    prior_information = np.eye(rows.shape[1]) / _DEPARTURE_MM_PER_RAD**2
    within = np.linalg.inv(information + prior_information)
    gain = within @ free.T
    by_cameras = gain @ problem.by_camera
    spread = by_cameras @ problem.covariance @ by_cameras.T
    return _Departure(
        values=-gain @ problem.residual,
        covariance=within @ information @ within + spread,
        parameters_by=-np.linalg.solve(triangle, explained),
    )


def _moves(fit: ConvergedFit) -> Curves:
    """Return how a unit of each departure moves the centrelines: points and tangents (k, f, m, 3)
    per mm/rad.
    """
    # Brings in all of scipy.optimize, which the reading of a session does without.
    from scipy.interpolate import CubicSpline

    problem = fit.problem
    arc_mm = fit.curves.arc_mm
    knots = np.linspace(0.0, problem.wire.length_mm, KNOTS + 1)
    spline = CubicSpline(knots, np.eye(KNOTS + 1)[:, 1:], bc_type="natural")
    bend = np.zeros((len(problem.motor_rad), 3))
    bend[:, 1:] = fit.bend_rad
    direction = np.einsum("fij,fj->fi", rotation_z(problem.motor_rad), bend)
    points = np.einsum("mk,fi->kfmi", spline(arc_mm, 0), direction)
    tangents = np.einsum("mk,fi->kfmi", spline(arc_mm, 1), direction)
    return Curves(arc_mm, points, tangents)


def _wander_rows(problem: Problem) -> np.ndarray:
    """Return derivatives (n, w) of the line points' residuals by each camera's wandering."""
    rows = []
    for seen in problem.seen:
        by_knot = columns_of_camera(problem, seen.camera, wandering(problem, seen))
        by_knot *= seen.on_wire
        rows.append(by_knot / seen.points.sigma_px[:, None])
    return np.concatenate(rows)
