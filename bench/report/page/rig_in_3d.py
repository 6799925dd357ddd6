"""The rig in 3-D as plain numbers, rig frame, mm: what scene.js draws. Lengths are rounded to a micrometre."""

import numpy as np

from bench.records.trial_result import BarLine, SeenWhisk
from bench.report.page.words import Row
from bench.report.run_facts import BoardFacts, CameraFacts, RunRecord

ELLIPSOID_FACTOR = 100  # ellipsoids of one sigma are drawn so much larger
_MOST_FRAMES = 24  # of a stroke
_BAR_HALF_MM = 60.0


def scene(record: RunRecord, rows: list[Row]) -> dict:
    """Cameras, board, and each whisk with a truth: bar, wire and contact frame by frame."""
    whisker = record.whisker
    return {
        "cameras": [_camera(camera) for camera in record.cameras],
        "board": None if record.board is None else _board(record.board),
        "whisker": {"length": whisker.length_mm, "radius": 0.5 * whisker.diameter_mm},
        "factor": ELLIPSOID_FACTOR,
        "whisks": [
            _whisk(row) for row in rows if row.seen.has_truth and row.seen.frames is not None
        ],
    }


def _camera(camera: CameraFacts) -> dict:
    """Centre, and the directions of the picture's four corners, unit vectors."""
    R, t = camera.T_camera_rig[:, :3], camera.T_camera_rig[:, 3]
    width, height = camera.size_px
    px = np.array([(0, 0), (width, 0), (width, height), (0, height)], dtype=float) - 0.5
    rays = np.column_stack([px, np.ones(4)]) @ np.linalg.inv(camera.matrix).T @ R
    return {
        "name": camera.name,
        "centre": _listed(-R.T @ t),
        "corners": _listed(rays / np.linalg.norm(rays, axis=1, keepdims=True), 5),
    }


def _board(board: BoardFacts) -> dict:
    """Origin and the two edges of one square."""
    T = board.T_rig_board
    return {
        "squares": list(board.squares),
        "origin": _listed(T[:, 3]),
        "x": _listed(board.square_mm * T[:, 0]),
        "y": _listed(board.square_mm * T[:, 1]),
    }


def _whisk(row: Row) -> dict:
    """motor: rad; points: contact where it touches, null before; axes: of the ellipsoid of one sigma at first touch."""
    seen, trial = row.seen, row.result.seen
    frames = seen.frames
    chosen = np.unique(np.linspace(0, len(frames.index) - 1, _MOST_FRAMES).round().astype(int))
    points = [_listed(frames.point_mm.value[k]) if frames.touching[k] else None for k in chosen]
    return {
        "key": row.key,
        "name": row.name,
        "bar": None if trial.bar is None else _bar(trial.bar, seen.point_mm.value),
        "radius": trial.bar_radius_mm,
        "touch": _listed(seen.point_mm.value),
        "axes": _listed(_ellipsoid(seen), 5),
        "motor": _listed(frames.motor_rad[chosen], 5),
        "theta": _listed(np.degrees(frames.theta_rad.value[chosen]), 3),
        "points": points,
        "slip": _listed(np.nan_to_num(frames.slip_mm.value[chosen])),
    }


def _ellipsoid(seen: SeenWhisk) -> np.ndarray:
    """Its three half-axes (3, 3), mm, a row each, along their own directions; along x, y, z where no covariance is
    known."""
    if seen.truth.point_covariance_mm2 is None:
        return np.diag(seen.point_mm.sigma)
    variances, directions = np.linalg.eigh(seen.truth.point_covariance_mm2)
    return np.sqrt(np.maximum(variances, 0.0))[:, None] * directions.T


def _bar(bar: BarLine, contact: np.ndarray) -> list:
    """Ends of the piece of its axis around the contact."""
    nearest = bar.point_mm + ((contact - bar.point_mm) @ bar.direction) * bar.direction
    return _listed([nearest - _BAR_HALF_MM * bar.direction, nearest + _BAR_HALF_MM * bar.direction])


def _listed(values, digits: int = 3) -> list:
    return np.round(np.asarray(values, dtype=float), digits).tolist()
