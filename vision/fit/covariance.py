"""How uncertain a fit is, and by which causes: line points, touching, givens, priors, cameras, the rig's place."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.ndimage import correlate1d

from vision.fit.problem import BAR, REST, Problem, State, bar_axis, curves_of, point_rows, shifts_mm
from vision.fit.solve import LAST_SCALE, linear_at, robust_weights, weighted_jacobian
from vision.geometry.camera import N_PARAMETERS
from vision.geometry.centreline import Curves
from vision.geometry.grazing import sights_beside
from vision.geometry.silhouette import grazed
from vision.wire.points import Observed

# [points] Beyond, nothing is shared: at the highest correlation that `_MOST_ALIKE` allows, 7/9,
# 0.7 % is left. Derived.
_FARTHEST = 20
CAUSES = ("wire", "bar", "touch", "diameters", "light", "priors", "cameras", "placement")


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Of the fit's parameters, (size, size) each. answer: (JᵀWJ)⁻¹, by which they answer what observations tell; noise,
    lens: covariances, by the observations' and priors' own errors and by the cameras'."""

    answer: np.ndarray
    noise: np.ndarray
    lens: np.ndarray

    @property
    def covariance(self) -> np.ndarray:
        """All of it."""
        return self.noise + self.lens


def uncertainty(problem: Problem, state: State, answer: np.ndarray) -> Uncertainty:
    """What a fit is uncertain by. answer (size, size): what `solve` returns.

    Neighbouring line points of the wire err alike: their sigmas are as wide as is right for what changes slowly along
    the wire, and too wide for what does not, so that their errors are propagated as they are.
    """
    by_row = answer @ weighted_jacobian(problem, state).T
    by_camera = by_lens(problem, state, answer)
    return Uncertainty(
        answer,
        by_row @ alike(problem, by_row).T,
        by_camera @ problem.cameras.covariance @ by_camera.T,
    )


def alike(problem: Problem, rows: np.ndarray) -> np.ndarray:
    """Rows (k, n) of all observations times the covariance of their residuals: 1, but that a point of the wire shares a
    part of its error with the next one, of that part as much with the one after, and so on, and has a sigma wider by as
    much as all that makes a mean of them."""
    found = rows.copy()
    for seen, mine in point_rows(problem):
        if seen.frame >= 0 and problem.alike:
            shared = problem.alike[seen.camera] ** np.abs(np.arange(-_FARTHEST, _FARTHEST + 1))
            found[:, mine] = correlate1d(
                rows[:, mine], shared / shared.sum(), axis=1, mode="constant"
            )
    return found


def by_lens(problem: Problem, state: State, answer: np.ndarray) -> np.ndarray:
    """Derivatives (size, 15 cameras) of the fit's parameters by the cameras'.

    They answer a change of the cameras by -(JᵀWJ)⁻¹ JᵀW J_c: those residuals are what the fit sees, and with W as in
    the fit a move of all cameras together moves the whole scene and nothing in it.
    """
    linear = linear_at(problem, state)
    weights = robust_weights(linear, LAST_SCALE)[linear.is_point, None]
    return -answer @ (linear.jacobian[linear.is_point].T @ (weights * camera_rows(problem, state)))


def variance_by_cause(
    problem: Problem, state: State, fitted: Uncertainty, gradient: np.ndarray
) -> dict[str, float]:
    """What each cause adds to the variance of a quantity with this gradient (size,); the parts add up to it.

    wire, bar: scatter of their line points; touch: roundness of bar and wire; diameters: their sigmas; light: lines
    off as a whole; priors: those of rest shape and bend; cameras: lenses, and poses towards the rig board;
    placement: where the rig frame is, by rig board and free strokes (NaN where the cameras do not tell it apart: it is
    in `cameras` then). What the fit answers to an error is its row times what a parameter answers to rows, so that each
    observation's part is its own. The placement errs apart from corners and lenses, so that there are no cross-terms.
    """
    weighed = weighted_jacobian(problem, state)
    by_row = weighed @ (fitted.answer @ gradient)
    parts = by_row * alike(problem, by_row[None])[0]
    on_wire = np.concatenate([np.full(len(seen.points), seen.frame >= 0) for seen in problem.seen])
    touch = len(on_wire) + int(np.sum(problem.touching))
    reach = touch + BAR + REST
    light = slice(reach + 1, touch + problem.bar_moves.start)
    causes = {
        "wire": parts[: len(on_wire)][on_wire],
        "bar": parts[: len(on_wire)][~on_wire],
        "touch": parts[len(on_wire) : touch],
        "diameters": parts[reach],
        "light": parts[light],
        "priors": [parts[touch:reach].sum(), parts[touch + problem.bar_moves.start :].sum()],
    }
    whole = float(gradient @ fitted.lens @ gradient)
    placement = _by_placement(problem, state, fitted.answer, gradient)
    own = (
        whole if np.isnan(placement) else max(whole - placement, 0.0)
    )  # rounding may leave less than nothing
    parts = {name: float(np.sum(part)) for name, part in causes.items()}
    return parts | {"cameras": own, "placement": placement}


def _by_placement(problem: Problem, state: State, answer, gradient) -> float:
    """Variance that the rig frame's placement adds to a quantity; NaN where the cameras do not tell it apart."""
    cameras = problem.cameras
    if cameras.placement is None:
        return float("nan")
    by = gradient @ by_lens(problem, state, answer) @ cameras.by_placement
    return float(by @ cameras.placement @ by)


@lru_cache(maxsize=1)
def camera_rows(problem: Problem, state: State) -> np.ndarray:
    """Derivatives (n, 15 cameras) of the line points' residuals by the cameras' parameters."""
    curves, _ = curves_of(problem, state.vector, state.arcs_mm)
    return np.concatenate(
        [_by_cameras(problem, seen, _on_rod(problem, seen, state, curves)) for seen in problem.seen]
    )


def _by_cameras(problem: Problem, seen: Observed, on_rod_mm: Sequence[np.ndarray]) -> np.ndarray:
    """Derivatives (n, 15 cameras) of one camera's residuals by the cameras' parameters: means over its points (n, 3).

    Sights graze a rod's edge, so that what moves the point where they do so does not move the edge.
    """
    points, camera = seen.points, problem.cameras.cameras[seen.camera]
    by_camera = np.mean([camera.project_with_jacobians(one)[2] for one in on_rod_mm], axis=0)
    rows = np.zeros((len(points), N_PARAMETERS * len(problem.cameras)))
    first = N_PARAMETERS * seen.camera
    rows[:, first : first + N_PARAMETERS] = (
        np.einsum("ni,nij->nj", points.normal, by_camera) / points.sigma_px[:, None]
    )
    return rows


def _on_rod(problem: Problem, seen: Observed, state: State, curves: Curves) -> list[np.ndarray]:
    """Points (n, 3) that line points are pictures of: of the wire's axis, of the bar's edge, or of both its edges."""
    if seen.frame >= 0:
        one = Curves(curves.arc_mm, curves.points_mm[seen.frame], curves.tangents[seen.frame])
        return [one.at(seen.points.place)[0]]
    axis, camera = bar_axis(problem, state.vector), problem.cameras.cameras[seen.camera]
    if problem.is_rounded:
        grazing = sights_beside(camera, axis, seen.points.px, seen.points.place)
        return [grazing.points_mm]
    points = axis.point_mm + seen.points.place[:, None] * axis.direction
    points = points + shifts_mm(problem, state.vector)[seen.bar_in]
    edges = grazed(
        camera, points, np.broadcast_to(axis.direction, points.shape), problem.rods.bar.radius_mm
    )
    beside = [
        np.sum((camera.project(edge) - camera.project(points)) * seen.points.normal)
        for edge in edges
    ]
    return [edges[int(np.argmax(seen.side * np.array(beside)))]] if seen.side else list(edges)
