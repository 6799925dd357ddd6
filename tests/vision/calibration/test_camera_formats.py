"""Cameras for other programs and from them: there and back without loss, refused in one line where not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.io import savemat

from tests.studies.accuracy.board_scenes import WORK_MM, two_cameras
from vision.calibration.cameras_import import WRITERS, are_placed, import_cameras
from vision.calibration.kalibr_target import read_kalibr_target
from vision.geometry.camera import Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rotation import apply, compose, invert_transform

# [px] Of a projection after a file and back: rounding.
ROUNDING_PX = 1e-6
OPENCV_STEREO = """%YAML:1.0
---
image_width: 640
image_height: 480
M1: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 534., 0., 342., 0., 534., 234., 0., 0., 1. ]
D1: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -0.29, 0.11, 0.001, -0.0001, 0.02 ]
M2: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 537., 0., 327., 0., 536., 248., 0., 0., 1. ]
D2: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -0.28, 0.1, 0., 0., 0. ]
R: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 1., 0., 0., 0., 1., 0., 0., 0., 1. ]
T: !!opencv-matrix
   rows: 3
   cols: 1
   dt: d
   data: [ -83.5, 1., 0.5 ]
"""
KALIBR = """cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0002,
    1.7e-05]
  distortion_model: {lens}
  intrinsics: [458.654, 457.296, 367.215, 248.375]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, -0.0001, -3.5e-05]
  distortion_model: radtan
  intrinsics: [457.587, 456.134, 379.999, 255.238]
  resolution: [752, 480]
  rostopic: /cam1/image_raw
"""
MRCAL = """# solved elsewhere
{{
    'lensmodel':  '{lens}',

    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....
    'intrinsics': [ 1761.1, 1761.2, 1965.7, 1087.5,{terms}],
    'extrinsics': [ 0.1, -0.2, 0.3, 1.0, 2.0, 3.0,],
    'imagersize': [ 4000, 2200,],
}}
"""


@pytest.mark.parametrize("name", WRITERS)
def test_cameras_come_back_as_they_went(name, tmp_path):
    cameras = two_cameras()
    if name == "kalibr":  # its lens has no k3
        plain = [replace(c, distortion=[*c.distortion[:4], 0.0]) for c in cameras]
        cameras = Cameras(tuple(plain))
    for file, content in WRITERS[name](cameras, "made").items():
        (tmp_path / file).write_bytes(content)
    files = list(tmp_path.iterdir())
    back = import_cameras(files[0] if len(files) == 1 else tmp_path)
    assert are_placed(back) and len(back.names) == 2
    first = next(iter(cameras))
    T_world_rig = compose(invert_transform(next(iter(back)).T_camera_rig), first.T_camera_rig)
    for went, came in zip(cameras, back):
        px = came.project(apply(T_world_rig, WORK_MM))
        np.testing.assert_allclose(px, went.project(WORK_MM), rtol=0, atol=ROUNDING_PX)
        assert came.size_px == went.size_px


def test_what_a_format_cannot_say_is_refused():
    with pytest.raises(Refused, match="Kalibr's radtan lens does not have"):
        WRITERS["kalibr"](two_cameras(), "made")
    one = Cameras((two_cameras()["high"],))
    with pytest.raises(Refused, match="hold two cameras, not 1"):
        WRITERS["matlab"](one, "made")


def test_opencv_s_stereo_file_gives_two_placed_cameras(tmp_path):
    path = tmp_path / "stereo.yml"
    path.write_text(OPENCV_STEREO)
    made = import_cameras(path)
    assert made.names == ("camera1", "camera2") and are_placed(made)
    assert made["camera1"].lens.tolist() == [534, 534, 342, 234, -0.29, 0.11, 0.001, -0.0001, 0.02]
    assert made["camera2"].T_camera_rig[:, 3].tolist() == [-83.5, 1.0, 0.5]


def test_kalibr_s_metres_become_millimetres(tmp_path):
    path = tmp_path / "camchain.yaml"
    path.write_text(KALIBR.format(lens="radtan"))
    made = import_cameras(path)
    assert made["cam1"].T_camera_rig[:, 3].tolist() == [-110.0, 0.0, 0.0]
    assert made["cam0"].distortion.tolist() == [-0.28, 0.07, 0.0002, 1.7e-05, 0.0]


def test_mrcal_s_pose_and_lens(tmp_path):
    path = tmp_path / "left.cameramodel"
    path.write_text(MRCAL.format(lens="LENSMODEL_OPENCV4", terms="-0.1, 0.02, 0.001, 0.0005,"))
    made = import_cameras(path)["left"]
    assert made.T_camera_rig[:, 3].tolist() == [1000.0, 2000.0, 3000.0]
    assert made.distortion.tolist() == [-0.1, 0.02, 0.001, 0.0005, 0.0]


def matlab_lens(**more):
    """MATLAB's structure of a camera: rows times matrices, pixels from 1."""
    return {
        "RadialDistortion": [-0.1, 0.02],
        "TangentialDistortion": [0.001, 0.0005],
        "ImageSize": [480.0, 640.0],
        "IntrinsicMatrix": np.array([[800.0, 0, 0], [0, 801.0, 0], [321.0, 241.0, 1.0]]),
    } | more


def test_matlab_counts_pixels_from_one_and_multiplies_rows(tmp_path):
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    stereo = {
        "CameraParameters1": matlab_lens(WorldUnits="cm"),
        "CameraParameters2": matlab_lens(),
        "RotationOfCamera2": turn.T,
        "TranslationOfCamera2": [-8.0, 0.0, 0.0],
    }
    savemat(tmp_path / "stereo.mat", {"s": stereo})
    made = import_cameras(tmp_path / "stereo.mat")
    first, second = made
    assert first.lens[:4].tolist() == [800.0, 801.0, 320.0, 240.0] and first.size_px == (640, 480)
    np.testing.assert_array_equal(second.T_camera_rig[:, :3], turn)
    assert second.T_camera_rig[:, 3].tolist() == [-80.0, 0.0, 0.0]


PLAIN = """camera_matrix:
- [900.0, 0.0, 640.0]
- [0.0, 901.0, 360.0]
- [0.0, 0.0, 1.0]
dist_coeff:
- [-0.1, 0.05, 0.0, 0.0, 0.0]
"""


@pytest.mark.parametrize(
    "name, text, words",
    [
        ("c.yaml", KALIBR.format(lens="equidistant"), "cam0 is pinhole-equidistant"),
        ("c.yaml", "gyroscope: 1\n", "no camchain of Kalibr"),
        ("c.yaml", "a: [1\n", "is not YAML"),
        ("c.yaml", PLAIN, "image_width and image_height are missing: add them"),
        ("c.yml", "%YAML:1.0\n---\nK: 1\n", "must be 3 x 3 numbers"),
        ("c.yml", "%YAML:1.0\n---\nfocus: 1\n", "no calibration of OpenCV"),
        ("c.yml", OPENCV_STEREO.replace("image_width", "wide"), "image_width and image_height"),
        ("c.xml", "<a>", "no FileStorage of OpenCV"),
        ("c.cameramodel", MRCAL.format(lens="LENSMODEL_CAHVORE", terms=""), "LENSMODEL_CAHVORE"),
        (
            "c.cameramodel",
            MRCAL.format(lens="LENSMODEL_OPENCV8", terms="0,0,0,0,0,0.1,0,0"),
            "8 distortion terms",
        ),
        ("c.cameramodel", "{'a': open('b')}", "no .cameramodel of mrcal"),
        ("c.mat", "no file of MATLAB", "is not read"),
        ("c.txt", "", "of no known format"),
    ],
)
def test_what_is_no_camera_here_is_refused_in_a_line(name, text, words, tmp_path):
    (tmp_path / name).write_text(text)
    with pytest.raises(Refused, match=words) as refused:
        import_cameras(tmp_path / name)
    assert "\n" not in str(refused.value)


def test_a_plain_yaml_of_opencv_s_numbers_is_read_with_its_size(tmp_path):
    """As scripts around calibrateCamera dump it: its distortion a list in a list."""
    (tmp_path / "high.yaml").write_text(f"{PLAIN}image_width: 1280\nimage_height: 720\n")
    (camera,) = import_cameras(tmp_path / "high.yaml")
    assert (camera.name, camera.size_px) == ("high", (1280, 720))
    assert camera.lens.tolist() == [900.0, 901.0, 640.0, 360.0, -0.1, 0.05, 0.0, 0.0, 0.0]


APRIL = "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 5\ntagSize: 0.03\ntagSpacing: 0.3\n"


def test_kalibr_s_targets(tmp_path):
    path = tmp_path / "target.yaml"
    path.write_text(APRIL)
    found = read_kalibr_target(path)
    assert found["kind"] == "aprilgrid" and found["squares"] == [6, 5]
    assert found["square_mm"] == pytest.approx(39.0) and found["marker_mm"] == pytest.approx(30.0)
    board = "target_type: checkerboard\ntargetCols: 6\ntargetRows: 7\n"
    path.write_text(board + "rowSpacingMeters: 0.02\ncolSpacingMeters: 0.02\n")
    assert read_kalibr_target(path) == {
        "kind": "checkerboard",
        "squares": [7, 8],
        "square_mm": pytest.approx(20.0),
    }


@pytest.mark.parametrize(
    "text, words",
    [
        ("cam0: {}\n", "no target file of Kalibr"),
        (APRIL.replace("0.03", "-1"), "tagSize is -1, must be a number above 0"),
        (APRIL.replace("tagCols: 6", "tagCols: six"), "tagCols is 'six', must be a whole number"),
    ],
)
def test_what_is_no_target_is_refused(text, words, tmp_path):
    path = tmp_path / "target.yaml"
    path.write_text(text)
    with pytest.raises(Refused, match=words):
        read_kalibr_target(path)
