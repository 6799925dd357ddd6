"""Points in space that Anipose has triangulated, as its own cameras see them."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from bench.base.errors import BadInput
from bench.base.input_problems import refused_as_bad_input, require_cameras
from bench.base.text_files import read_text
from bench.session.trace_readers import DrawnLines, numbers_with_gaps
from vision.calibration import foreign_cameras
from vision.geometry import Camera, Cameras

_AXES = ("x", "y", "z")
# Anipose's columns of the axes that it has aligned points to.
_TURN = ("M_00", "M_01", "M_02", "M_10", "M_11", "M_12", "M_20", "M_21", "M_22")
_CENTRE = ("center_0", "center_1", "center_2")
# [mm] Of a place from the cameras: 100 m. Stated.
_MOST_MM = 1e5
# [1] Of a turn in a table. Stated.
_ROUNDING = 1e-3


def lines_in_space(
    path: Path, sizes_px: Mapping[str, tuple[int, int]], label: str
) -> dict[str, DrawnLines]:
    """Return by camera the joints of Anipose's CSV as one line in its picture.

    sizes_px: of the cameras' pictures, of a part of a picture that part's.
    Its calibration is in the same folder under the same name, as TOML, and has the cameras' names. Points
    are turned back from the axes that Anipose may have aligned them to. Raises BadInput where one of
    the files cannot be read.
    """
    known = _cameras_beside(path, sizes_px, label)
    frame, points, joints = _joints(path, label)
    found = {}
    for name in sizes_px:
        px = _as_seen(known[name], points)
        found[name] = DrawnLines.of_joints(frame, px[:, None], joints)
    return found


def _cameras_beside(path: Path, sizes_px: Mapping[str, tuple[int, int]], label: str) -> Cameras:
    """Return Anipose's cameras beside a table. Raise BadInput where they are not those of these pictures."""
    folder, _, _ = label.rpartition("/")
    calibration = path.with_suffix(".toml")
    if not calibration.is_file():
        found = f"needs its cameras beside it: Anipose's calibration.toml as {calibration.name}"
        raise BadInput(found, file=label)
    beside = f"{folder}/{calibration.name}"
    with refused_as_bad_input(beside):
        known = foreign_cameras(calibration)
    require_cameras(known, list(sizes_px), beside)
    for name, (width, height) in sizes_px.items():
        its_width, its_height = known[name].size_px
        if (its_width, its_height) != (width, height):
            found = f"has camera {name} with pictures of {its_width} x {its_height} px"
            raise BadInput(f"{found}; here they are {width} x {height} px", file=beside)
    return known


def _joints(path: Path, label: str) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Return frames (n,), points (n, joints, 3) in the cameras' frame, and the joints' names."""
    wanted, columns = _coordinates(path, label)
    count = len(columns[wanted[0]])
    points = np.stack([columns[name] for name in wanted], axis=1).reshape(count, -1, 3)
    largest_mm = np.max(np.abs(points[np.isfinite(points)]), initial=0.0)
    if largest_mm > _MOST_MM:
        raise BadInput(f"holds {largest_mm:g}, which is no place in mm", file=label)
    frame = columns.get("fnum", np.arange(float(count)))
    joints = [name.removesuffix("_x") for name in wanted[:: len(_AXES)]]
    return frame, _in_cameras_frame(points, columns, label), joints


def _coordinates(path: Path, label: str) -> tuple[list[str], dict[str, np.ndarray]]:
    """Return the names of the joints' coordinates, three a joint, and all columns (n,) by name.

    Raises BadInput where no joint has all three.
    """
    table = list(csv.reader(io.StringIO(read_text(path, "export it as CSV, UTF-8", label))))
    if not table:
        raise BadInput("is empty", file=label)
    names, *rows = table
    wanted = []
    for name in names:
        if name.endswith("_x"):
            wanted += [f"{name.removesuffix('_x')}_{axis}" for axis in _AXES]
    if not wanted or not set(wanted) <= set(names):
        found = "has no columns <joint>_x,<joint>_y,<joint>_z, as Anipose writes them"
        raise BadInput(found, file=label, row=1)
    return wanted, _numbers_by_name(names, rows, label)


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


def _in_cameras_frame(
    points: np.ndarray, columns: Mapping[str, np.ndarray], label: str
) -> np.ndarray:
    """Return points (n, joints, 3) in the cameras' frame, by Anipose's columns M and center where it has them.

    Raises BadInput where these are no turn and no place.
    """
    if not any(name in columns for name in (*_TURN, *_CENTRE)):
        return points
    missing = [name for name in (*_TURN, *_CENTRE) if name not in columns]
    if missing:
        raise BadInput(f"column {missing[0]} is missing beside the others", file=label, row=1)
    turn = np.array([columns[name][0] for name in _TURN]).reshape(3, 3)
    centre = np.array([columns[name][0] for name in _CENTRE])
    if not _is_turn(turn) or not np.all(np.abs(centre) < _MOST_MM):
        found = "columns M_00 to M_22 and center are no turn and place of axes"
        raise BadInput(found, file=label, row=2)
    return (points + centre) @ turn


def _is_turn(matrix: np.ndarray) -> bool:
    """Return whether a matrix (3, 3) turns axes, within a table's rounding."""
    has_unit_size = bool(np.all(np.abs(matrix) < 1.0 + _ROUNDING))
    return has_unit_size and np.allclose(matrix @ matrix.T, np.eye(3), atol=_ROUNDING)


def _as_seen(camera: Camera, points: np.ndarray) -> np.ndarray:
    """Return joints (frames, joints, 3) in a camera's picture, (frames, joints, 2) px."""
    px = np.full((*points.shape[:2], 2), np.nan)
    is_known = np.all(np.isfinite(points), axis=2)
    px[is_known] = camera.project(points[is_known])
    return px
