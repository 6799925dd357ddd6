"""Writer of cameras.toml and cameras.npz."""

from pathlib import Path

from bench.base.atomic import write_whole
from vision.calibration import cameras_as_files
from vision.geometry import Cameras


def write_cameras(path: Path, cameras: Cameras) -> None:
    """Write `path` (TOML) and, with the suffix .npz, the joint covariance, each whole.

    The covariance goes first, so that a run that dies between the two leaves no TOML pointing at nothing.
    """
    companion = path.with_suffix(".npz")
    document, packed = cameras_as_files(cameras, companion.name)
    write_whole(companion, packed)
    write_whole(path, document)
