"""How lines, contacts and slip of a whisk change where its centrelines are other curves than the
fit's.

moves: `Curves` whose points and tangents (k, f, m, 3) are the changes, by each of k causes, of
those of the f frames.
"""

import numpy as np

from vision.fit.converged_fit import ConvergedFit
from vision.fit.problem import CONTACT_SIGMA_MM, Problem
from vision.geometry.centreline import Curves
from vision.geometry.contact import clearance
from vision.wire.points import Observed


def reshape(fit: ConvergedFit, moves: Curves, step: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the change (n, k) of the residuals of line points and touching frames, and of the slip in
    the last frame (k,).

    The parameters stay as they are; contacts by differences over `step` of each change.
    """
    on_contacts, slip = _by_contacts(fit, moves, step)
    return np.concatenate([_by_lines(fit.problem, fit.curves, moves), on_contacts]), slip


def _by_lines(problem: Problem, curves: Curves, moves: Curves) -> np.ndarray:
    """Return the change (n, k) of the line points' residuals; the bar's do not change."""
    rows = []
    for seen in problem.seen:
        if seen.on_wire:
            moved_px = _across_line(problem, seen, curves, moves)
            rows.append(moved_px / seen.points.sigma_px[:, None])
        else:
            rows.append(np.zeros((len(seen.points), len(moves.points_mm))))
    return np.concatenate(rows)


def _across_line(problem: Problem, seen: Observed, curves: Curves, moves: Curves) -> np.ndarray:
    """Return how far (n, k) each change moves the line across itself in the picture, px."""
    place_mm = seen.points.place
    points_mm, _ = curves.one(seen.frame).at(place_mm)
    in_frame = Curves(curves.arc_mm, moves.points_mm[:, seen.frame], moves.tangents[:, seen.frame])
    moves_mm, _ = in_frame.at(place_mm)  # (k, n, 3)
    camera = problem.cameras.cameras[seen.camera]
    _, by_point, _ = camera.project_with_jacobians(points_mm)  # (n, 2, 3)
    return np.einsum("ni,nij,knj->nk", seen.points.normal, by_point, moves_mm)


def _by_contacts(fit: ConvergedFit, moves: Curves, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the change of the touching frames' residuals (t, k), and of the slip in the last frame
    (k,).
    """
    curves = fit.curves
    frame = fit.last_frame
    points = _with_moves(curves.points_mm, step * moves.points_mm)
    tangents = _with_moves(curves.tangents, step * moves.tangents)
    axis = fit.axes
    moved = Curves(curves.arc_mm, points, tangents)
    distance, _, contact = clearance(moved, axis, fit.wire)
    by_change = (distance[1:] - distance[0]) / step / CONTACT_SIGMA_MM
    along = axis.bar_at(contact[0, frame]).direction[0]
    slip = (contact[1:, frame] - contact[0, frame]) @ along / step
    return by_change[:, fit.problem.touching].T, slip


def _with_moves(values: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Return an array (…) as it is and with each of k changes (k, …) added: (k + 1, …)."""
    return np.concatenate([values[None], values + moves])
