"""mrcal's .cameramodel: one camera a file, a Python dictionary of plain values, in metres."""

import ast
from pathlib import Path
from typing import Any

import numpy as np

from vision.calibration.foreign_camera import MM_PER_M, foreign_camera, matrix_of, numbers
from vision.geometry.camera import Camera, Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rotation import exp_rotation, log_rotation

# Numbers of distortion terms by model, in OpenCV's order.
_TERMS = {
    "LENSMODEL_PINHOLE": 0,
    "LENSMODEL_OPENCV4": 4,
    "LENSMODEL_OPENCV5": 5,
    "LENSMODEL_OPENCV8": 8,
    "LENSMODEL_OPENCV12": 12,
}
# The pose had another name before mrcal 2.5.
_POSE = ("rt_cam_ref", "extrinsics")


def read(path: Path) -> list[Camera]:
    """Return the camera of a file, of the file's name.

    Raises Refused where the file is none, or its lens is another, such as a splined one.
    """
    model = _dictionary(path)
    lens = model.get("lensmodel")
    name = path.stem
    if not isinstance(lens, str) or lens not in _TERMS:
        raise Refused(
            f"camera {name} has {lens!r}, which the five-term lens here does not describe; "
            "solve with LENSMODEL_OPENCV5"
        )
    found = f"{path.name}: intrinsics of {lens}"
    terms = numbers(model.get("intrinsics"), (4 + _TERMS[lens],), found)
    pose = next((model[key] for key in _POSE if key in model), np.zeros(6))
    turn, shift_m = np.split(numbers(pose, (6,), f"{path.name}: the pose"), 2)
    T = np.column_stack([exp_rotation(turn), MM_PER_M * shift_m])
    size_px = numbers(model.get("imagersize"), (2,), f"{path.name}: imagersize")
    return [foreign_camera(name, size_px, matrix_of(*terms[:4]), terms[4:], T)]


def _dictionary(path: Path) -> dict[str, Any]:
    """Return what a file holds; raise Refused where it is no dictionary of plain values."""
    try:
        model = ast.literal_eval(path.read_text(encoding="utf-8-sig").strip())
    except (ValueError, SyntaxError, UnicodeDecodeError, RecursionError, MemoryError):
        model = None
    if not isinstance(model, dict) or "lensmodel" not in model:
        raise Refused(f"{path.name} is no .cameramodel of mrcal: it names no lensmodel")
    return model


def write(cameras: Cameras, stem: str) -> dict[str, bytes]:
    """Return a file a camera, with LENSMODEL_OPENCV5."""
    return {f"{stem}-{camera.name}.cameramodel": _text(camera).encode() for camera in cameras}


def _text(camera: Camera) -> str:
    """Return a camera's file."""
    T = camera.T_camera_rig
    pose = [*log_rotation(T[:, :3]).tolist(), *(T[:, 3] / MM_PER_M).tolist()]
    lines = (
        "{",
        "    'lensmodel': 'LENSMODEL_OPENCV5',",
        f"    'intrinsics': {camera.lens.tolist()},",
        f"    'extrinsics': {pose},",
        f"    'imagersize': {list(camera.size_px)},",
        "}",
        "",
    )
    return "\n".join(lines)
