"""Where the rig is: free strokes against T_rig_board, and what becomes of the cameras."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.base.settings import Settings
from bench.base.statuses import reason
from bench.base.workers import Workers
from bench.cameras.session_cameras import SessionCalibration
from bench.records.trial_result import SeenTrial
from bench.session.session import load_session
from bench.trials.placing import place_rig
from bench.trials.unit import Unit
from tests.scenes.base_lines import some_lines
from tests.scenes.model_scenes import CAMERAS
from tests.scenes.results import seen_whisk
from vision.calibration.hub_turning import FirstRig

SMALL = Path(__file__).resolve().parents[3] / "fixtures" / "small-session"
T_RIG_BOARD = load_session(SMALL).T_rig_board
OFF = np.array(
    [0.0, 0.0, 0.0, 0.0, 0.8, 0.0]
)  # the centre 0.8 mm across the whisker from where the board has it


@pytest.fixture
def place(small_copy, monkeypatch):
    """A function (step of the true rig, T_rig_board's sigma in mm) that gives the placed calibration, the warnings and
    the stages at which trials were looked at."""

    def placed(step, sigma_mm=0.0, frames=30, width_deg=8.0, board=True):
        rng, stages, lines = np.random.default_rng(5), [], {}

        def see(unit):
            stages.append(unit.calibration_step)
            now = (
                unit.calibration.cameras["one"].T_camera_rig[:, 3]
                - CAMERAS["one"].T_camera_rig[:, 3]
            )
            left = step - np.append(np.zeros(3), CAMERAS["one"].T_camera_rig[:, :3].T @ now)
            made = some_lines(
                width_deg, left, across_mm=0.01, turn_rad=5e-4, frames=frames or 1, rng=rng
            )
            base = lines.setdefault(
                (unit.calibration_step, unit.trial.name), made if frames else None
            )
            return SeenTrial(
                (
                    seen_whisk(0, base=base),
                    seen_whisk(1),
                    seen_whisk(2, reason("no_pictures")),
                )
            )

        monkeypatch.setattr("bench.trials.lost.see_unit", see)
        session = replace(load_session(small_copy), T_rig_board_sigma_mm=sigma_mm)
        session = session if board else replace(session, T_rig_board=None)
        before = SessionCalibration(CAMERAS, {}, "before", ("calibrated",), session.T_rig_board)
        units = [Unit(session, t, "", before, Settings(), small_copy) for t in session.trials]
        problems = InputProblems()
        return (
            place_rig(session, before, units, Workers(0), problems),
            problems.warnings,
            set(stages),
        )

    return placed


def test_what_was_learnt_is_said_and_an_exact_board_stays(place):
    made, warnings, stages = place(0 * OFF)
    assert made.cameras is CAMERAS and made.hash == "before" and not warnings
    assert not made.placed_by
    assert stages == {
        "seen"
    }  # what was looked at is the trial's own result and is not looked at again
    assert any(
        "free strokes of 8.0 degrees give: centre of rotation ± " in note for note in made.notes
    )


def test_a_disagreement_is_an_alarm(place):
    made, warnings, _ = place(OFF)
    assert made.cameras is CAMERAS
    assert len(warnings) == 1 and warnings[0].codes == ("board_misplaced",)
    assert float(
        re.search(r"across the whisker by ([+-][0-9.]+)", warnings[0])[1]
    ) == pytest.approx(0.8, abs=0.02)


def test_an_axis_that_leans_along_the_whisker_may_be_a_frame_rate(place):
    """The trials state the speed at which their signals have the motor go."""
    lean = np.array([0.0, np.radians(9.0), 0.0, 0.0, 0.0, 0.0])
    _, (warning,), _ = place(lean, width_deg=20.0)
    assert "a whisker that turns 0.988 times as far as the motor" in warning
    assert warning.endswith("so the rate of the frames' times looks to need that factor")


def test_a_board_with_a_sigma_gives_way(place):
    made, warnings, stages = place(OFF, sigma_mm=0.5)
    assert not warnings and made.hash != "before" and stages == {"swing0", "swing1"}
    # its fits are those that the trials are fitted again from
    assert made.placed_by == "swing1" and len(set(made.hashes_before.values())) > 1
    moved = made.cameras["one"].T_camera_rig[:, 3] - CAMERAS["one"].T_camera_rig[:, 3]
    np.testing.assert_allclose(moved, CAMERAS["one"].T_camera_rig[:, :3] @ OFF[3:], atol=0.05)
    # The board on the rig has not moved in the pictures: it stands elsewhere in the rig's frame.
    before, after = (
        c.project(T[:, 3][None])
        for c, T in ((CAMERAS["one"], T_RIG_BOARD), (made.cameras["one"], made.T_rig_board))
    )
    np.testing.assert_allclose(after, before, atol=1e-6)


def test_strokes_too_short_to_tell_are_no_warning(place, monkeypatch):
    monkeypatch.setattr(
        "bench.trials.placing.first_look", None
    )  # which would decode every trial: not asked
    made, warnings, _ = place(OFF, frames=3)
    assert not warnings and "needs 4 frames" in made.notes[-1]


def test_where_no_stroke_can_be_read_what_turns_elsewhere_is_a_warning(place, monkeypatch):
    """A wrong square_mm has the wire looked for where it is not."""
    T = np.eye(3, 4)
    T[1, 3] = 12.0
    monkeypatch.setattr("bench.trials.placing.first_look", lambda *_: FirstRig(T, 0, 0))
    made, warnings, _ = place(OFF, frames=0)
    assert warnings[0].codes == ("board_misplaced",)
    assert "none of them can be read" in made.notes[-1]


def test_a_board_by_ruler_wants_strokes_wide_enough(place):
    _, (warning,), _ = place(0 * OFF, sigma_mm=2.0, width_deg=1.5)
    assert warning.codes == ("swing_narrow",)


def test_without_a_board_the_strokes_place_the_rig(place):
    """A first look may be off by millimetres; no alarm compares it with the strokes, and no board is weighed in."""
    made, warnings, _ = place(10 * OFF, board=False, width_deg=20.0)
    assert not warnings and not any("board" in note for note in made.notes[1:])
    moved = made.cameras["one"].T_camera_rig[:, 3] - CAMERAS["one"].T_camera_rig[:, 3]
    np.testing.assert_allclose(
        moved, CAMERAS["one"].T_camera_rig[:, :3] @ (10 * OFF[3:]), atol=0.05
    )


def test_without_a_board_narrow_strokes_are_refused(place):
    with pytest.raises(
        BadInput, match=r"trials: the free strokes are what places the rig, and 0\.1 degrees fix"
    ):
        place(0 * OFF, board=False, width_deg=0.15, frames=5)


def test_without_a_board_strokes_that_say_nothing_are_refused(place):
    with pytest.raises(
        BadInput, match=r"trials: T_rig_board is missing, and 3 frames of free stroke"
    ):
        place(0 * OFF, board=False, frames=3)
