"""`calibrate rig`: a file that `evaluate` takes, what it would refuse, and nothing overwritten."""

import re
import shutil
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from bench.cameras.first_look import Look, by_first_look
from bench.cameras.session_cameras import SessionCalibration
from bench.commands.cli import main
from bench.records.trial_result import SeenTrial
from bench.session.session import load_session
from bench.workflows.rig_calibration import calibrate_rig_command
from tests.scenes.base_lines import some_lines
from tests.scenes.model_scenes import CAMERAS
from tests.scenes.results import seen_whisk
from vision import Value
from vision.calibration.place import Placement, move_rig_frame
from vision.geometry.rotation import compose, exp_rotation, invert_transform, log_rotation

EXACT = Placement(np.zeros(6), np.zeros((6, 6)))
# The true rig stands so far from the first look's.
T_FIRST_TRUE = np.column_stack([exp_rotation(np.array([0.01, -0.02, 0.03])), [0.6, 0.8, -0.5]])


@pytest.fixture
def measure(small_copy, monkeypatch):
    """A function (width of the free strokes) that runs the command on a session whose whisker is seen by its model."""
    T_RIG_BOARD = load_session(small_copy).T_rig_board
    drawn = {}

    def calibrate(session, out):
        assert session.T_rig_board is None and session.measured_rig is None
        cameras = move_rig_frame(CAMERAS, EXACT, by_first_look())
        return SessionCalibration(cameras, dict.fromkeys(CAMERAS.names), "board", (), T_RIG_BOARD)

    def run(width_deg=20.0, out=None, seen=True):
        rng = np.random.default_rng(5)
        contact_mm = np.array([59.9, 2.0, 0.5])

        def see(unit):
            T_camera_now = unit.calibration.cameras["one"].T_camera_rig
            T_now_first = compose(invert_transform(T_camera_now), CAMERAS["one"].T_camera_rig)
            T_now_true = compose(T_now_first, T_FIRST_TRUE)
            left = np.append(log_rotation(T_now_true[:, :3]), T_now_true[:, 3])
            lines = some_lines(width_deg, left, across_mm=0.01, turn_rad=5e-4, rng=rng)
            base = drawn.setdefault((unit.calibration_step, unit.trial.name, width_deg), lines)
            point = T_now_true[:, :3] @ contact_mm + T_now_true[:, 3]
            distance = Value(float(np.linalg.norm(point)), 0.01)
            touch = {"d_x_mm": distance, "point_mm": Value(point, np.full(3, 0.01))}
            return SeenTrial((seen_whisk(0, base=base if seen else None, **touch),))

        monkeypatch.setattr("bench.trials.lost.see_unit", see)
        return calibrate_rig_command(small_copy, out, workers=0)

    monkeypatch.setattr("bench.trials.of_session.calibrate_session", calibrate)
    monkeypatch.setattr("bench.trials.placing.look_at_strokes", lambda *_: Look((), ()))
    run.T_rig_board = T_RIG_BOARD
    return run


def without_stated(path):
    text = (path / "session.toml").read_text()
    (path / "session.toml").write_text(re.sub(r"T_rig_board = .*\n", "", text))


def test_it_is_written_beside_session_toml_and_read_from_there(measure, small_copy, capsys):
    without_stated(small_copy)
    assert measure() == 0
    read = load_session(small_copy).measured_rig
    true = compose(invert_transform(T_FIRST_TRUE), measure.T_rig_board)
    off = compose(read.T_rig_board, invert_transform(true))
    error = np.append(log_rotation(off[:, :3]), off[:, 3])
    # 22.5: chi-squared of six at one in a thousand.
    assert error @ np.linalg.solve(read.covariance, error) < 22.5
    assert np.sqrt(read.covariance[3, 3]) < 0.02  # 20 degrees fix it
    assert (small_copy / "rig.png").read_bytes().startswith(b"\x89PNG")
    said = capsys.readouterr().out
    assert "4 free strokes of 20.0 degrees give" in said and "Sigmas about and along rig" in said
    assert "to know it better: fasten a marker" in said
    keys = tomllib.loads((small_copy / "rig.toml").read_text())
    assert keys["trials"] == [trial.name for trial in load_session(small_copy).trials]


def test_nothing_is_overwritten(measure, small_copy, tmp_path, capsys):
    measure()
    before = (small_copy / "rig.toml").read_bytes()
    assert main(["calibrate", "rig", str(small_copy)]) == 2
    assert "rig.toml: is there already; remove it, or give --out" in capsys.readouterr().err
    assert (small_copy / "rig.toml").read_bytes() == before
    measure(out=tmp_path / "new" / "again.toml")
    assert (tmp_path / "new" / "again.png").exists()


def test_a_stated_pose_enters_nothing_and_is_compared(measure, small_copy, capsys):
    text = (small_copy / "session.toml").read_text()
    stated = "[rig]\nT_rig_board_sigma_mm = 0.05\nT_rig_board_sigma_deg = 0.05"
    (small_copy / "session.toml").write_text(text.replace("[rig]", stated))
    assert measure() == 1
    assert "warning: rig.toml: T_rig_board and rig.toml disagree" in capsys.readouterr().out
    beside = load_session(small_copy).measured_rig
    without_stated(small_copy)
    (small_copy / "rig.toml").unlink()
    (small_copy / "rig.png").unlink()
    measure()
    np.testing.assert_array_equal(
        load_session(small_copy).measured_rig.T_rig_board, beside.T_rig_board
    )


def test_narrow_strokes_are_warned_of_with_the_width_that_would_do(measure, small_copy, capsys):
    assert measure(width_deg=3.0) == 1
    assert re.search(r"record free strokes of about \d+ degrees", capsys.readouterr().out)


def test_a_touch_at_a_measured_distance_fixes_the_centre_along_the_whisker(measure, small_copy):
    """Strokes of 3 degrees fix it to 0.1 mm, a distance that a caliper gives to 0.02 mm."""
    without_stated(small_copy)
    with (small_copy / "trials" / "b60_4" / "trial.toml").open("a") as file:
        file.write("\nd_x_mm = 59.935\nd_x_sigma_mm = 0.02\n")
    assert measure(width_deg=3.0) == 0
    read = load_session(small_copy).measured_rig
    assert np.sqrt(read.covariance[3, 3]) < 0.03
    true = compose(invert_transform(T_FIRST_TRUE), measure.T_rig_board)
    off = compose(read.T_rig_board, invert_transform(true))
    error = np.append(log_rotation(off[:, :3]), off[:, 3])
    assert error @ np.linalg.solve(read.covariance, error) < 22.5
    assert "b60_4 touching at 59.935" in (small_copy / "rig.toml").read_text()


def refused(arguments, capsys) -> str:
    """The one line of a refusal."""
    assert main(["calibrate", "rig", *map(str, arguments)]) == 2
    said = [line for line in capsys.readouterr().err.splitlines() if not line.endswith("...")]
    (line,) = [line for line in said if line.startswith("whisker-bench:")]
    return line


def refuses_itself(run, *arguments, **options) -> str:
    from bench.base.errors import BadInput

    with pytest.raises(BadInput) as bad:
        run(*arguments, **options)
    return str(bad.value)


def test_strokes_that_fix_nothing_are_refused(measure, small_copy):
    said = refuses_itself(measure, width_deg=0.1)
    assert (
        said.startswith("trials: the free strokes are what places the rig")
        or "free strokes" in said
    )
    assert not (small_copy / "rig.toml").exists() and not (small_copy / "rig.png").exists()


def test_strokes_that_cannot_be_read_are_refused(measure, small_copy):
    said = refuses_itself(measure, seen=False)
    assert "the free strokes do not show the whisker" in said and "record free strokes" in said
    assert not (small_copy / "rig.toml").exists()


def test_what_is_not_there_to_measure_by_is_named(small_copy, capsys):
    picture = small_copy / "boards" / "rig" / "low.png"
    shutil.copy(picture, small_copy.parent / "low.png")
    without_stated(small_copy)
    picture.unlink()
    assert "boards/rig: has no picture low.png" in refused([small_copy], capsys)


def test_without_pictures(without_pictures, capsys):
    assert "no trial has pictures" in refused([without_pictures], capsys)


def test_a_place_that_cannot_be_written_is_refused_before_the_work(small_copy, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    said = refused([small_copy, "--out", tmp_path / "file" / "rig.toml"], capsys)
    assert "cannot be written" in said


def test_beside_cameras_toml_it_is_refused(measure, small_copy, monkeypatch, capsys):
    session = load_session(small_copy)
    monkeypatch.setattr(
        "bench.workflows.rig_calibration.checked_session",
        lambda *_, **__: replace(session, cameras_toml=small_copy / "cameras.toml"),
    )
    assert "has the cameras in the rig frame already" in refused([small_copy], capsys)
