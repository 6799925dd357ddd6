"""Writer of cameras.toml and cameras.npz."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from bench.base.atomic import write_whole
from vision.calibration import cameras_as_files
from vision.geometry import Cameras, Crop


def write_cameras(
    path: Path, cameras: Cameras, crops: Mapping[str, Crop] = MappingProxyType({})
) -> None:
    """Write `path` (TOML) and, with the suffix .npz, the joint covariance, each whole.

    crops: of cameras that are parts of a picture.

    The covariance goes first, so that a run that dies between the two leaves no TOML pointing at nothing.
    """
    companion = path.with_suffix(".npz")
    document, packed = cameras_as_files(cameras, companion.name, crops)
    write_whole(companion, packed)
    write_whole(path, document)
