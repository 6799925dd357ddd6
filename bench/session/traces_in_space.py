"""Points in space that Anipose has triangulated, as its own cameras see them."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from bench.base.errors import BadInput
from bench.base.input_problems import refused_as_bad_input
from bench.session.text_files import read_text
from bench.session.trace_readers import DrawnLines, numbers_with_gaps
from vision.calibration import foreign_cameras
from vision.geometry import Camera

_AXES = ("x", "y", "z")


def lines_in_space(path: Path, cameras: Sequence[str], label: str) -> dict[str, DrawnLines]:
    """Return by camera the joints of Anipose's CSV as one line in its picture.

    Its calibration is in the same folder under the same name, as TOML, and has the cameras' names. Points
    are turned back from the axes that Anipose may have aligned them to. Raises BadInput where one of
    the files cannot be read.
    """
    folder, _, _ = label.rpartition("/")
    calibration = path.with_suffix(".toml")
    if not calibration.is_file():
        found = f"needs its cameras beside it: Anipose's calibration.toml as {calibration.name}"
        raise BadInput(found, file=label)
    with refused_as_bad_input(f"{folder}/{calibration.name}"):
        known = foreign_cameras(calibration)
    missing = [name for name in cameras if name not in known.names]
    if missing:
        found = f"has no camera {missing[0]}; it has {', '.join(known.names)}"
        raise BadInput(found, file=f"{folder}/{calibration.name}")
    frame, points = _joints(path, label)
    return {name: _as_seen(known[name], frame, points) for name in cameras}


def _joints(path: Path, label: str) -> tuple[np.ndarray, np.ndarray]:
    """Return frames (n,) and points (n, joints, 3) in the cameras' frame."""
    names, *rows = csv.reader(io.StringIO(read_text(path, "export it as CSV, UTF-8", label)))
    joints = [name.removesuffix("_x") for name in names if name.endswith("_x")]
    wanted = [f"{joint}_{axis}" for joint in joints for axis in _AXES]
    if not joints or not set(wanted) <= set(names):
        found = "has no columns <joint>_x,<joint>_y,<joint>_z, as Anipose writes them"
        raise BadInput(found, file=label, row=1)
    columns = _numbers_by_name(names, rows, label)
    count = len(columns[wanted[0]])
    points = np.stack([columns[name] for name in wanted], axis=1).reshape(count, -1, 3)
    return columns.get("fnum", np.arange(float(count))), _in_cameras_frame(points, columns)


def _numbers_by_name(
    names: Sequence[str], rows: Sequence[Sequence[str]], label: str
) -> dict[str, np.ndarray]:
    """Return the table's columns (n,) by name. Raises BadInput where there is no row or no number."""
    values = []
    for row, cells in enumerate(rows, start=2):
        values.append(numbers_with_gaps(cells, len(names), row, label))
    if not values:
        raise BadInput("has a header and no rows", file=label)
    return dict(zip(names, np.array(values).T))


def _in_cameras_frame(points: np.ndarray, columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return points (n, joints, 3) in the cameras' frame, by Anipose's columns M and center where it has them."""
    if "M_00" not in columns:
        return points
    turn = np.array([[columns[f"M_{i}{j}"][0] for j in range(3)] for i in range(3)])
    centre = np.array([columns[f"center_{i}"][0] for i in range(3)])
    return (points + centre) @ np.linalg.inv(turn.T)


def _as_seen(camera: Camera, frame: np.ndarray, points: np.ndarray) -> DrawnLines:
    """Return joints (frames, joints, 3) in a camera's picture, as one line."""
    px = np.full((*points.shape[:2], 2), np.nan)
    is_known = np.all(np.isfinite(points), axis=2)
    px[is_known] = camera.project(points[is_known])
    return DrawnLines.of_joints(frame, px[:, None])
