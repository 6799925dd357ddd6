"""camchain.yaml of Kalibr: pinhole cameras with its radtan lens (k1 k2 p1 p2), a chain of poses in
metres, each from the camera before.
"""

from pathlib import Path
from typing import Any

import numpy as np

from vision.calibration import format_opencv
from vision.calibration.foreign_camera import (
    foreign_camera,
    in_metres,
    in_millimetres,
    matrix_of,
    numbers,
)
from vision.calibration.yaml_text import read_yaml
from vision.geometry.camera import Camera, Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rotation import compose, invert_transform

_TERMS = {"radtan": 4, "radtan5": 5, "none": 0}


def read(path: Path) -> list[Camera]:
    """Return the cameras of a file, the first one's frame being the world.

    Raises Refused where the file is no camchain, or a lens or projection is another.
    """
    document = read_yaml(path)
    tables = document if isinstance(document, dict) else {}
    if "camera_matrix" in tables:
        return format_opencv.of_plain_yaml(path, tables)
    names = [name for name in tables if str(name).startswith("cam")]
    if not names or not all(isinstance(tables[name], dict) for name in names):
        raise Refused(f"{path.name} is no camchain of Kalibr: it has no table cam0")
    cameras = []
    T_camera_world = np.eye(3, 4)
    for k, name in enumerate(names):
        table = tables[name]
        if k > 0:
            if "T_cn_cnm1" not in table:
                raise Refused(f"{path.name}: {name} has no T_cn_cnm1, so it is not placed")
            T = numbers(table["T_cn_cnm1"], (4, 4), f"{path.name}: T_cn_cnm1 of {name}")
            T_camera_world = compose(in_millimetres(T[:3]), T_camera_world)
        cameras.append(_camera(path, name, table, T_camera_world))
    return cameras


def _camera(path: Path, name: str, table: dict[str, Any], T_camera_world: np.ndarray) -> Camera:
    """Return the camera of one table; raise Refused where its model is another."""
    projection = table.get("camera_model")
    lens = table.get("distortion_model")
    if projection != "pinhole" or not isinstance(lens, str) or lens not in _TERMS:
        raise Refused(
            f"{path.name}: {name} is {projection}-{lens}, which the five-term lens here does not describe; "
            "calibrate with pinhole-radtan"
        )
    fx, fy, cx, cy = numbers(table.get("intrinsics"), (4,), f"{path.name}: intrinsics of {name}")
    terms = table.get("distortion_coeffs", [])
    if not isinstance(terms, list):
        raise Refused(f"{path.name}: distortion_coeffs of {name} is no list of numbers")
    size_px = numbers(table.get("resolution"), (2,), f"{path.name}: resolution of {name}")
    return foreign_camera(
        name, size_px, matrix_of(fx, fy, cx, cy), terms[: _TERMS[lens]], T_camera_world
    )


def write(cameras: Cameras, stem: str) -> dict[str, bytes]:
    """Return camchain.yaml. Raises Refused for a lens with k3, which radtan does not have."""
    lines = []
    before = None
    for k, camera in enumerate(cameras):
        if camera.distortion[4]:
            raise Refused(
                f"camera {camera.name} has k3 = {camera.distortion[4]:.3g}, which Kalibr's radtan lens does not have"
            )
        lines += [
            f"cam{k}:",
            "  camera_model: pinhole",
            f"  intrinsics: {camera.lens[:4].tolist()}",
            "  distortion_model: radtan",
            f"  distortion_coeffs: {camera.distortion[:4].tolist()}",
            f"  resolution: {list(camera.size_px)}",
            f"  rostopic: /{camera.name}/image_raw",
        ]
        if before is not None:
            lines.append("  T_cn_cnm1:")
            chain = compose(camera.T_camera_rig, invert_transform(before.T_camera_rig))
            rows = [*in_metres(chain).tolist(), [0.0, 0.0, 0.0, 1.0]]
            lines += [f"  - {row}" for row in rows]
        before = camera
    return {f"{stem}.yaml": ("\n".join(lines) + "\n").encode()}
