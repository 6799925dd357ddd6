"""What a calibration of cameras is refused for, from the command line: one line, what to enter or record, no file."""

import json
import shutil
import tomllib

import cv2
import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.cameras.cameras_toml import write_cameras
from bench.cameras.session_cameras import calibrate_session
from bench.commands.cli import main
from bench.session.session import load_session
from bench.session.session_check import checked_session
from vision.calibration.cameras_file import read_cameras
from vision.geometry.camera import Camera, Cameras
from vision.geometry.rotation import exp_rotation


@pytest.fixture
def refused(small_copy, tmp_path, capsys):
    """A function that calibrates the spoilt session and gives the one line it is refused with."""

    def line(*options) -> str:
        out = tmp_path / "cameras.toml"
        assert main(["calibrate", "cameras", str(small_copy), "--out", str(out), *options]) == 2
        said = capsys.readouterr().err.strip().splitlines()
        assert len(said) == 1 and not out.exists() and not out.with_suffix(".npz").exists()
        return said[0]

    return line


def edit(session, old, new):
    file = session / "session.toml"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


@pytest.mark.parametrize(
    "old, new, works",
    [
        pytest.param(
            "DICT_5X5_100", "DICT_4X4_100", 'dictionary = "DICT_5X5_50"', marks=pytest.mark.slow
        ),
        ("legacy = false", "legacy = true", "legacy = false"),
        ("legacy = false", "inverted = true", "inverted = false"),
    ],
)
def test_a_wrong_setting_names_the_one_that_works(small_copy, refused, old, new, works):
    edit(small_copy, old, new)
    said = refused()
    assert "boards/high" in said and f"but one with {works} is" in said and "enter it" in said


def test_a_square_that_does_not_go_with_its_marker(small_copy, refused):
    edit(small_copy, "square_mm = 15.0", "square_mm = 20.0")
    said = refused()
    assert "0.72" in said and "square_mm = 20 make it 0.550" in said and "may be seen" in said


@pytest.mark.slow
def test_a_whole_board_at_the_wrong_scale_is_told_by_the_bars(small_copy, refused):
    """A third too large: the bars are not where the whisker could touch them, so what is found for them disagrees."""
    edit(small_copy, "square_mm = 15.0\nmarker_mm = 11.0", "square_mm = 20.0\nmarker_mm = 14.67")
    assert (
        "is seen where square_mm and T_rig_board place the whisker: measure a square of the board"
        in refused()
    )


def test_boards_exchanged_between_two_cameras(small_copy, refused):
    boards = small_copy / "boards"
    (boards / "high").rename(boards / "kept")
    (boards / "low").rename(boards / "high")
    (boards / "kept").rename(boards / "low")
    said = refused()
    assert "boards/high and boards/low are exchanged: camera high's picture" in said


def test_rig_pictures_exchanged_between_two_cameras(small_copy, refused):
    rig = small_copy / "boards" / "rig"
    (rig / "high.png").rename(rig / "kept")
    (rig / "low.png").rename(rig / "high.png")
    (rig / "kept").rename(rig / "low.png")
    assert "or their pictures in boards/rig, are exchanged" in refused()


def test_too_few_views(small_copy, refused):
    for picture in sorted((small_copy / "boards" / "low").iterdir())[3:]:
        picture.unlink()
    assert "camera low: the board is well seen in 3 views, 5 are the least" in refused()


def test_another_picture_size(small_copy, refused):
    picture = small_copy / "boards" / "high" / "04.jpg"
    grey = cv2.imread(str(picture), cv2.IMREAD_GRAYSCALE)
    picture.unlink()
    cv2.imwrite(str(picture), cv2.resize(grey, None, fx=0.5, fy=0.5))
    assert "frame 3 of high is 640 x 360 px, the others are 1280 x 720 px" in refused()


def test_no_picture_of_the_board_on_the_rig(small_copy, refused):
    next((small_copy / "boards" / "rig").glob("low.*")).unlink()
    assert "boards/rig/low: there is no picture of the board on the rig" in refused()


def test_pictures_of_the_rig_without_a_board_place_no_camera(small_copy, refused):
    """They are backgrounds: cameras that saw the held board at once need no more, these did not."""
    manifest = small_copy / "session.toml"
    text = manifest.read_text()
    before, _, after = text.partition("[rig]\n")
    manifest.write_text(before + after[after.index("\n[") :])
    for picture in (small_copy / "boards" / "rig").iterdir():
        cv2.imwrite(str(picture), np.full((720, 1280), 90, np.uint8))
    assert "nor do the cameras see it at once in views of one number" in refused()


DIVERGED = """
[cam_high]
name = "high"
size = [1280, 720]
matrix = [[3754, 0, 545], [0, 3323, 683], [0, 0, 1]]
distortions = [-2.9, 0.01, -0.3, 0.1, 625]
rotation = [0.0, 0.0, 0.1]
translation = [0.0, 0.0, 500.0]
"""


def test_a_diverged_lens_brought_along(small_copy, refused, tmp_path):
    (tmp_path / "wild.toml").write_text(DIVERGED)
    assert "fx = 3754 and fy = 3323 differ by 13 %" in refused(
        "--lenses", str(tmp_path / "wild.toml")
    )


def test_another_tool_s_file_as_cameras_toml(small_copy):
    (small_copy / "cameras.toml").write_text("[cameras.high]\ntranslation = [0, 0, 500]\n")
    with pytest.raises(Exception, match=r"calibrate cameras SESSION --lenses FILE"):
        checked_session(small_copy)


def test_cameras_in_another_frame_as_cameras_toml(small_copy):
    """That of the first camera, as calibrations without a board on the rig have it."""
    matrix = [[2000.0, 0.0, 640.0], [0.0, 2000.0, 360.0], [0.0, 0.0, 1.0]]
    aside = np.column_stack([exp_rotation([0.0, -0.6, 0.0]), [-200.0, 0.0, 60.0]])
    poses = {"high": np.eye(3, 4), "low": aside}
    cameras = [Camera(n, (1280, 720), matrix, np.zeros(5), T) for n, T in poses.items()]
    write_cameras(small_copy / "cameras.toml", Cameras(tuple(cameras)))
    with pytest.raises(BadInput, match="no camera would see a whisker that turns about the rig"):
        checked_session(small_copy)


def caliscope(truth: dict) -> str:
    """As caliscope writes cameras: numbered, metres, a world of its own."""
    tables = (
        f'[cameras.{k}]\ncam_id = {k}\nname = "{name}"\nsize = [1280, 720]\nmatrix = {t["K"]}\n'
        f"distortions = {t['dist']}\nrotation = [0.1, 0.2, 0.3]\ntranslation = [0.0, 0.1, 1.0]\n"
        for k, (name, t) in enumerate(truth.items())
    )
    return "".join(tables)


def test_lenses_of_another_tool_do_without_board_views(small_copy, tmp_path):
    """Only the board on the rig is asked for; the file made is the session's cameras.toml from then on."""
    truth = json.loads((small_copy / "truth.json").read_text())["cameras"]
    for name in truth:
        shutil.rmtree(small_copy / "boards" / name)
    edit(small_copy, "[rig]\n", "[rig]\nT_rig_board_sigma_mm = 0.1\n")
    (tmp_path / "camera_array.toml").write_text(caliscope(truth))
    made = small_copy / "cameras.toml"
    assert (
        main(
            [
                "calibrate",
                "cameras",
                str(small_copy),
                "--out",
                str(made),
                "--lenses",
                str(tmp_path / "camera_array.toml"),
            ]
        )
        == 0
    )
    assert tomllib.loads(made.read_text())["covariance"] == "cameras.npz"
    cameras = calibrate_session(load_session(small_copy), tmp_path / "out").cameras
    # T_rig_board's 0.1 mm is all of a pose's uncertainty that both cameras share.
    shared = cameras.covariance[12:15, 27:30]
    assert abs(abs(shared[0] @ shared[0]) ** 0.5 - 0.01) < 0.002
    for camera in read_cameras(made):
        assert abs(camera.T_camera_rig[:, 3] - truth[camera.name]["t"]).max() < 0.3
