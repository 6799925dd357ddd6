"""rig.toml and T_rig_board: each alone, both by their sigmas, and told where they contradict each other."""

from dataclasses import replace

import numpy as np
import pytest

from bench.base.input_problems import InputProblems
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.cameras.measured_place import contradiction, moved_by_file, place_line
from bench.cameras.session_cameras import SessionCalibration
from bench.session.rig_file import MeasuredRig
from bench.session.session import load_session
from bench.trials.placing import place_rig
from bench.trials.unit import Unit
from tests.scenes.model_scenes import CAMERAS
from vision.geometry.rotation import compose, exp_rotation, invert_transform

# Along rig x, y, z: 0.3 and 0.1 degrees, 0.04, 0.05 and 0.09 mm.
COVARIANCE = np.diag([5e-3, 2e-3, 2e-3, 0.04, 0.05, 0.09]) ** 2
STATED_MM = 0.03
STATED_RAD = 1e-3


@pytest.fixture
def session(small_session):
    """A session with a T_rig_board and its sigma."""
    return replace(
        load_session(small_session),
        T_rig_board_sigma_mm=STATED_MM,
        T_rig_board_sigma_rad=STATED_RAD,
    )


def measured(session, shift_mm=(0.0, 0.0, 0.0), turn_rad=(0.0, 0.0, 0.0)):
    """The session with a rig.toml whose rig frame stands off T_rig_board's by these, along its axes."""
    T_old_new = np.column_stack([exp_rotation(np.array(turn_rad)), shift_mm])
    T_rig_board = compose(invert_transform(T_old_new), session.T_rig_board)
    return replace(session, measured_rig=MeasuredRig(T_rig_board, COVARIANCE, "3 free strokes"))


def test_two_that_agree_are_no_warning(session):
    assert contradiction(measured(session, (0.02, -0.02, 0.05))) is None
    assert contradiction(session) is None


def test_two_that_disagree_are_named_with_the_amount(session):
    warning = contradiction(measured(session, (0.0, 0.8, 0.0)))
    assert warning.codes == ("rig_file_contradicts",)
    assert (
        "T_rig_board and rig.toml disagree" in warning and "across the whisker by +0.8" in warning
    )
    assert "both count" in warning


def test_one_taken_as_exact_counts_and_the_warning_says_so(session):
    exact = replace(session, T_rig_board_sigma_mm=0.0, T_rig_board_sigma_rad=0.0)
    warning = contradiction(measured(exact, (0.0, 0.8, 0.0)))
    assert "T_rig_board is taken as exact and counts, rig.toml does not" in warning
    assert moved_by_file(measured(exact, (0.0, 0.8, 0.0)), CAMERAS) is CAMERAS


def test_alone_it_moves_the_cameras_of_the_board_s_frame_to_the_rig(session):
    alone = replace(measured(session), T_rig_board=None)
    in_board = [
        replace(c, T_camera_rig=compose(c.T_camera_rig, session.T_rig_board)) for c in CAMERAS
    ]
    moved = moved_by_file(alone, replace(CAMERAS, cameras=tuple(in_board)))
    for before, after in zip(CAMERAS, moved):
        np.testing.assert_allclose(after.T_camera_rig, before.T_camera_rig, atol=1e-9)
    # Its covariance is along the rig's own axes, and all that these exact cameras have.
    np.testing.assert_allclose(moved.placement, COVARIANCE, atol=1e-15)


def placed(session):
    """The calibration that `place_rig` gives, and its warnings; no trial is seen."""
    before = SessionCalibration(CAMERAS, {}, "before", (), session.T_rig_board)
    units = [Unit(session, t, "", before, Settings(), session.path) for t in session.trials]
    problems = InputProblems()
    return place_rig(session, before, units, Workers(0), problems), problems.warnings


@pytest.fixture
def nothing_is_seen(monkeypatch):
    """Free strokes that were read would raise."""
    monkeypatch.setattr("bench.trials.lost.see_unit", None)


def test_both_count_by_their_sigmas_and_the_strokes_not_once_more(session, nothing_is_seen):
    made, warnings = placed(measured(session, (0.06, 0.0, 0.0)))
    assert not warnings and any("rig.toml, by 3 free strokes" in note for note in made.notes)
    T_camera_old, T_camera_new = (c["one"].T_camera_rig for c in (CAMERAS, made.cameras))
    centre_mm = compose(invert_transform(T_camera_old), T_camera_new)[:, 3]
    # T_rig_board has it at 0 ± 0.065 mm (0.03 mm, and 1 mrad at the board's 59 mm), rig.toml at 0.06 ± 0.04 mm: 0.043 mm
    # by these alone; the turns, which both know, move that by less than the spread of the two.
    assert centre_mm[0] == pytest.approx(0.043, abs=0.015)
    assert np.sqrt(made.cameras.placement[3, 3]) < 0.04


def test_alone_the_cameras_stand_where_it_had_them_calibrated(session, nothing_is_seen):
    made, warnings = placed(replace(measured(session), T_rig_board=None))
    assert made.cameras is CAMERAS and not warnings


def test_a_contradiction_is_a_warning_of_the_run(session, nothing_is_seen):
    _, (warning,) = placed(measured(session, (0.0, 0.8, 0.0)))
    assert warning.codes == ("rig_file_contradicts",)


def test_check_says_what_places_the_rig_and_how_well(session):
    exact = replace(session, T_rig_board_sigma_mm=0.0, T_rig_board_sigma_rad=0.0)
    assert place_line(exact) == "placed by T_rig_board, taken as exact"
    assert "± 0.03 mm and ± 0.0573 degrees" in place_line(session)
    assert "both count" in place_line(measured(session))
    alone = place_line(replace(measured(session), T_rig_board=None))
    assert "± 0.0400 mm along the whisker" in alone and "3 free strokes" in alone
    assert "whisker-bench calibrate rig" in place_line(replace(session, T_rig_board=None))
