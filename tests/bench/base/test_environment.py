"""The environment in which the tests run is sound; each way of being unsound is seen."""

import sys
from types import SimpleNamespace

import pytest

from bench.base import environment
from bench.base.errors import BadInput


def distributions(*names):
    return lambda: [SimpleNamespace(metadata={"Name": name}) for name in names]


def test_this_environment_is_sound():
    environment.check_environment()


def test_two_opencvs(monkeypatch):
    both = distributions("numpy", "opencv-python", "opencv_contrib_python_headless")
    monkeypatch.setattr(environment.metadata, "distributions", both)
    cure = "pip uninstall -y opencv-contrib-python-headless opencv-python && pip install"
    with pytest.raises(BadInput, match="opencv-contrib-python-headless and opencv-python") as bad:
        environment.check_environment()
    assert cure in str(bad.value)


def test_no_opencv(monkeypatch):
    monkeypatch.setattr(environment.metadata, "distributions", distributions("numpy"))
    with pytest.raises(
        BadInput, match="found no OpenCV where exactly opencv-contrib-python-headless"
    ):
        environment.check_environment()


@pytest.mark.parametrize(
    ("cv2", "expected"),
    [
        (SimpleNamespace(), "cv2 is broken"),
        (SimpleNamespace(__version__="4.14.0", aruco=SimpleNamespace()), "cv2 is broken"),
        (
            SimpleNamespace(__version__="4.13.0", aruco=SimpleNamespace(CharucoDetector=1)),
            "OpenCV is 4.13.0",
        ),
    ],
)
def test_broken_and_old_opencv(monkeypatch, cv2, expected):
    monkeypatch.setitem(sys.modules, "cv2", cv2)
    with pytest.raises(BadInput, match=expected):
        environment.check_environment()


def test_a_package_of_our_name_that_is_not_ours(monkeypatch, tmp_path):
    (tmp_path / "vision").mkdir()
    (tmp_path / "vision" / "__init__.py").touch()
    for name in [name for name in sys.modules if name.split(".")[0] == "vision"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(BadInput, match=f"the package 'vision' comes from {tmp_path}"):
        environment.check_environment()
