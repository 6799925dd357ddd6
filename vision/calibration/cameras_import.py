"""Cameras calibrated elsewhere: the TOML that caliscope and aniposelib write.

Both keep OpenCV's lens and T_camera_world; caliscope in metres, with the rotation as a matrix or as
a vector; aniposelib in the unit of its board, with the rotation as a vector. Neither states
uncertainties, so the lenses are taken as exact; their world is not the rig, where a picture of the
board on the rig places them (`place_on_rig`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from vision.boards.corners import Corners
from vision.boards.sufficiency import check_lens, check_rig_view
from vision.calibration.bundle import N_CAMERA, BundleState, Priors
from vision.calibration.calibrate import as_cameras
from vision.calibration.cameras_file import parse_toml
from vision.calibration.corner_noise import adjust_with_noise
from vision.calibration.first_guess import board_pose
from vision.calibration.layout import gather
from vision.calibration.tied import lens_priors, with_print
from vision.geometry.board import Board
from vision.geometry.camera import Camera, Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rotation import compose, exp_rotation, invert_transform

_NEEDED = ("size", "matrix", "distortions", "rotation", "translation")


def import_cameras(path: Path | str) -> Cameras:
    """Import cameras of a caliscope or aniposelib TOML, their world as there, in mm, taken as
    exact.

    The file's unit is a metre for caliscope and, for a board that is described in mm, a millimetre
    for aniposelib. Raises Refused where the file is neither, a camera is a fisheye or unplaced, or
    its lens cannot be.
    """
    tables = _tables(Path(path))
    is_caliscope = any("cam_id" in table or "port" in table for table in tables.values())
    unit_mm = 1000.0 if is_caliscope else 1.0
    cameras = Cameras(tuple(_camera(name, table, unit_mm) for name, table in tables.items()))
    for camera in cameras:
        check_lens(camera)
    return cameras


def _tables(path: Path) -> dict[str, dict]:
    """Return the tables of the cameras by name; raise Refused where there are none."""
    document = parse_toml(path, f"{path.name} is not TOML")
    tables = {}
    for key, table in document.get("cameras", document).items():
        if isinstance(table, dict) and "matrix" in table and not table.get("ignore"):
            tables[_name(str(key), table)] = table
    if not tables:
        raise Refused(f"{path.name} holds no camera as caliscope or aniposelib write them")
    return tables


def _name(key: str, table: dict) -> str:
    """Return the camera's name: aniposelib states it; caliscope numbers cameras and calls the video
    of camera 0 cam_0.
    """
    if "name" in table:
        return str(table["name"])
    return f"cam_{key}" if key.isdigit() else key


def _camera(name: str, table: dict, unit_mm: float) -> Camera:
    """Return the camera of one table; raise Refused where it is not calibrated, not placed, or a
    fisheye.
    """
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
    shift_mm = unit_mm * np.array(table["translation"], dtype=float).ravel()
    return Camera(
        name=name,
        size_px=tuple(table["size"]),
        matrix=table["matrix"],
        distortion=_distortion(name, table["distortions"]),
        T_camera_rig=np.column_stack([R, shift_mm]),
        rms_px=float(table.get("error", np.nan)),
    )


def _distortion(name: str, terms: Sequence[float]) -> np.ndarray:
    """Return k1, k2, p1, p2 and k3 of a camera's distortion; raise Refused where it has more terms."""
    distortion = np.array(terms, dtype=float).ravel()
    if np.any(distortion[5:]):
        raise Refused(
            f"camera {name} has {len(distortion)} distortion terms; up to five (k1 k2 p1 p2 k3) are read"
        )
    return np.append(distortion, np.zeros(5))[:5]


def place_on_rig(
    cameras: Cameras,
    rig_views: Mapping[str, Corners],
    board: Board,
    T_rig_board: np.ndarray,
) -> Cameras:
    """Place each camera by its view of the board on the rig, its lens held; the covariance is of
    the poses only, with the share of the print's size and stretch.

    Raises Refused where a camera does not see the board.
    """
    T_board_rig = invert_transform(T_rig_board)
    lenses = []
    poses = []
    shots = []
    for k, camera in enumerate(cameras):
        view = rig_views.get(camera.name)
        check_rig_view(camera.name, view, board)
        T_camera_board = board_pose(view, board.corners_mm, camera.lens)
        lenses.append(camera.lens)
        poses.append(compose(T_camera_board, T_board_rig))
        shots.append((k, 0, view))
    state = BundleState(np.array(lenses), np.array(poses), np.asarray(T_rig_board)[None])
    priors = with_print(_camera_pose_priors(len(cameras)), board)
    adjustment = adjust_with_noise(state, gather(shots), board.corners_mm, priors)
    return as_cameras(cameras.names, {c.name: c.size_px for c in cameras}, adjustment)


def _camera_pose_priors(n_cameras: int) -> Priors:
    """Return the priors with the cameras' poses free, and lenses and board held."""
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
