"""OpenCV's FileStorage, XML, YAML or JSON: one camera as its calibration sample names it, or two as
its stereo sample does (M1 D1 M2 D2, and R, T of the second, in the board's unit).
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from vision.calibration.foreign_camera import foreign_camera, numbers
from vision.geometry.camera import Camera, Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rotation import exp_rotation

# [1] Of a matrix that is a camera's or a lens': more are views or covariances. Stated.
_MOST_NUMBERS = 64
# Names without underscores, in lower case.
_MATRIX = ("cameramatrix", "intrinsicmatrix", "intrinsic", "k", "m")
_DISTORTION = ("distortioncoefficients", "distcoeffs", "distcoeff", "distortion", "dist", "d")
_WIDTH, _HEIGHT = ("imagewidth", "width"), ("imageheight", "height")
_SIZE = ("imagesize", "cameraresolution", "size")
_ROTATION = ("rotation", "r", "rvec")
_SHIFT = ("translation", "t", "tvec")


def read(path: Path) -> list[Camera]:
    """Return the cameras of a file: one of the file's name, or camera1 and camera2.

    Raises Refused where the file is none, a camera is a fisheye, or its size is missing.
    """
    return _cameras(path, _values(path))


def of_plain_yaml(path: Path, document: Mapping[str, Any]) -> list[Camera]:
    """Return the camera of a YAML file that is no FileStorage, as scripts around OpenCV write it.

    document: what the file holds. Raises Refused as `read`.
    """
    values = {str(key).replace("_", "").lower(): value for key, value in document.items()}
    return _cameras(path, values)


def _cameras(path: Path, values: Mapping[str, Any]) -> list[Camera]:
    """Return the cameras of a file's values by name, without underscores. Raises Refused."""
    if values.get("fisheyemodel"):
        raise Refused(
            f"{path.name}: a fisheye lens, which the five-term lens here does not describe"
        )
    cameras = []
    for number in ("", "1", "2"):
        matrix = _first(values, _MATRIX, number)
        if matrix is not None:
            name = f"camera{number}" if number else path.stem
            cameras.append(_camera(path, name, number, values))
    if not cameras:
        raise Refused(
            f"{path.name} holds no camera_matrix, nor M1 and M2: no calibration of OpenCV"
        )
    return cameras


def _camera(path: Path, name: str, number: str, values: Mapping[str, np.ndarray]) -> Camera:
    """Return the camera of that number; raise Refused where something is missing."""
    matrix = numbers(_first(values, _MATRIX, number), (3, 3), f"{path.name}: the matrix of {name}")
    terms = _first(values, _DISTORTION, number)
    return foreign_camera(
        name,
        _size_px(path, values),
        matrix,
        np.zeros(5) if terms is None else terms,
        _pose(path, values) if number != "1" else None,
        _error_px(values),
    )


def _error_px(values: Mapping[str, Any]) -> float:
    """Return the calibration's own error; NaN where the file states none."""
    error = values.get("avgreprojectionerror")
    return float(error) if isinstance(error, float | np.ndarray) and np.size(error) == 1 else np.nan


def _size_px(path: Path, values: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return width and height; raise Refused where they are missing."""
    size = _first(values, _SIZE, "")
    if size is None:
        size = [_first(values, _WIDTH, ""), _first(values, _HEIGHT, "")]
    if any(n is None for n in size):
        raise Refused(f"{path.name}: image_width and image_height are missing: add them")
    return numbers(size, (2,), f"{path.name}: the picture's size")


def _pose(path: Path, values: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """Return T_camera_world (3, 4) in the file's unit; None where none is stated."""
    rotation = _first(values, _ROTATION, "")
    shift = _first(values, _SHIFT, "")
    if rotation is None or shift is None:
        return None
    R = exp_rotation(np.ravel(rotation)) if np.size(rotation) == 3 else np.array(rotation)
    return np.column_stack(
        [
            numbers(R, (3, 3), f"{path.name}: rotation"),
            numbers(shift, (3,), f"{path.name}: translation"),
        ]
    )


def _first(
    values: Mapping[str, np.ndarray], names: tuple[str, ...], number: str
) -> np.ndarray | None:
    """Return the value of the first of these names, with a number, that is there; else None."""
    for name in names:
        if f"{name}{number}" in values:
            return values[f"{name}{number}"]
    return None


def _values(path: Path) -> dict[str, np.ndarray]:
    """Return the numbers and matrices of a file by name; raise Refused where it is none."""
    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
        values = {}
        names = storage.root().keys()
        for key in names:
            node = storage.getNode(key)
            value = _value(node)
            if value is not None:
                values[key.replace("_", "").lower()] = value
        storage.release()
    except (cv2.error, SystemError, UnicodeDecodeError) as error:
        words = " ".join(str(error.__cause__ or error).split())[:120]
        raise Refused(f"{path.name} is no FileStorage of OpenCV: {words}") from None
    return values


def _value(node: cv2.FileNode) -> np.ndarray | None:
    """Return a node's number, list of numbers or matrix; None for anything else."""
    if node.isReal() or node.isInt():
        return np.array(node.real())
    if node.isSeq():
        parts = [node.at(k) for k in range(node.size())]
        if all(part.isReal() or part.isInt() for part in parts):
            return np.array([part.real() for part in parts])
    return _matrix(node) if node.isMap() else None


def _matrix(node: cv2.FileNode) -> np.ndarray | None:
    """Return a matrix by its rows, columns and numbers; None where these do not agree.

    OpenCV's own reader writes beyond its memory where a damaged file declares fewer than it holds.
    """
    rows, columns, data = (node.getNode(name) for name in ("rows", "cols", "data"))
    if not (rows.isInt() and columns.isInt() and data.isSeq()) or data.size() > _MOST_NUMBERS:
        return None
    shape = int(rows.real()), int(columns.real())
    parts = [data.at(k) for k in range(data.size())]
    are_numbers = all(part.isReal() or part.isInt() for part in parts)
    if min(shape) < 1 or shape[0] * shape[1] != len(parts) or not are_numbers:
        return None
    return np.array([part.real() for part in parts]).reshape(shape)


def write(cameras: Cameras, stem: str) -> dict[str, bytes]:
    """Return a YAML file a camera, with its T_camera_rig as rotation and translation, mm."""
    return {f"{stem}-{camera.name}.yml": _text(camera).encode() for camera in cameras}


def _text(camera: Camera) -> str:
    """Return a camera's file."""
    storage = cv2.FileStorage(".yml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    width, height = camera.size_px
    storage.write("image_width", width)
    storage.write("image_height", height)
    storage.write("camera_matrix", np.ascontiguousarray(camera.matrix))
    storage.write("distortion_coefficients", np.ascontiguousarray(camera.distortion[:, None]))
    storage.write("rotation", np.ascontiguousarray(camera.T_camera_rig[:, :3]))
    storage.write("translation", np.ascontiguousarray(camera.T_camera_rig[:, 3:]))
    return storage.releaseAndGetString()
