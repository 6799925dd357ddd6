"""What lines, contacts and slip of a whisk are moved by where its centrelines are other curves than the fit's.

moves: `Curves` whose points and tangents (k, f, m, 3) are what each of k changes adds to those of the f frames.
"""

from dataclasses import replace

import numpy as np

from vision.fit.problem import CONTACT_SIGMA_MM, Problem, State, bar_axes
from vision.geometry.centreline import Curves
from vision.geometry.contact import bar_at, clearance
from vision.wire.points import Observed


def by_lines(problem: Problem, curves: Curves, moves: Curves) -> np.ndarray:
    """Change (n, k) of the line points' residuals; the bar's do not change."""
    nothing = np.zeros(len(moves.points_mm))
    return np.concatenate(
        [
            _across_line(problem, seen, curves, moves) / seen.points.sigma_px[:, None]
            if seen.frame >= 0
            else np.broadcast_to(nothing, (len(seen.points), len(nothing)))
            for seen in problem.seen
        ]
    )


def _across_line(problem: Problem, seen: Observed, curves: Curves, moves: Curves) -> np.ndarray:
    """How far (n, k) each change moves the line across itself in the picture, px."""
    place, frame = seen.points.place, seen.frame
    points, _ = Curves(curves.arc_mm, curves.points_mm[frame], curves.tangents[frame]).at(place)
    moved, _ = Curves(curves.arc_mm, moves.points_mm[:, frame], moves.tangents[:, frame]).at(place)
    _, by_point, _ = problem.cameras.cameras[seen.camera].project_with_jacobians(points)
    return np.einsum("ni,nij,knj->nk", seen.points.normal, by_point, moved)


def by_contacts(
    problem: Problem, state: State, curves: Curves, moves: Curves, frame: int, step: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Change of the touching frames' residuals (t, k), and of the slip in one frame (k,), the parameters standing
    still; by differences over `step` of each change."""
    axis = bar_axes(problem, state.vector)
    points, tangents = (
        np.concatenate([still[None], still + step * moved])
        for still, moved in ((curves.points_mm, moves.points_mm), (curves.tangents, moves.tangents))
    )
    point, direction = (
        np.broadcast_to(part, (*points.shape[:2], 3)) for part in (axis.point_mm, axis.direction)
    )
    wide = replace(axis, point_mm=point, direction=direction)
    distance, _, contact = clearance(Curves(curves.arc_mm, points, tangents), wide)
    by_change = (distance[1:] - distance[0]) / step / CONTACT_SIGMA_MM
    along = bar_at(axis, contact[0, frame]).direction[0]
    slip = (contact[1:, frame] - contact[0, frame]) @ along / step
    return by_change[:, problem.touching].T, slip
