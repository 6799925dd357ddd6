"""`calibrate cameras`: the report, the files, and one line where it cannot be done."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.cameras.board_views import sampled_frames
from bench.cameras.calibrate_session import calibrate_cameras_command, place_imported
from bench.session.rig_file import MeasuredRig
from bench.session.session import load_session
from vision.calibration.cameras_file import read_cameras

MANIFEST = """format = 1
[board]
squares = [4, 5]
square_mm = 54.0
marker_mm = 40.5
dictionary = "{dictionary}"
inverted = {inverted}
"""


@pytest.fixture
def webcam(real, tmp_path):
    """A session of one webcam's board video, and nothing else."""

    def made(dictionary="DICT_4X4_1000", inverted="true"):
        folder = tmp_path / "webcam"
        (folder / "boards").mkdir(parents=True)
        (folder / "session.toml").write_text(
            MANIFEST.format(dictionary=dictionary, inverted=inverted)
        )
        shutil.copy(real / "calibration" / "single" / "cam_0.mp4", folder / "boards")
        return folder

    return made


def test_one_camera_is_calibrated_and_measured(webcam, tmp_path, capsys):
    assert calibrate_cameras_command(webcam(), tmp_path / "out" / "cameras.toml") in (0, 1)
    said = capsys.readouterr().out
    assert "camera cam_0: 45 views" in said and "held out, views with index % 4 == 3" in said
    made = read_cameras(tmp_path / "out" / "cameras.toml")
    assert made["cam_0"].lens[0] == pytest.approx(891, abs=6)
    assert made.covariance.any()


def test_a_wrong_setting_is_named_and_nothing_is_written(webcam, tmp_path):
    out = tmp_path / "cameras.toml"
    with pytest.raises(BadInput, match=r"boards/cam_0: .*one with inverted = true is"):
        calibrate_cameras_command(webcam(inverted="false"), out)
    assert not out.exists() and not out.with_suffix(".npz").exists()


@pytest.mark.slow
def test_a_session_with_a_rig_prints_what_the_rig_board_says(small_session, tmp_path, capsys):
    assert calibrate_cameras_command(small_session, tmp_path / "cameras.toml") == 0
    said = capsys.readouterr().out
    assert "camera high: 10 views" in said and "distances of neighbouring corners in space" in said


def test_a_long_series_is_sampled_in_runs_of_neighbours():
    chosen = sorted(sampled_frames(3000))
    assert len(chosen) == 120 and chosen[0] == 0 and chosen[-1] == 2999
    assert all(chosen[k + 2] == chosen[k] + 2 for k in range(0, 120, 3))
    assert sampled_frames(48) == set(range(48))


LENSES = """
[cam_{name}]
name = "{name}"
size = [1280, 720]
matrix = {K}
distortions = {dist}
rotation = [0.0, 0.0, 0.1]
translation = [0.0, 0.0, 500.0]
"""


def test_lenses_of_another_tool_are_placed_by_the_rig_board(small_session, tmp_path, capsys):
    """In a file that numbers its cameras, the session's names are given in its order; a wrong order is refused."""
    truth = json.loads((small_session / "truth.json").read_text())["cameras"]
    numbered = enumerate(truth.values())
    text = "".join(LENSES.format(name=str(k), K=t["K"], dist=t["dist"]) for k, t in numbered)
    file = tmp_path / "anipose.toml"
    file.write_text(text)
    with pytest.raises(BadInput, match=r"has no camera high; it has 0, 1; .* --names"):
        calibrate_cameras_command(small_session, tmp_path / "c.toml", file)
    with pytest.raises(BadInput, match=r"the lenses of .* are exchanged"):
        calibrate_cameras_command(small_session, tmp_path / "c.toml", file, names=list(truth)[::-1])
    assert not (tmp_path / "c.toml").exists()
    assert (
        calibrate_cameras_command(small_session, tmp_path / "c.toml", file, names=list(truth)) == 0
    )
    assert "lenses of high, low as in anipose.toml" in capsys.readouterr().out
    for camera in read_cameras(tmp_path / "c.toml"):
        # With true lenses a camera's place is known to some hundredths of a millimetre from one picture.
        assert np.abs(camera.T_camera_rig[:, 3] - truth[camera.name]["t"]).max() < 0.3
        assert np.abs(camera.T_camera_rig[:, :3] - truth[camera.name]["R"]).max() < 1e-3


def test_lenses_of_another_tool_are_placed_by_rig_toml_or_said_to_be_in_their_own_frame(
    small_session, tmp_path, capsys
):
    truth = json.loads((small_session / "truth.json").read_text())["cameras"]
    file = tmp_path / "anipose.toml"
    text = [LENSES.format(name=name, K=t["K"], dist=t["dist"]) for name, t in truth.items()]
    file.write_text("".join(text).replace("500.0]", "510.0]", 1))
    stated = load_session(small_session)
    measured = MeasuredRig(stated.T_rig_board, np.diag([1e-6] * 3 + [0.01] * 3), "strokes")
    by_file = replace(stated, T_rig_board=None, measured_rig=measured)
    for one, other in zip(place_imported(stated, file), place_imported(by_file, file)):
        np.testing.assert_allclose(other.T_camera_rig, one.T_camera_rig, atol=1e-6)
    np.testing.assert_allclose(
        place_imported(by_file, file).placement, measured.covariance, atol=1e-12
    )
    shutil.copytree(small_session, tmp_path / "session")
    manifest = tmp_path / "session" / "session.toml"
    before, _, after = manifest.read_text().partition("[rig]\n")
    manifest.write_text(before + after[after.index("\n[") :])
    outs = (tmp_path / "c.toml", tmp_path / "session" / "cameras.toml")
    found = [calibrate_cameras_command(tmp_path / "session", out, file) for out in outs]
    assert found == [0, 1]
    assert capsys.readouterr().out.count("stand in the frame of anipose.toml") == 2


def test_lenses_that_cannot_be_are_refused(small_session, tmp_path):
    text = LENSES.format(
        name="high",
        K=[[3754, 0, 545], [0, 3323, 683], [0, 0, 1]],
        dist=[-2.9, 0.01, -0.3, 0.1, 625],
    )
    (tmp_path / "wild.toml").write_text(text)
    with pytest.raises(BadInput, match=r"wild\.toml: camera high: fx = 3754 and fy = 3323"):
        calibrate_cameras_command(small_session, tmp_path / "c.toml", tmp_path / "wild.toml")
    assert not (tmp_path / "c.toml").exists()
