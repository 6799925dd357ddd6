"""Whether results can be trusted in this Python environment: one OpenCV, new enough, and our own packages."""

import importlib
import re
from importlib import metadata

from bench.base.errors import BadInput
from bench.base.packages import foreign_package

OPENCV = "opencv-contrib-python-headless"
OLDEST_OPENCV = (4, 14)  # older ones put ChArUco corners 0.5 px off


def check_environment() -> None:
    """Raises BadInput, naming the commands that cure it, where results could be silently wrong."""
    _check_packages()
    _check_opencv_distributions()
    _check_opencv()


def versions() -> dict[str, str]:
    """Version by distribution of what results depend on."""
    names = ("whisker-bench", OPENCV, "numpy", "scipy", "scikit-image", "matplotlib")
    return {name: _version(name) for name in names}


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"


def _check_packages() -> None:
    """Other distributions have packages of our names too."""
    found = foreign_package()
    if found:
        raise BadInput(found)


def _check_opencv_distributions() -> None:
    names = {
        re.sub(r"[-_.]+", "-", d.metadata["Name"] or "").lower() for d in metadata.distributions()
    }
    found = sorted(name for name in names if name.startswith("opencv"))
    if found != [OPENCV]:
        what = " and ".join(found) or "no OpenCV"
        raise BadInput(f"found {what} where exactly {OPENCV} is needed; {_cure(found)}")


def _check_opencv() -> None:
    try:
        cv2 = importlib.import_module("cv2")
    except Exception as problem:  # of two in one place any error comes
        raise BadInput(f"cv2 cannot be imported ({problem}); {_cure([OPENCV])}") from None
    version = getattr(cv2, "__version__", None)
    if version is None or not hasattr(getattr(cv2, "aruco", None), "CharucoDetector"):
        raise BadInput(f"cv2 is broken (no cv2.aruco.CharucoDetector); {_cure([OPENCV])}")
    if tuple(int(part) for part in re.findall(r"\d+", version)[:2]) < OLDEST_OPENCV:
        needed = ".".join(str(part) for part in OLDEST_OPENCV)
        raise BadInput(f"OpenCV is {version}, {needed} or newer is needed; {_cure([OPENCV])}")


def _cure(found: list[str]) -> str:
    remove = f"pip uninstall -y {' '.join(found)} && " if found else ""
    return f"cure: {remove}pip install --force-reinstall '{OPENCV}>=4.14,<6'"
