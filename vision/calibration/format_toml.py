"""The camera TOML of caliscope and of aniposelib.

Both keep OpenCV's lens and T_camera_world; caliscope in metres, with the rotation as a matrix or as
a vector; aniposelib in the unit of its board, with the rotation as a vector.
"""

from pathlib import Path

import numpy as np
import tomli_w

from vision.calibration.cameras_file import parse_toml
from vision.calibration.foreign_camera import MM_PER_M, foreign_camera, numbers
from vision.geometry.camera import Camera, Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rotation import exp_rotation, log_rotation

_NEEDED = ("size", "matrix", "distortions", "rotation", "translation")


def read(path: Path) -> list[Camera]:
    """Return the cameras of a file; raise Refused where a camera is a fisheye or unplaced.

    The file's unit is a metre for caliscope and, for a board that is described in mm, a millimetre
    for aniposelib.
    """
    tables = _tables(path)
    is_caliscope = any("cam_id" in table or "port" in table for table in tables.values())
    unit_mm = MM_PER_M if is_caliscope else 1.0
    return [_camera(name, table, unit_mm) for name, table in tables.items()]


def write_anipose(cameras: Cameras, stem: str) -> dict[str, bytes]:
    """Return aniposelib's calibration.toml, in mm."""
    document: dict = {}
    for k, camera in enumerate(cameras):
        table = _lens_table(camera) | {
            "name": camera.name,
            "rotation": log_rotation(camera.T_camera_rig[:, :3]).tolist(),
            "translation": camera.T_camera_rig[:, 3].tolist(),
        }
        document[f"cam_{k}"] = table
    document["metadata"] = {}
    return {f"{stem}.toml": tomli_w.dumps(document).encode()}


def write_caliscope(cameras: Cameras, stem: str) -> dict[str, bytes]:
    """Return caliscope's camera_array.toml, in metres."""
    tables: dict = {}
    for k, camera in enumerate(cameras):
        table = _lens_table(camera) | {
            "cam_id": k,
            "name": camera.name,
            "rotation": camera.T_camera_rig[:, :3].tolist(),
            "translation": (camera.T_camera_rig[:, 3] / MM_PER_M).tolist(),
            "fisheye": False,
            "ignore": False,
        }
        tables[str(k)] = table
    return {f"{stem}.toml": tomli_w.dumps({"cameras": tables}).encode()}


def _lens_table(camera: Camera) -> dict:
    """Return a camera's lens as both programs write it."""
    return {
        "size": list(camera.size_px),
        "matrix": camera.matrix.tolist(),
        "distortions": camera.distortion.tolist(),
    }


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
    of camera 0 cam_0. Raise Refused where it cannot be printed.
    """
    name = str(table.get("name", f"cam_{key}" if key.isdigit() else key))
    if not name.isprintable():
        raise Refused(f"the name of camera {name!r} holds what cannot be printed")
    return name


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
    stated = table["rotation"]
    is_matrix = isinstance(stated, list) and isinstance(stated[0], list) and len(stated) == 3
    rotation = numbers(stated, (3, 3) if is_matrix else (3,), f"camera {name}: rotation")
    R = rotation if is_matrix else exp_rotation(rotation)
    shift_mm = unit_mm * numbers(table["translation"], (3,), f"camera {name}: translation")
    return foreign_camera(
        name,
        table["size"],
        table["matrix"],
        table["distortions"],
        np.column_stack([R, shift_mm]),
        float(table.get("error", np.nan)),
    )
