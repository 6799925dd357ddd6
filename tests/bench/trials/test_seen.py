"""What the pictures' side of a run says of lost frames, and what it takes for background where no rig picture is."""

import numpy as np

from bench.cameras.session_cameras import _background
from bench.session.frame_times import frame_times, read_trial
from bench.session.session import load_session
from bench.trials.seen import _missing_frames
from vision.pictures.files import read_picture


def test_damaged_frames_are_counted_and_named(small_copy):
    folder = small_copy / "trials" / "b60_4" / "low"
    third = sorted(folder.iterdir())[2]
    data = third.read_bytes()
    third.unlink()  # the copy may share its file with the fixture
    third.write_bytes(data[: len(data) // 2][:40])
    trial = next(t for t in load_session(small_copy).trials if t.name == "b60_4")
    times = frame_times(trial)
    assert list(_missing_frames(read_trial(trial, times), times)) == [
        f"camera low: 1 of {len(times)} frames damaged (2)"
    ]


def test_without_a_rig_picture_the_trials_median_is_the_background(small_session, monkeypatch):
    """Where neither rod ever stands, the median is the rig picture but for noise and light."""
    session = load_session(small_session)
    monkeypatch.setattr("bench.cameras.session_cameras._FEWEST_FOR_MEDIAN", 3)
    rig = read_picture(session.rig_pictures["high"]).astype(float)
    session.rig_pictures.clear()
    median = _background(session, "high")
    corner = np.s_[:150, :150]
    assert abs(np.median(median[corner] - rig[corner])) < 2.0


def test_too_few_trials_leave_no_background(small_session):
    session = load_session(small_session)
    session.rig_pictures.clear()
    assert _background(session, "high") is None
