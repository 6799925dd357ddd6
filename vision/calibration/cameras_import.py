"""Cameras calibrated elsewhere, and cameras for other programs: each file's format is a module.

Formats state no uncertainties, so the lenses are taken as exact; their world is not the rig, where a
picture of the board on the rig places them (`place_on_rig`).
"""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from vision.boards.body import Body
from vision.boards.corners import Corners
from vision.boards.sufficiency import check_lens, check_rig_view
from vision.calibration import (
    format_kalibr,
    format_matlab,
    format_mrcal,
    format_opencv,
    format_toml,
)
from vision.calibration.bundle import BundleState
from vision.calibration.calibrate import as_cameras
from vision.calibration.corner_noise import adjust_with_noise
from vision.calibration.exchanged_boards import check_imported_lenses
from vision.calibration.layout import gather, place_before_rig
from vision.calibration.priors import camera_pose_priors, with_print
from vision.geometry.board import Board
from vision.geometry.camera import Camera, Cameras
from vision.geometry.refusals import Refused

Read = Callable[[Path], list[Camera]]
Write = Callable[[Cameras, str], dict[str, bytes]]
# Files that are written: contents by name, of cameras and the names' stem.
WRITERS: dict[str, Write] = {
    "anipose": format_toml.write_anipose,
    "caliscope": format_toml.write_caliscope,
    "kalibr": format_kalibr.write,
    "matlab": format_matlab.write,
    "mrcal": format_mrcal.write,
    "opencv": format_opencv.write,
}
_READERS: dict[str, Read] = {
    ".toml": format_toml.read,
    ".mat": format_matlab.read,
    ".cameramodel": format_mrcal.read,
    ".xml": format_opencv.read,
    ".json": format_opencv.read,
}
_YAML = (".yml", ".yaml")
# How OpenCV's YAML begins, and no other.
_OPENCV_YAML = b"%YAML"


def import_cameras(path: Path | str) -> Cameras:
    """Import cameras of another program's file, or of a folder's files, their world as there, in mm,
    taken as exact.

    Raises Refused as `foreign_cameras`, and where a lens folds its picture back.
    """
    cameras = foreign_cameras(path)
    for camera in cameras:
        check_lens(camera)
    return cameras


def foreign_cameras(path: Path | str) -> Cameras:
    """Read cameras of another program, to project by: what a lens does at the picture's rim is not
    checked.

    Raises Refused where a file is of no known format, or a lens is another than OpenCV's of five terms.
    """
    path = Path(path)
    files = [path]
    if path.is_dir():
        files = sorted(file for file in path.iterdir() if _reader(file) is not None)
    found: list[Camera] = []
    for file in files:
        reader = _reader(file)
        if reader is None:
            allowed = ", ".join([*_READERS, *_YAML])
            raise Refused(f"{file.name} is of no known format; {allowed} are read")
        found += reader(file)
    if not found:
        raise Refused(f"{path.name} holds no camera file")
    return Cameras(tuple(found))


def are_placed(cameras: Cameras) -> bool:
    """Return whether the cameras of a file are placed to each other: no two are at one place."""
    poses = {tuple(camera.T_camera_rig.ravel()) for camera in cameras}
    return len(poses) == len(cameras.names)


def _reader(file: Path) -> Read | None:
    """Return what reads a file, by its suffix and, of YAML, its first line; None where nothing does."""
    suffix = file.suffix.lower()
    if suffix not in _YAML:
        return _READERS.get(suffix)
    with file.open("rb") as content:
        is_opencv = content.read(len(_OPENCV_YAML)) == _OPENCV_YAML
    return format_opencv.read if is_opencv else format_kalibr.read


def place_on_rig(
    cameras: Cameras,
    rig_views: Mapping[str, Corners],
    board: Board,
    T_rig_board: np.ndarray,
) -> Cameras:
    """Place each camera by its view of the board on the rig, its lens held; the covariance is of
    the poses only, with the share of the print's size and stretch.

    Raises Refused where a camera does not see the board or has another's lens, and for a body, whose faces have
    no places without a calibration.
    """
    if isinstance(board, Body):
        raise Refused(
            "a body of several faces places no cameras of known lenses: calibrate with it, or take a board"
        )
    for name in cameras.names:
        check_rig_view(name, rig_views.get(name), board)
    lenses = {camera.name: camera.lens for camera in cameras}
    poses = place_before_rig(lenses, rig_views, board, T_rig_board)
    check_imported_lenses(lenses, rig_views, board)
    state = BundleState(np.array(list(lenses.values())), poses, np.asarray(T_rig_board)[None])
    shots = [(k, 0, rig_views[name]) for k, name in enumerate(lenses)]
    priors = with_print(camera_pose_priors(len(cameras), board), board)
    adjustment = adjust_with_noise(state, gather(shots), board, priors)
    return as_cameras(cameras.names, {c.name: c.size_px for c in cameras}, adjustment)
