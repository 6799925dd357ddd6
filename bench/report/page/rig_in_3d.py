"""The rig in 3-D as plain numbers, rig frame, mm: what scene.js draws. Lengths are rounded to a micrometre."""

import numpy as np

from bench.records.trial_result import SeenWhisk
from bench.report.page.words import WhiskRow
from bench.report.run_facts import BoardFacts, CameraFacts, RunRecord
from vision.geometry import spread

ELLIPSOID_FACTOR = 100  # ellipsoids of one sigma are drawn so much larger
# [frames] A layout: most of a stroke that the slider of the page goes through.
_MOST_FRAMES = 24
# [mm] A layout: half of the piece of the bar that is drawn.
_BAR_HALF_MM = 60.0


def scene(record: RunRecord, rows: list[WhiskRow]) -> dict:
    """Return cameras, board, and each whisk with a truth: bar, wire and contact frame by frame."""
    whisker = record.whisker
    whisks = [row for row in rows if row.seen.has_truth and row.seen.frames is not None]
    return {
        "cameras": [_camera(camera) for camera in record.cameras],
        "board": None if record.board is None else _board(record.board),
        "whisker": {"length": whisker.length_mm, "radius": 0.5 * whisker.diameter_mm},
        "factor": ELLIPSOID_FACTOR,
        "whisks": [_whisk(row) for row in whisks],
    }


def _camera(camera: CameraFacts) -> dict:
    """Return a camera's centre, and the directions of the picture's four corners, unit vectors."""
    R = camera.T_camera_rig[:, :3]
    t = camera.T_camera_rig[:, 3]
    width, height = camera.size_px
    corners_px = np.array([(0, 0), (width, 0), (width, height), (0, height)]) - 0.5
    homogeneous = np.column_stack([corners_px, np.ones(4)])
    rays = homogeneous @ np.linalg.inv(camera.matrix).T @ R
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return {"name": camera.name, "centre": _rounded(-R.T @ t), "corners": _rounded(rays, 5)}


def _board(board: BoardFacts) -> dict:
    """Return the board's origin and the two edges of one square."""
    T = board.T_rig_board
    return {
        "squares": list(board.squares),
        "origin": _rounded(T[:, 3]),
        "x": _rounded(board.square_mm * T[:, 0]),
        "y": _rounded(board.square_mm * T[:, 1]),
    }


def _whisk(row: WhiskRow) -> dict:
    """Return one whisk.

    motor: rad. points: the contact where it touches, null before. axes: of the ellipsoid of one
    sigma at first touch.
    """
    seen = row.seen
    trial = row.result.seen
    frames = seen.frames
    chosen = spread(range(len(frames.index)), _MOST_FRAMES)
    points = []
    for k in chosen:
        points.append(_rounded(frames.point_mm.value[k]) if frames.touching[k] else None)
    bar = None
    if trial.bar is not None:
        bar = _rounded(trial.bar.segment(seen.point_mm.value, _BAR_HALF_MM))
    return {
        "key": row.key,
        "name": row.name,
        "bar": bar,
        "radius": trial.bar_radius_mm,
        "touch": _rounded(seen.point_mm.value),
        "axes": _rounded(_ellipsoid(seen), 5),
        "motor": _rounded(frames.motor_rad[chosen], 5),
        "theta": _rounded(np.degrees(frames.theta_rad.value[chosen]), 3),
        "points": points,
        "slip": _rounded(np.nan_to_num(frames.slip_mm.value[chosen])),
    }


def _ellipsoid(seen: SeenWhisk) -> np.ndarray:
    """Return the half-axes (3, 3) of the contact's ellipsoid of one sigma, mm, a row each.

    Where no covariance is known they are along x, y, z.
    """
    if seen.truth.point_covariance_mm2 is None:
        return np.diag(seen.point_mm.sigma)
    variances, directions = np.linalg.eigh(seen.truth.point_covariance_mm2)
    return np.sqrt(np.maximum(variances, 0.0))[:, None] * directions.T


def _rounded(values, digits: int = 3) -> list:
    """Return numbers as nested lists, rounded."""
    return np.round(np.asarray(values, dtype=float), digits).tolist()
