"""A camera that shows another scene than the rig picture is left out, and named why; uneven exposure is made good."""

import numpy as np
import pytest

from bench.base.results import hash_of
from bench.cameras.session_cameras import SessionCalibration
from bench.session.frame_times import frame_times, read_trial
from bench.session.session import load_session
from bench.trials.still_scene import evenly_exposed, still_scene
from tests.scenes.faults import FAULTS, TRIAL
from vision.pictures.files import read_picture


def scene_of(folder):
    """The small session's trial by its two cameras, each with three frames; corners of the rig board are not asked."""
    session = load_session(folder)
    rig = {name: read_picture(path) for name, path in session.rig_pictures.items()}
    calibration = SessionCalibration(None, rig, hash_of("none"))
    trial = session.trial(TRIAL)
    times = frame_times(trial)
    return still_scene(session, calibration, read_trial(trial, times, [0, 5, 10]))


def test_a_sound_trial_is_as_recorded(small_session):
    scene = scene_of(small_session)
    assert (scene.left_out, scene.notes) == ({}, ())
    assert list(scene.frames) == ["high", "low"]


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        (
            "camera knocked 6,4 px",
            "the scene lies +6, +4 px from where the rig picture has it, so it was moved",
        ),
        ("camera mirrored", "its frames are mirrored left to right"),
        ("camera black", "its frames show nothing, they are all of one grey"),
        ("camera damaged", "none of its frames can be read"),
        ("camera white", "its frames show nothing, they are all of one grey"),
    ],
)
def test_a_camera_that_shows_another_scene_is_left_out(small_copy, fault, expected):
    FAULTS[fault](small_copy)
    left_out = scene_of(small_copy).left_out
    assert list(left_out) == ["low"]
    assert left_out["low"].startswith(f"camera low was left out: {expected}")


def test_a_camera_that_is_known_to_stand_is_not_asked_whether_it_moved(small_session, monkeypatch):
    session = load_session(small_session)
    trial = session.trial(TRIAL)
    frames = read_trial(trial, frame_times(trial), [0, 5, 10])
    rig = {name: read_picture(path) for name, path in session.rig_pictures.items()}
    calibration = SessionCalibration(None, rig, hash_of("none"))

    def all_moved(session, calibration, frames):
        return dict.fromkeys(frames, "moved")

    monkeypatch.setattr("bench.cameras.session_cameras.moved_cameras", all_moved)
    assert still_scene(session, calibration, frames).left_out == {"high": "moved", "low": "moved"}
    assert still_scene(session, calibration, frames, ["high"]).left_out == {"low": "moved"}


def test_cameras_exchanged(small_copy):
    FAULTS["cameras exchanged"](small_copy)
    assert scene_of(small_copy).left_out == {
        "high": "camera high was left out: its frames are those of camera low",
        "low": "camera low was left out: its frames are those of camera high",
    }


def series(gains, rng):
    scene = rng.uniform(30.0, 140.0, size=(120, 160))
    return {
        k: np.clip(np.rint(gain * scene), 0, 255).astype(np.uint8) for k, gain in enumerate(gains)
    }


def test_exposure_is_made_good(rng):
    pictures = series([1.0, 1.0, 1.0, 1.1, 0.7], rng)
    even, lines, lost = evenly_exposed("low", pictures)
    assert not lost
    assert lines == [
        "camera low: 2 of 5 frames are 0.700 to 1.100 times as bright as most, made good (from frame 3 on)"
    ]
    for grey in even.values():
        np.testing.assert_allclose(grey, pictures[0].astype(float), atol=1.3)


def test_exposure_far_off_is_left_out(rng):
    even, corrected, (line,) = evenly_exposed("low", series([1.0, 1.0, 1.0, 1.5], rng))
    assert sorted(even) == [0, 1, 2] and not corrected
    assert "1 of 4 frames is 1.50 times as bright as most, left out (frame 3)" in line
    assert line.codes == ("exposure_changed",)


@pytest.mark.parametrize(
    ("gains", "which"),
    [
        ([1, 1, 1, 1.3, 1.3], "from frame 3 on"),
        ([1.3, 1.3, 1, 1, 1], "up to frame 1"),
        ([1, 1.3, 1, 1.3, 1], "frames 1, 3"),
    ],
)
def test_light_that_changes_names_its_frames(rng, gains, which):
    _, _, (line,) = evenly_exposed("low", series(gains, rng))
    assert f"2 of 5 frames are 1.30 times as bright as most, left out ({which})" in line


def test_even_exposure_is_left_alone(rng):
    pictures = series([1.0, 1.02, 0.99, 1.0], rng)
    assert evenly_exposed("low", pictures) == (pictures, [], [])
