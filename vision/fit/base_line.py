"""The whisker's base on each frame of a free stroke, as a line in space: `calibration.place` learns
the rig from it.

Two fits to the line points of the frames before touch, away from the hub. The first gives the shape
at rest, of which only offset and slope count here. What is the same in all frames, so that no
average makes it smaller, are its nuisances: how far a whole traced line may be off, and how it may
wander along the wire. The second gives offset and slope of each frame by itself, in y and z, and how
errors that frames share (cameras, light that changes as the whisker turns) move them. In the hub's
frame, lengths in mm, slopes in mm at the tip.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vision.fit.blocks import REST_PRIOR_MM, WIRE_MODES_PX
from vision.fit.converged_fit import ConvergedFit
from vision.fit.problem import (
    WANDER_PX,
    Problem,
    columns_of_camera,
    point_rows,
    wandering,
)
from vision.geometry.base_lines import BaseLines
from vision.geometry.centreline import REST_POWERS, rotation_z
from vision.geometry.rotation import unit
from vision.geometry.rows import Rows
from vision.wire.points import Observed

# [columns] A layout, no threshold: offsets and slopes, y then z, among the rest shape's
# parameters.
_LINE = np.array([0, REST_POWERS, 1, REST_POWERS + 1])
# [mm] Nearer to the hub its shade and its edge are read as the wire's. By 10 or 22 base lines are
# as good. Study: tests/vision/fit/test_base_line.py.
_CLEAR_OF_HUB_MM = 15.0
# [mm] Prior sigmas of a whisker's sag and set: more is seen all the same, less looks like a line
# that wanders. Study: tests/vision/fit/test_base_line.py.
_STRAIGHT_MM = np.array([1.0, 0.4])
# [points] In a frame: twice the numbers that they give. Derived.
_FEWEST_POINTS = 8


# [columns] Of a camera's offsets, those that change with the motor angle (`wire_modes`). A layout, no
# threshold.
_DRIFTS = slice(2, len(WIRE_MODES_PX))
# [px] By which light moves a line in each of these shapes over a free stroke, beyond what the whole
# fit has it move by: as wide as the tail of their distribution. 68 in 100 of 82 path-traced views have less than 0.025, five
# more than 0.10 in offset and 0.15 in tilt. Without it two boards of 35 in the right place contradict
# the stroke, with it none does. Study: wire_scenes.py.
_DRIFT_PX = 0.05
# [parameters] Of the rest shape. A layout, no threshold.
_REST = 2 * REST_POWERS


@dataclass(frozen=True)
class _FreeRows(Rows):
    """Residuals of n line points in free frames, over their sigma.

    frame (n,). residual (n,) about a straight whisker; by_rest (n, 8), by_nuisance (n, m), by_shared (n, k): its
    derivatives by rest shape, nuisances, and errors of unit variance that frames share (light that
    changes as the whisker turns, cameras).
    """

    frame: np.ndarray
    residual: np.ndarray
    by_rest: np.ndarray
    by_nuisance: np.ndarray
    by_shared: np.ndarray


def base_lines(fit: ConvergedFit) -> BaseLines | None:
    """Return the whisker's base as a line in each frame before touch.

    None where fewer than two frames are free and well seen.
    """
    problem = fit.problem
    rows = _free_rows(fit)
    if rows is None:
        return None
    frames = np.flatnonzero(np.bincount(rows.frame) >= _FEWEST_POINTS)
    if len(frames) < 2:
        return None
    shape, covariance = _shape_at_rest(rows)
    motor_rad = problem.motor_rad[frames]
    length_mm = problem.wire.length_mm
    lines = []
    for frame, angle in zip(frames, motor_rad):
        own_line = _own_line(rows.select(rows.frame == frame), shape)
        lines.append(_in_space(own_line, angle, length_mm))
    in_common = _shared_covariance(covariance, float(motor_rad.mean()), length_mm)
    return _as_base_lines(motor_rad, lines, in_common)


def _as_base_lines(
    motor_rad: np.ndarray, lines: Sequence["_SpaceLine"], in_common: np.ndarray
) -> BaseLines:
    """Return the lines of all frames; in_common (6, 6): see `BaseLines.shared_covariance`."""
    return BaseLines(
        motor_rad=motor_rad,
        point_mm=np.array([line.point_mm for line in lines]),
        point_covariance=np.array([line.point_covariance for line in lines]),
        direction=np.array([line.direction for line in lines]),
        direction_covariance=np.array([line.direction_covariance for line in lines]),
        shared_covariance=in_common,
        point_by_shared=np.array([line.point_by_shared for line in lines]),
        direction_by_shared=np.array([line.direction_by_shared for line in lines]),
    )


def _free_rows(fit: ConvergedFit) -> _FreeRows | None:
    """Return the rows of the wire in all frames that do not bend; None where there are none."""
    found = []
    for seen, rows in point_rows(fit.problem):
        if seen.on_wire and not fit.problem.bent[seen.frame]:
            found.append(_rows_of(fit, seen, rows))
    return _FreeRows.join(found) if found else None


def _rows_of(fit: ConvergedFit, seen: Observed, rows: slice) -> _FreeRows:
    """Return the rows of one observation, without the offsets that the whole fit gave the line, and
    counted from a straight whisker in its place.
    """
    problem = fit.problem
    vector = fit.state.vector
    jacobian = fit.linear.jacobian[rows]
    clear = seen.points.place > _CLEAR_OF_HUB_MM
    offsets = problem.blocks.wire_offsets[seen.camera].slice
    rest = problem.blocks.rest_shape.slice
    by_rest = jacobian[:, rest]
    by_offsets = jacobian[:, offsets]
    residual = fit.linear.residual[rows]
    straight = residual - by_offsets @ vector[offsets] - by_rest @ vector[rest]
    nuisance = _nuisances(problem, seen) / seen.points.sigma_px[:, None]
    by_camera_error = fit.by_camera[rows] @ problem.cameras.by_error
    shared = np.hstack([_drifts(problem, seen.camera, by_offsets), by_camera_error])
    frame = np.full(len(clear), seen.frame)
    return _FreeRows(frame, straight, by_rest, nuisance, shared).select(clear)


def _nuisances(problem: Problem, seen: Observed) -> np.ndarray:
    """Return of each camera a shift of the whole line and interpolation weights along the wire, px:
    (n, cameras · (1 + knots))."""
    own = np.column_stack([np.ones(len(seen.points)), wandering(problem, seen)])
    return columns_of_camera(problem, seen.camera, own)


def _drifts(problem: Problem, camera: int, by_offsets: np.ndarray) -> np.ndarray:
    """Return of each camera what its lines drift by as the whisker turns, in sigmas of its points:
    (n, cameras · modes).

    by_offsets (n, offsets): derivatives of residuals by the camera's own offsets.
    """
    own = by_offsets[:, _DRIFTS] * drift_sigma_px(problem, camera)
    return columns_of_camera(problem, camera, own)


def drift_sigma_px(problem: Problem, camera: int) -> np.ndarray:
    """Return the sigmas (modes,) in px by which a camera's lines drift over a free stroke."""
    return np.hypot(problem.blocks.wire_offsets[camera].sigma[_DRIFTS], _DRIFT_PX)


def _shape_at_rest(rows: _FreeRows) -> tuple[np.ndarray, np.ndarray]:
    """Fit the rest shape (8,) with its covariance."""
    J = np.hstack([rows.by_rest, rows.by_nuisance])
    sigma_each_way = [*REST_PRIOR_MM[:2], *_STRAIGHT_MM]
    nuisance_sigma = np.full(rows.by_nuisance.shape[1], WANDER_PX)
    prior_sigma = np.concatenate([sigma_each_way, sigma_each_way, nuisance_sigma])  # y, z
    precision = np.diag(prior_sigma**-2.0)
    covariance = np.linalg.inv(J.T @ J + precision)
    solution = -covariance @ (J.T @ rows.residual)
    return solution[:_REST], covariance[:_REST, :_REST]


def _own_line(rows: _FreeRows, shape: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fit the offsets and slopes (4,) of one frame, with their covariance (4, 4) and how they change
    with each error that frames share, (4, k).
    """
    J = rows.by_rest[:, _LINE]
    residual = rows.residual + rows.by_rest @ shape
    covariance = np.linalg.inv(J.T @ J)
    gain = -covariance @ J.T
    return shape[_LINE] + gain @ residual, covariance, gain @ rows.by_shared


@dataclass(frozen=True, eq=False)
class _SpaceLine:
    """The base in one frame, in the rig frame: a row of `BaseLines`."""

    point_mm: np.ndarray
    point_covariance: np.ndarray
    point_by_shared: np.ndarray
    direction: np.ndarray
    direction_covariance: np.ndarray
    direction_by_shared: np.ndarray


def _in_space(
    own_line: tuple[np.ndarray, np.ndarray, np.ndarray], motor_rad: float, length_mm: float
) -> _SpaceLine:
    """Return a frame's line (see `_own_line`) in the rig frame.

    Its point is taken where offset and slope err independently of each other.
    """
    line, covariance, by_shared = own_line
    place = -np.trace(covariance[:2, 2:]) / np.trace(covariance[2:, 2:])  # in lengths
    R = rotation_z(motor_rad)
    along = R[:, 0]
    across = R[:, 1:]  # (3, 2): y and z of the hub
    identity = np.eye(2)
    point_by_line = across @ np.hstack([identity, place * identity])  # (3, 4)
    turn_by_line = across @ np.hstack([np.zeros((2, 2)), identity / length_mm])  # (3, 4)
    return _SpaceLine(
        point_mm=place * length_mm * along + point_by_line @ line,
        point_covariance=point_by_line @ covariance @ point_by_line.T,
        point_by_shared=point_by_line @ by_shared,
        direction=unit(along + turn_by_line @ line),
        direction_covariance=turn_by_line @ covariance @ turn_by_line.T,
        direction_by_shared=turn_by_line @ by_shared,
    )


def _shared_covariance(covariance: np.ndarray, motor_rad: float, length_mm: float) -> np.ndarray:
    """Return the covariance (6, 6) with which all lines turn and shift in common: w rad, v mm at
    the base.

    covariance (8, 8): of the rest shape. An offset shifts the base; a slope in y turns it about z,
    one in z about −y.
    """
    _, y, z = rotation_z(motor_rad).T  # of the hub, in the rig frame
    none = np.zeros(3)
    turns = np.column_stack([none, none, z, -y]) / length_mm
    shifts = np.column_stack([y, z, none, none])
    by_line = np.vstack([turns, shifts])  # (6, 4)
    return by_line @ covariance[np.ix_(_LINE, _LINE)] @ by_line.T
