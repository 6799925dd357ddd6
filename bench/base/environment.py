"""Check of the Python environment: one OpenCV, new enough, and our own packages."""

import importlib
import re
from importlib import metadata

from bench.base.errors import BadInput
from bench.base.packages import foreign_package

OPENCV = "opencv-contrib-python-headless"
OLDEST_OPENCV = (4, 14)  # older ones put ChArUco corners 0.5 px off


def check_environment() -> None:
    """Raise BadInput, naming the commands that cure it, where results could be silently wrong."""
    found = foreign_package()
    if found:
        raise BadInput(found)
    _check_opencv_distributions()
    _check_opencv()


def versions() -> dict[str, str]:
    """Return the versions of the distributions that results depend on."""
    names = ("whisker-bench", OPENCV, "numpy", "scipy", "scikit-image", "matplotlib")
    return {name: _version(name) for name in names}


def _version(name: str) -> str:
    """Return the version of a distribution."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"


def _check_opencv_distributions() -> None:
    """Raise BadInput where not exactly one distribution of OpenCV is installed."""
    names = [each.metadata["Name"] or "" for each in metadata.distributions()]
    normalised = {re.sub(r"[-_.]+", "-", name).lower() for name in names}
    found = sorted(name for name in normalised if name.startswith("opencv"))
    if found != [OPENCV]:
        what = " and ".join(found) or "no OpenCV"
        raise BadInput(f"found {what} where exactly {OPENCV} is needed; {_cure(found)}")


def _check_opencv() -> None:
    """Raise BadInput where OpenCV is broken or too old."""
    try:
        cv2 = importlib.import_module("cv2")
    except Exception as problem:  # of two in one place any error comes
        raise BadInput(f"cv2 cannot be imported ({problem}); {_cure([OPENCV])}") from None
    version = getattr(cv2, "__version__", None)
    if version is None or not hasattr(getattr(cv2, "aruco", None), "CharucoDetector"):
        raise BadInput(f"cv2 is broken (no cv2.aruco.CharucoDetector); {_cure([OPENCV])}")
    major_minor = re.findall(r"\d+", version)[:2]
    if tuple(map(int, major_minor)) < OLDEST_OPENCV:
        needed = ".".join(str(part) for part in OLDEST_OPENCV)
        raise BadInput(f"OpenCV is {version}, {needed} or newer is needed; {_cure([OPENCV])}")


def _cure(found: list[str]) -> str:
    """Return the commands that put our OpenCV in place of the distributions found."""
    remove = f"pip uninstall -y {' '.join(found)} && " if found else ""
    return f"cure: {remove}pip install --force-reinstall '{OPENCV}>=4.14,<6'"
