"""`check` finds in seconds what `evaluate` would refuse or warn of after a minute."""

import re
import shutil

import cv2
import numpy as np
import pytest

from bench.base.input_problems import InputProblems
from bench.session.frame_times import FrameTimes
from bench.session.session import load_session
from bench.session.session_check import checked_session, find_damage
from bench.workflows.preflight import check, check_cameras, check_contents
from tests.scenes.faults import FAULTS, TRIAL, change_picture


def found(folder, *, boards=False) -> InputProblems:
    """What a look ahead says of a session; of its boards only where asked, which takes some seconds."""
    problems = InputProblems(stop_at_first=False)
    session = checked_session(folder, problems)
    if boards:
        check_cameras(session, problems)
    check_contents(session, problems)
    return problems


def test_a_sound_session(small_session):
    problems = found(small_session, boards=True)
    assert (problems.refusals, problems.warnings) == ([], [])


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        ("dead gauge", "channel z reads 0 V throughout: at its rail, or not connected"),
        ("saturated gauges", "channel y is at its rail for 50 % of a stroke"),
        (
            "camera knocked 6,4 px",
            "camera low: the scene lies +6, +4 px from where the rig picture has it",
        ),
        ("camera mirrored", "camera low: its frames are mirrored left to right"),
        ("cameras exchanged", "camera high: its frames are those of camera low"),
        ("camera black", "camera low: its frames show nothing"),
        ("exposure 1.5 from frame 6", "times as bright as most, left out"),
    ],
)
def test_a_fault_of_a_trial(small_copy, fault, expected):
    FAULTS[fault](small_copy)
    notes = found(small_copy).warnings
    assert any(note.startswith(f"trials/{TRIAL}: ") and expected in note for note in notes), notes


def test_a_dropped_frame_is_a_note(small_copy):
    """evaluate has it among its notes, too."""
    FAULTS["frame dropped"](small_copy)
    problems = found(small_copy)
    said = f"trials/{TRIAL}: whisk 0: 1 frame dropped by all cameras (after 0.150 s)"
    assert (problems.notes, problems.warnings) == ([said], [])


@pytest.mark.parametrize(("unit", "is_told"), [("N·mm", False), ("N·m", True)])
def test_moments_in_another_unit(small_copy, unit, is_told):
    """evaluate says the same by the shape that is seen."""
    (small_copy / "gauges.toml").write_text(
        "offset_V = [0.0, 0.0]\nmatrix_Nmm_per_V = [[11.3, 0.3], [-0.2, 10.5]]\n"
    )
    FAULTS["moments in N m" if is_told else "moments in N mm"](small_copy)
    told = [note for note in found(small_copy).warnings if "Is it in N·m?" in note]
    assert len(told) == is_told


def test_gauges_brought_along_to_a_session_without_its_whisker(small_copy):
    """What gauges.toml rests on cannot be looked up; that the whisker is missing is said, and nothing else."""
    manifest = small_copy / "session.toml"
    without = re.sub(r"(?ms)^\[whisker\].*?(?=^\[)", "", manifest.read_text())
    manifest.write_text(without)
    (small_copy / "gauges.toml").write_text(
        "offset_V = [0.0, 0.0]\nmatrix_Nmm_per_V = [[11.3, 0.3], [-0.2, 10.5]]\n"
    )
    assert found(small_copy).refusals == ["session.toml: [whisker] is missing"]


def test_a_rig_picture_out_of_focus(small_copy):
    rig = small_copy / "boards" / "rig" / "low.png"
    change_picture(rig, lambda grey: cv2.GaussianBlur(grey, (0, 0), 1.5))
    (line,) = [
        note
        for note in found(small_copy, boards=True).warnings
        if note.startswith("boards/rig/low.png")
    ]
    assert float(line.split("blurred by ")[1].split(" px")[0]) == pytest.approx(
        np.hypot(1.5, 0.8), abs=0.1
    )


def test_a_session_without_trials(steel_signals, tmp_path, capsys):
    """evaluate refuses it in the same words."""
    shutil.copyfile(steel_signals / "session.toml", tmp_path / "session.toml")
    (tmp_path / "trials").mkdir()
    assert check(tmp_path) == 2
    assert capsys.readouterr().out.splitlines()[0] == "error: trials: there is no trial to evaluate"


def test_signals_of_another_trial(small_copy):
    FAULTS["another trial's signals"](small_copy)
    said = "trials b30_3, b60_4 have the same signals.csv: all but one of them hold a copy"
    assert said in found(small_copy).warnings


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        ("lens boards exchanged, unsaid", "boards/high and boards/low are exchanged"),
        ("rig board hidden", "camera low: 0 corners of the board on the rig are seen"),
    ],
)
def test_boards_that_calibrate_no_cameras(small_copy, fault, expected):
    FAULTS[fault](small_copy)
    (refusal,) = found(small_copy, boards=True).refusals
    assert refusal.startswith(f"boards: {expected}")


def test_gauge_trials_that_push_in_one_direction(small_copy):
    shutil.rmtree(small_copy / "trials" / "gauge_roll90")
    (note,) = found(small_copy).warnings
    assert note.startswith(
        "trials: the gauge trials push in one direction, which does not fix both channels; record"
    )


def test_a_gauge_trial_that_cannot_be_read_is_the_only_cause(small_copy):
    """Which way it pushes is not known: the others need not push in one direction."""
    signals = small_copy / "trials" / "gauge_roll90" / "signals.csv"
    signals.write_text(signals.read_text().replace("y_V", "y_mV"))
    problems = found(small_copy)
    assert len(problems.refusals) == 1 and problems.warnings == []


def test_pictures_of_a_camera_that_cannot_be_read_are_named_once(small_copy):
    for picture in (small_copy / "trials" / TRIAL / "low").iterdir():
        picture.write_bytes(b"")
    problems = found(small_copy)
    find_damage(load_session(small_copy), problems)
    assert [str(line) for line in problems.warnings] == [
        f"trials/{TRIAL}/low: no picture in low can be read (11 found)"
    ]


@pytest.mark.parametrize("boards", [True, False])  # without, as where cameras are brought along
def test_a_rig_picture_that_cannot_be_read(small_copy, boards):
    (small_copy / "boards" / "rig" / "low.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    assert set(found(small_copy, boards=boards).refusals) == {
        "boards/rig/low.png: cannot be read as a picture"
    }


@pytest.mark.parametrize("lost", [[], [4], [4, 5], [2, 7]])
def test_frames_between_the_times_are_counted(lost):
    time_s = np.delete(0.05 * np.arange(12), lost)
    found = FrameTimes(time_s, "frames.csv", {}).lost_in(slice(None))
    assert sum(count for _, count in found) == len(lost)
