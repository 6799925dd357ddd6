"""Cameras calibrated elsewhere: the TOML that caliscope and aniposelib write.

Both keep OpenCV's lens and T_camera_world; caliscope in metres, with the rotation as a matrix or as a vector;
aniposelib in the unit of its board, with the rotation as a vector. Neither states what it is sure of, so the lenses
are taken as exact; their world is not the rig, where a picture of the board on the rig places them (`place_on_rig`).
"""

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from vision.boards.corners import Corners
from vision.boards.sufficiency import check_lens, check_rig_view
from vision.calibration.bundle import N_CAMERA, BundleState
from vision.calibration.calibrate import as_cameras
from vision.calibration.corner_noise import settle
from vision.calibration.first_guess import board_pose
from vision.calibration.layout import gather
from vision.calibration.tied import lens_priors
from vision.geometry.board import Board
from vision.geometry.camera import Camera, Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rotation import compose, exp_rotation, invert_transform

_NEEDED = ("size", "matrix", "distortions", "rotation", "translation")


def import_cameras(path: Path | str, *, unit_mm: float | None = None) -> Cameras:
    """Cameras of a caliscope or aniposelib TOML, their world as there, in mm, taken as exact.

    unit_mm: length of the file's unit; by default 1000 for caliscope (metres) and 1 for aniposelib (a board in mm).
    Raises Refused where the file is neither, a camera is a fisheye or unplaced, or its lens cannot be.
    """
    tables = _tables(Path(path))
    unit_mm = unit_mm or (
        1000.0 if any("cam_id" in t or "port" in t for t in tables.values()) else 1.0
    )
    cameras = Cameras(tuple(_camera(name, table, unit_mm) for name, table in tables.items()))
    for camera in cameras:
        check_lens(camera)
    return cameras


def _tables(path: Path) -> dict[str, dict]:
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise Refused(f"{path.name} is not TOML: {error}") from error
    candidates = document.get("cameras", document)
    cameras = {key: t for key, t in candidates.items() if isinstance(t, dict) and "matrix" in t}
    tables = {str(key): t for key, t in cameras.items() if not t.get("ignore")}
    if not tables:
        raise Refused(f"{path.name} holds no camera as caliscope or aniposelib write them")
    return {_name(key, table): table for key, table in tables.items()}


def _name(key: str, table: dict) -> str:
    """aniposelib names its cameras; caliscope numbers them and calls the video of camera 0 cam_0."""
    if "name" in table:
        return str(table["name"])
    return f"cam_{key}" if key.isdigit() else key


def _camera(name: str, table: dict, unit_mm: float) -> Camera:
    missing = [key for key in _NEEDED if not table.get(key)]
    if missing:
        raise Refused(
            f"camera {name}: {', '.join(missing)} missing, so it is not calibrated or not placed"
        )
    if table.get("fisheye"):
        raise Refused(
            f"camera {name} has a fisheye lens, which the five-term lens here does not describe"
        )
    rotation = np.array(table["rotation"], dtype=float)
    R = rotation if rotation.shape == (3, 3) else exp_rotation(rotation.ravel())
    shift = unit_mm * np.array(table["translation"], dtype=float).ravel()
    distortion = np.array(table["distortions"], dtype=float).ravel()
    if len(distortion) > 5 and np.any(distortion[5:]):
        raise Refused(
            f"camera {name} has {len(distortion)} distortion terms; up to five (k1 k2 p1 p2 k3) are read"
        )
    terms = np.append(distortion, np.zeros(5))[:5]
    rms = float(table.get("error", np.nan))
    return Camera(
        name, tuple(table["size"]), table["matrix"], terms, np.column_stack([R, shift]), rms
    )


def place_on_rig(
    cameras: Cameras,
    rig_views: Mapping[str, Corners],
    board: Board,
    T_rig_board: np.ndarray,
) -> Cameras:
    """The same lenses, held, each camera placed by its view of the board on the rig; covariance of the poses only.

    Raises Refused where a camera does not see the board.
    """
    for camera in cameras:
        check_rig_view(camera.name, rig_views.get(camera.name), board)
    T_board_rig = invert_transform(T_rig_board)
    poses = [
        compose(board_pose(rig_views[c.name], board.corners_mm, c.lens), T_board_rig)
        for c in cameras
    ]
    state = BundleState(
        np.array([c.lens for c in cameras]), np.array(poses), np.asarray(T_rig_board)[None]
    )
    seen = gather([(k, 0, rig_views[c.name]) for k, c in enumerate(cameras)])
    settled = settle(state, seen, board.corners_mm, _poses_only(len(cameras)))
    return as_cameras(cameras.names, {c.name: c.size_px for c in cameras}, settled)


def _poses_only(n_cameras: int):
    priors = lens_priors(n_cameras, 1)
    free = np.zeros_like(priors.free)
    for k in range(n_cameras):
        free[N_CAMERA * k + 9 : N_CAMERA * k + 15] = True
    return replace(
        priors,
        free=free,
        sigma=np.full_like(priors.sigma, np.inf),
        view_free=np.zeros(1, dtype=bool),
    )
