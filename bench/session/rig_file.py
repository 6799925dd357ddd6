"""rig.toml: where the board on the rig stands, as `calibrate rig` measured it, and what from."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
import tomli_w

from bench.base.atomic import write_whole
from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.base.results import hash_of_files
from bench.base.toml_text import read_toml
from bench.session.manifest import Row4
from bench.session.strict_toml import Keys, as_keys
from bench.session.written_covariance import is_covariance
from vision.geometry import nearest_rotation

RIG_FILE = "rig.toml"
_CURE = "remove it, and run `whisker-bench calibrate rig` on this session"
# A layout, no threshold.
_THREE = msgspec.Meta(min_length=3, max_length=3)
# A layout, no threshold.
_SIX = msgspec.Meta(min_length=6, max_length=6)
Row6 = Annotated[list[float], _SIX]
# Three written digits are exact to 1e-3; a transposed, scaled or mirrored matrix is off by far more.
_ROTATION_TOLERANCE = 2e-3
# [mm] A board's origin this near to the whisker's base is a board placed in metres.
_NEAREST_BOARD_MM = 0.5
# [mm] No bench is larger; a board beyond is placed in another unit.
_FARTHEST_BOARD_MM = 5000.0
# Units of the file's covariance: degrees of the turns, mm of the shifts.
_FILE_UNITS = np.repeat([np.degrees(1.0), 1.0], 3)


@dataclass(frozen=True, kw_only=True)
class RigFileKeys(Keys):
    """The keys of rig.toml."""

    # 3 × 4, mm: as in `[rig]` of session.toml
    T_rig_board: Annotated[list[Row4], _THREE]
    # 6 × 6: turns of the rig frame about its own axes, degrees, and shifts along them, mm
    covariance_deg_mm: Annotated[list[Row6], _SIX]
    # hash of boards/rig; of other pictures the file is refused
    rig_pictures: str
    # what it was measured from
    measured_from: list[str]
    trials: list[str]
    trial_files: str


@dataclass(frozen=True)
class MeasuredRig:
    """The board's pose as `calibrate rig` measured it.

    T_rig_board: (3, 4), mm. covariance (6, 6): of a turn w (rad) and a shift v (mm) of the rig frame,
    along its own axes, x = Exp(w) x_true + v. source: what it was measured from, in words.
    """

    T_rig_board: np.ndarray
    covariance: np.ndarray
    source: str


def read_rig(path: Path, rig_pictures: Mapping[str, Path]) -> MeasuredRig:
    """Read rig.toml. Raise BadInput where it is damaged, or was measured by other pictures of the board
    on the rig than these (by camera).
    """
    keys = as_keys(read_toml(path, RIG_FILE), RigFileKeys, RIG_FILE, InputProblems())
    if keys.rig_pictures != hash_of_rig(rig_pictures.values()):
        found = "was measured by other pictures than those in boards/rig"
        raise BadInput(f"{found}; {_CURE}", file=RIG_FILE)
    return MeasuredRig(
        exact_pose(keys.T_rig_board, "T_rig_board", RIG_FILE),
        _covariance(keys.covariance_deg_mm),
        " and ".join(keys.measured_from),
    )


def write_rig(path: Path, keys: RigFileKeys, header: Iterable[str]) -> None:
    """Write rig.toml whole; `header` goes before it as comments."""
    comments = "".join(f"# {line}".rstrip() + "\n" for line in header)
    write_whole(path, f"{comments}\n{tomli_w.dumps(msgspec.to_builtins(keys))}")


def hash_of_rig(pictures: Iterable[Path]) -> str:
    """Return the hash of the pictures of the board on the rig."""
    return hash_of_files(map(Path, pictures))


def covariance_as_written(covariance: np.ndarray) -> list[list[float]]:
    """Return a covariance (6, 6) of rad and mm in the file's units."""
    return (covariance * np.outer(_FILE_UNITS, _FILE_UNITS)).tolist()


def _covariance(written: list[list[float]]) -> np.ndarray:
    """Return a written covariance in rad and mm. Raise BadInput where it cannot be one."""
    covariance = np.array(written)
    if not is_covariance(covariance) or np.any(np.diag(covariance) == 0):
        found = "covariance_deg_mm is no covariance: symmetric, with variances above 0, is allowed"
        raise BadInput(f"{found}; {_CURE}", file=RIG_FILE)
    return covariance / np.outer(_FILE_UNITS, _FILE_UNITS)


def exact_pose(rows: list[list[float]], key: str, file: str) -> np.ndarray:
    """Return a board's pose (3, 4) with its rotation made exact.

    rows: three, and perhaps a fourth, 0 0 0 1. Raises BadInput, naming key and file, where it is no rotation,
    or not in mm.
    """
    pose = np.array(rows[:3], dtype=float)
    if rows[3:] not in ([], [[0.0, 0.0, 0.0, 1.0]]):
        raise BadInput(
            f"{key}: the fourth row is {rows[3]}; leave it out, or write [0, 0, 0, 1]", file=file
        )
    rotation = pose[:, :3]
    error = np.abs(rotation.T @ rotation - np.eye(3)).max()
    determinant = np.linalg.det(rotation)
    if error > _ROTATION_TOLERANCE or determinant < 0:
        raise BadInput(
            f"{key}: the first three columns are not a right-handed rotation "
            f"(RᵀR is off by {error:.2g}, determinant {determinant:.3g})",
            file=file,
        )
    shift_mm = np.linalg.norm(pose[:, 3])
    in_metres = 0 < shift_mm < _NEAREST_BOARD_MM
    if in_metres or shift_mm > _FARTHEST_BOARD_MM:
        hint = " Is the last column in metres? It is mm." if in_metres else ""
        raise BadInput(f"{key} puts the board {shift_mm:.3g} mm from the base.{hint}", file=file)
    return np.column_stack([nearest_rotation(rotation), pose[:, 3]])
