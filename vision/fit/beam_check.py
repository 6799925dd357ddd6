"""Is the wire bent as a beam with a point load? Its curve once more, the shape of the bend left free.

The fit believes that all deflection is that of a clamped rod of the stated profile under one force. Here, on the same
line points with the same sigmas, the deflection of each frame may depart from the beam's by a spline along the wire, in
mm for each rad of the frame's bend. What gives way with the load (a softer or tapering shaft, a joint, the clamp)
departs so, the same in all frames and, in a round rod, in both directions across: so one spline serves, and all frames
tell it. At the base it is zero and has any slope, which is the clamp's giving way. What lines of free and of touching
frames show alike is no bend: each camera's lines may wander along the wire.

The departure is small, so one linear step from the fit's solution does. Where the beam is right, what the step moves
has mean 0 and a covariance that follows from those of line points and cameras, and its square over that covariance is
a chi² (the test of Hausman, Econometrica 46, 1251, 1978).
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from vision.fit.covariance import camera_rows
from vision.fit.problem import WANDER_PX, Problem, State, bends, curves_of, wandering
from vision.fit.quantities import Jacobians, Measured
from vision.fit.reshaped import by_contacts, by_lines
from vision.fit.solve import LAST_SCALE, linear_at, robust_weights
from vision.geometry.centreline import Curves, rotation_z

# [chance] By which a wire that is a beam departs from it so far, a whisk. Study: chosen.
FALSE_ALARM = 1e-3
# [sigma] A shift of so many stated sigmas matters: less adds no more than an eighth to an error,
# √(1 + 0.5²). Derived.
_MATTERS = 0.5
# [knots] Beside the one at the base: 20 mm apart on a wire of 100 mm. Set by eye. Study:
# broken_beams.py.
KNOTS = 5
# [mm/rad] Prior sigma of the departure: as much as the beam itself deflects at a contact 50 mm
# out, so that nothing is believed beforehand. Derived.
_DEPARTURE_MM_PER_RAD = 50.0
# [mm/rad] Of differences: far above rounding, far below what bends. Derived.
_STEP_MM_PER_RAD = 1e-4
_NAMES = ("d_x", "touch", "slip")


@dataclass(frozen=True)
class Compared:
    """A quantity by the beam and by the spline, the sigma of their difference, and that stated for the beam's."""

    beam: float
    spline: float
    difference_sigma: float
    sigma: float

    @property
    def shift(self) -> float:
        """The difference in stated sigmas."""
        return (self.spline - self.beam) / self.sigma


@dataclass(frozen=True)
class BeamCheck:
    """Beam against spline in one whisk: d_x (mm), touch (rad), slip (mm) at the largest pushing angle theta_rad.

    chance: by which a wire that bends as a beam departs from it so far; NaN where the fit is nowhere.
    """

    d_x: Compared
    touch: Compared
    slip: Compared
    theta_rad: float
    chance: float

    @property
    def alarm(self) -> str:
        """What is wrong, or '': the curves differ by more than chance, and the truth with them by what matters."""
        worst = max(_NAMES, key=lambda name: abs(getattr(self, name).shift))
        if not (self.chance <= FALSE_ALARM and abs(getattr(self, worst).shift) >= _MATTERS):
            return ""
        moved: Compared = getattr(self, worst)
        scale, unit = (np.degrees(1.0), "deg") if worst == "touch" else (1.0, "mm")
        what = f"slip at {np.degrees(self.theta_rad):.1f} deg" if worst == "slip" else worst
        by = f"{scale * (moved.spline - moved.beam):+.4f} ± {scale * moved.difference_sigma:.4f} {unit}"
        return (
            f"the wire does not bend as a beam with a point load (chance {self.chance:.1g}): by a spline {what} is "
            f"{by} from the beam's, {abs(moved.shift):.1f} of its stated sigma; check the whisker's shape, its clamp, "
            "and its shaft for joints"
        )


def check_beam(
    problem: Problem, state: State, covariance: np.ndarray, measured: Measured, by: Jacobians
) -> BeamCheck:
    """The check of a whisk that touches. covariance (size, size): of the parameters, by the fit and by the cameras."""
    last = np.flatnonzero(problem.touching)[-1]
    departure, spread, follows, slip_by = _departure(problem, state, last)
    gradients = {"d_x": by.whisk["d_x"], "touch": by.whisk["touch"], "slip": by.frame["slip"][last]}
    values = {
        "d_x": measured.whisk["d_x"],
        "touch": measured.whisk["touch"],
        "slip": measured.frame["slip"][last],
    }
    found = {}
    for name, gradient in gradients.items():
        row = gradient @ follows + (slip_by if name == "slip" else 0.0)
        sigma, beam = np.sqrt(gradient @ covariance @ gradient), float(values[name])
        found[name] = Compared(
            beam, beam + float(row @ departure), float(np.sqrt(row @ spread @ row)), float(sigma)
        )
    theta = float(problem.motor_rad[last] - measured.whisk["touch"])
    return BeamCheck(**found, theta_rad=theta, chance=_chance(departure, spread))


def _chance(departure, spread) -> float:
    """Of a departure so far from none; 1 where the lines do not tell it, NaN where the fit is nowhere."""
    if not np.all(np.isfinite(spread)):
        return float("nan")
    square = departure @ np.linalg.pinv(spread, hermitian=True) @ departure
    return float(chdtrc(len(departure), square))


def _departure(problem: Problem, state: State, frame: int):
    """Departure (k,), its covariance (k, k) where the beam is right, what the parameters follow it by (size, k), and
    the slip in a frame (k,), the parameters standing still."""
    linear = linear_at(problem, state)
    root = np.sqrt(robust_weights(linear, LAST_SCALE))[:, None]
    curves, _ = curves_of(problem, state.vector, state.arcs_mm)
    moves = _moves(problem, state, curves)
    on_bar, slip_by = by_contacts(problem, state, curves, moves, frame, _STEP_MM_PER_RAD)

    def fill(*parts: np.ndarray) -> np.ndarray:
        return _filled(len(root), *parts) * root

    own = np.hstack([linear.jacobian * root, fill(_wander_rows(problem))])
    prior = np.eye(own.shape[1])[problem.size :] / WANDER_PX
    rows, cameras = (
        fill(by_lines(problem, curves, moves), on_bar),
        fill(camera_rows(problem, state)),
    )
    residual, of_cameras = linear.residual * root[:, 0], problem.cameras.covariance
    departure, spread, follows = _beside(own, prior, rows, residual, cameras, of_cameras)
    return departure, spread, follows[: problem.size], slip_by


def _filled(count: int, *parts: np.ndarray) -> np.ndarray:
    """The parts' rows, and zeros below to so many."""
    made = np.zeros((count, parts[0].shape[1]))
    made[: sum(map(len, parts))] = np.concatenate(parts)
    return made


def _beside(own, prior, rows, residual, cameras, covariance):
    """What parameters (k,) with Jacobian `rows` (n, k) add to a least-squares problem, solved with Jacobian `own`
    (n, p) and the rows of `prior` (m, p), whose residuals are 0: their values, their covariance where they are none, by
    noise and by cameras, and what the p follow them by (p, k)."""
    basis, triangle = np.linalg.qr(np.vstack([own, prior]))
    taken = basis[: len(own)].T @ rows
    free = rows - basis[: len(own)] @ taken
    information = rows.T @ free
    within = np.linalg.inv(information + np.eye(rows.shape[1]) / _DEPARTURE_MM_PER_RAD**2)
    by_cameras = within @ free.T @ cameras
    spread = within @ information @ within + by_cameras @ covariance @ by_cameras.T
    return -within @ (free.T @ residual), spread, -np.linalg.solve(triangle, taken)


def _moves(problem: Problem, state: State, curves: Curves) -> Curves:
    """What a unit of each departure moves the centrelines by: points and tangents (k, f, m, 3) per mm/rad."""
    from scipy.interpolate import (
        CubicSpline,
    )  # with all of scipy.optimize: a look at a session does without

    knots = np.linspace(0.0, problem.wire.length_mm, KNOTS + 1)
    spline = CubicSpline(knots, np.eye(KNOTS + 1)[:, 1:], bc_type="natural")
    bent = np.concatenate(
        [np.zeros((len(problem.motor_rad), 1)), bends(problem, state.vector)], axis=1
    )
    way = np.einsum("fij,fj->fi", rotation_z(problem.motor_rad), bent)
    points, tangents = (
        np.einsum("mk,fi->kfmi", spline(curves.arc_mm, order), way) for order in (0, 1)
    )
    return Curves(curves.arc_mm, points, tangents)


def _wander_rows(problem: Problem) -> np.ndarray:
    """Derivatives (n, w) of the line points' residuals by each camera's wandering."""
    return np.concatenate(
        [
            np.kron(np.arange(len(problem.cameras)) == seen.camera, wandering(problem, seen))
            * (seen.frame >= 0)
            / seen.points.sigma_px[:, None]
            for seen in problem.seen
        ]
    )
