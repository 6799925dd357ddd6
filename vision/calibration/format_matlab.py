"""MATLAB's cameraParameters and stereoParameters, saved as a structure: save(…, toStruct(params)).

MATLAB counts pixels from 1, multiplies rows by matrices (until R2022a, and in its structures), and
states lengths in WorldUnits.
"""

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat

from vision.calibration.foreign_camera import foreign_camera, numbers
from vision.calibration.matlab_file import load_matlab
from vision.geometry.camera import Camera, Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rotation import compose, invert_transform

_UNITS_MM = {
    "mm": 1.0,
    "millimeters": 1.0,
    "cm": 10.0,
    "centimeters": 10.0,
    "m": 1000.0,
    "meters": 1000.0,
    "in": 25.4,
    "inches": 25.4,
}
# [px] MATLAB's coordinate of the first pixel's middle. A layout.
_FIRST_PIXEL = 1.0
_BOTH = ("CameraParameters1", "CameraParameters2")


def read(path: Path) -> list[Camera]:
    """Return the cameras of a file: camera1 and camera2, or one of the file's name.

    Raises Refused where the file holds no such structure, or a lens is skewed.
    """
    try:
        values = load_matlab(path)
    except (Refused, NotImplementedError) as problem:
        raise Refused(f"{path.name} is not read: {problem}; save it with -v7") from None
    for value in values.values():
        if isinstance(value, dict) and "CameraParameters1" in value:
            return _stereo(path, value)
        if isinstance(value, dict) and "RadialDistortion" in value:
            return [_camera(path, path.stem, value, None)]
    raise Refused(
        f"{path.name} holds no structure of stereoParameters: in MATLAB, s = toStruct(stereoParams); save('{path.name}', 's')"
    )


def _stereo(path: Path, stereo: dict[str, Any]) -> list[Camera]:
    """Return both cameras, the first one's frame being the world."""
    if not all(isinstance(stereo.get(name), dict) for name in _BOTH):
        raise Refused(f"{path.name} has no structures {' and '.join(_BOTH)}")
    first, second = (stereo[name] for name in _BOTH)
    units = stereo.get("WorldUnits") or first.get("WorldUnits", "mm")
    if units not in _UNITS_MM:
        raise Refused(f"{path.name}: WorldUnits is {units!r}; allowed are {', '.join(_UNITS_MM)}")
    rotation = stereo.get("RotationOfCamera2")
    transposed = numbers(rotation, (3, 3), f"{path.name}: RotationOfCamera2")
    translation = stereo.get("TranslationOfCamera2")
    shift = numbers(translation, (3,), f"{path.name}: TranslationOfCamera2")
    T = np.column_stack([transposed.T, _UNITS_MM[units] * shift])
    return [_camera(path, "camera1", first, None), _camera(path, "camera2", second, T)]


def _camera(path: Path, name: str, lens: dict[str, Any], T: np.ndarray | None) -> Camera:
    """Return the camera of a structure."""
    matrix = _matrix(path, name, lens)
    if matrix[0, 1]:
        raise Refused(f"{path.name}: {name} has skew {matrix[0, 1]:.3g} px, which no lens here has")
    if "RadialDistortion" not in lens:
        raise Refused(f"{path.name}: {name} has no RadialDistortion")
    matrix[:2, 2] -= _FIRST_PIXEL
    radial = np.append(np.ravel(lens["RadialDistortion"]), [0.0, 0.0])[:3]
    tangential = np.append(np.ravel(lens.get("TangentialDistortion", [])), [0.0, 0.0])[:2]
    height_width = numbers(lens.get("ImageSize"), (2,), f"{path.name}: ImageSize of {name}")
    return foreign_camera(
        name, height_width[::-1], matrix, [*radial[:2], *tangential, radial[2]], T
    )


def _matrix(path: Path, name: str, lens: dict[str, Any]) -> np.ndarray:
    """Return the intrinsic matrix (3, 3), px, which older versions of MATLAB write transposed."""
    if "K" in lens:
        return numbers(lens["K"], (3, 3), f"{path.name}: K of {name}")
    transposed = lens.get("IntrinsicMatrix")
    return numbers(transposed, (3, 3), f"{path.name}: IntrinsicMatrix of {name}").T


def write(cameras: Cameras, stem: str) -> dict[str, bytes]:
    """Return a .mat with the structure that stereoParameters is made from; raise Refused for any
    number of cameras but two.
    """
    if len(cameras.names) != 2:
        raise Refused(f"MATLAB's stereoParameters hold two cameras, not {len(cameras.names)}")
    first, second = cameras
    T = compose(second.T_camera_rig, invert_transform(first.T_camera_rig))
    stereo = {
        "CameraParameters1": _structure(first),
        "CameraParameters2": _structure(second),
        "RotationOfCamera2": T[:, :3].T,
        "TranslationOfCamera2": T[:, 3],
        "WorldUnits": "mm",
    }
    buffer = BytesIO()
    savemat(buffer, {"stereoParams": stereo})
    return {f"{stem}.mat": buffer.getvalue()}


def _structure(camera: Camera) -> dict[str, Any]:
    """Return a camera's structure."""
    k1, k2, p1, p2, k3 = camera.distortion
    matrix = camera.matrix.copy()
    matrix[:2, 2] += _FIRST_PIXEL
    width, height = camera.size_px
    return {
        "RadialDistortion": [k1, k2, k3],
        "TangentialDistortion": [p1, p2],
        "ImageSize": [float(height), float(width)],
        "IntrinsicMatrix": matrix.T,
        "WorldUnits": "mm",
    }
