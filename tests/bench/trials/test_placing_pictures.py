"""Where the rig is, from pictures: the free strokes against a T_rig_board that is right, wrong, or not there."""

import csv
import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.cameras.first_look import first_look
from bench.cameras.session_cameras import SessionCalibration, on_the_rig
from bench.commands.cli import main
from bench.rig.simulation import simulate
from bench.session.session import load_session
from bench.trials.placing import place_rig
from bench.trials.trial_evaluation import see_unit
from bench.trials.unit import Unit
from tests.scenes.recorded import exact_cameras
from vision.geometry.camera import Cameras
from vision.geometry.rotation import compose, invert_transform, log_rotation
from vision.pictures.files import read_picture

SMALL = Path(__file__).resolve().parents[3] / "fixtures" / "small-session"
TRUE_T_RIG_BOARD = np.array(json.loads((SMALL / "truth.json").read_text())["T_rig_board"])[:3]
PROTOCOL = """
name = "wide"
[[cameras]]
name = "high"
position_mm = [38.0, -175.0, 335.0]
focal_px = 1400.0
size_px = [900, 500]
distortion = [0.0, 0.0, 0.0, 0.0, 0.0]
[[cameras]]
name = "low"
position_mm = [98.0, -325.0, 120.0]
focal_px = 1400.0
size_px = [900, 500]
distortion = [0.0, 0.0, 0.0, 0.0, 0.0]
[board]
views = 1
[light]
wire_matt = 0.5
[motor]
before_deg = {before:g}
[pictures]
format = "png"
before_deg = {before:g}
after_deg = 4.2
step_deg = {step:g}
[[trials]]
beta_deg = 20
d_x_mm = 60.0
"""


def recorded(folder, before, step):
    """A session of one trial whose free stroke is so many degrees wide."""
    (folder / "one.toml").write_text(PROTOCOL.format(before=before, step=step))
    simulate(folder / "session", protocol=folder / "one.toml", seed=5)
    return load_session(folder / "session")


@pytest.fixture(scope="module")
def wide(tmp_path_factory):
    """A free stroke of 24 degrees."""
    return recorded(tmp_path_factory.mktemp("wide"), 24.0, 1.2)


def moved(session, T_world_rig):
    """The exact cameras in another frame."""
    T_rig_world = invert_transform(T_world_rig)
    return Cameras(
        tuple(
            replace(c, T_camera_rig=compose(c.T_camera_rig, T_rig_world))
            for c in exact_cameras(session.path)
        )
    )


def place(session, cameras, T_rig_board, out):
    """place_rig's calibration, the warnings, and the trial as a unit under that calibration."""
    background = {name: read_picture(path) for name, path in session.rig_pictures.items()}
    before = SessionCalibration(cameras, background, "given", (), T_rig_board)
    unit = Unit(session, session.trials[0], "", before, Settings(), out)
    problems = InputProblems()
    made = place_rig(session, before, [unit], Workers(0), problems)
    return made, problems.warnings, replace(unit, calibration=made)


def test_a_right_board_is_agreed_with(wide, tmp_path):
    made, warnings, _ = place(wide, exact_cameras(wide.path), wide.T_rig_board, tmp_path)
    assert not warnings
    (note,) = (note for note in made.notes if note.startswith("A free stroke of 2"))
    # A whole line may be off by 0.25 px, 0.07 mm in these small pictures, and two cameras on one side triple it.
    assert float(re.search(r"± ([0-9.]+) mm across", note)[1]) < 0.3


def test_a_board_1_mm_across_is_an_alarm(wide, tmp_path):
    # The board is said to stand 1 mm nearer along rig y than it does, and takes the cameras with it.
    shift = np.column_stack([np.eye(3), [0.0, -1.0, 0.0]])
    _, (warning,), _ = place(wide, moved(wide, shift), compose(shift, wide.T_rig_board), tmp_path)
    # Three of the 0.13 mm that the stroke tells the centre to across the whisker.
    assert float(re.search(r"across the whisker by ([+-][0-9.]+)", warning)[1]) == pytest.approx(
        -1.0, abs=0.4
    )


@pytest.mark.slow
def test_the_swing_alone_places_the_rig(wide, tmp_path):
    session = replace(wide, T_rig_board=None)
    cameras, T_rig_board, note = on_the_rig(
        session, moved(wide, invert_transform(wide.T_rig_board)), np.eye(3, 4)
    )
    assert "a first look at 1 stroke " in note
    _, (warning,), unit = place(session, cameras, T_rig_board, tmp_path)
    assert re.search(
        r"22\.8 degrees fix the centre of rotation to 0\.05\d mm along the whisker only", warning
    )
    truth = tomllib.loads((unit.trial.folder / "truth.toml").read_text())
    (seen,) = see_unit(unit).whisks
    for found, true in (
        (seen.d_x_mm, truth["d_x_mm"]),
        (seen.beta_rad, np.radians(truth["beta_deg"])),
    ):
        assert abs(found.value - true) < 3 * found.sigma
    # 0.05 mm along the whisker, and the bar's own place on top of it.
    assert seen.d_x_mm.sigma < 0.08
    rows = list(csv.DictReader((unit.trial.folder / "truth.csv").open()))
    for k in np.flatnonzero(seen.frames.touching):
        error = seen.frames.slip_mm.value[k] - float(rows[seen.frames.index[k]]["slip_mm"])
        assert abs(error) < max(3 * seen.frames.slip_mm.sigma[k], 0.02)


def test_a_narrow_swing_alone_is_refused_with_the_width_that_would_do(tmp_path):
    narrow = recorded(tmp_path, 1.6, 0.8)
    alone, in_board = (
        replace(narrow, T_rig_board=None),
        moved(narrow, invert_transform(narrow.T_rig_board)),
    )
    with pytest.raises(BadInput, match=r"record free strokes of (about|some) [0-9]+ degrees"):
        place(alone, *on_the_rig(alone, in_board, np.eye(3, 4))[:2], tmp_path)


@pytest.mark.slow
def test_squares_a_sixth_too_large_are_what_a_stroke_that_cannot_be_read_leads_to(wide, tmp_path):
    """The cameras then stand a sixth too far from the board, and the whisker is nowhere near where they look."""
    far = [
        replace(
            c, T_camera_rig=np.column_stack([c.T_camera_rig[:, :3], 1.16 * c.T_camera_rig[:, 3]])
        )
        for c in moved(wide, invert_transform(wide.T_rig_board))
    ]
    on_rig = [
        replace(c, T_camera_rig=compose(c.T_camera_rig, invert_transform(wide.T_rig_board)))
        for c in far
    ]
    _, (warning,), _ = place(wide, Cameras(tuple(on_rig)), wide.T_rig_board, tmp_path)
    assert "square_mm" in warning


def test_by_a_marker_on_the_hub_short_strokes_give_a_first_look():
    """Of 1.5 degrees the moving lines alone give no axis; the marker turns with the motor in every frame."""
    session = load_session(SMALL)
    session = replace(session, T_rig_board=None, trials=session.trials[:1])
    first = first_look(session, moved(session, invert_transform(TRUE_T_RIG_BOARD)))
    off = compose(first.T_rig_world, invert_transform(TRUE_T_RIG_BOARD))
    # What `place_rig` begins with may be off by 5 degrees and 5 mm (`_SIGMA_RAD`, `_SIGMA_MM` of first_look.py): half of that.
    assert np.degrees(np.linalg.norm(log_rotation(off[:, :3]))) < 2.5
    assert np.linalg.norm(off[:, 3]) < 2.5


@pytest.mark.slow
def test_calibrate_rig_on_short_strokes_by_the_marker_and_evaluate(small_copy, tmp_path, capsys):
    """The board's place is found without one in session.toml, and d_x with it."""
    text = (small_copy / "session.toml").read_text()
    (small_copy / "session.toml").write_text(re.sub(r"T_rig_board = .*\n", "", text))
    assert main(["calibrate", "rig", str(small_copy)]) in (0, 1)
    assert "Marker 40 on the hub" in capsys.readouterr().out
    found = load_session(small_copy).measured_rig
    off = compose(found.T_rig_board, invert_transform(TRUE_T_RIG_BOARD))
    error = np.append(log_rotation(off[:, :3]), off[:, 3])
    # 22.5: chi-squared of six at one in a thousand.
    assert error @ np.linalg.solve(found.covariance, error) < 22.5
    assert np.sqrt(found.covariance[3, 3]) < 0.1
    assert main(["evaluate", str(small_copy), "--out", str(tmp_path / "out"), "--no-figures"]) in (
        0,
        1,
    )
    for row in csv.DictReader((tmp_path / "out" / "whisks.csv").open()):
        truth = tomllib.loads((small_copy / "trials" / row["trial"] / "truth.toml").read_text())
        assert abs(float(row["d_x_mm"]) - truth["d_x_mm"]) < 3 * float(row["d_x_sigma_mm"])
