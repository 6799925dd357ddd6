"""A session of traces without pictures: what places the object, and what is wrong with its files."""

import csv
import shutil

import cv2
import numpy as np
import pytest

from bench.base.input_problems import InputProblems
from bench.base.settings import Settings
from bench.base.toml_text import read_toml
from bench.cameras.session_cameras import calibrate_session
from bench.session.abilities import abilities
from bench.session.session_check import checked_session
from bench.session.signals import forward_strokes, read_signals
from bench.session.trial import PLACE_UNCHECKED
from bench.trials.seen import see_trial
from bench.trials.stated_truth import stated_whisk
from bench.trials.trial_frames import TrialInputs
from tests.scenes.refusals import refusal
from tests.scenes.traced_example import BRING, Example, csv_of_points, tracked_bar, true_axis
from vision.geometry.rotation import apply, invert_transform

PLACES_MM = (-15.0, 20.0)


@pytest.fixture(scope="module")
def points():
    """By camera, the text of object_<camera>.csv."""
    tracked = tracked_bar(Example(), PLACES_MM)
    return {camera: csv_of_points(trace) for camera, trace in tracked.items()}


@pytest.fixture
def alone(tmp_path):
    """A copy of the worked example without pictures of its trial."""
    session = shutil.copytree(BRING, tmp_path / "traces")
    for camera in ("high", "low"):
        shutil.rmtree(trial_of(session) / camera)
    return session


def trial_of(session):
    return next((session / "trials").iterdir())


def add_points(session, points):
    for camera, text in points.items():
        (trial_of(session) / f"object_{camera}.csv").write_text(text)


def add_points_and_joints(session, points):
    """One camera's points of the bar in a file of their own, the other's as joints in its tracker's table."""
    add_points(session, {"high": points["high"]})
    rows = csv.DictReader(points["low"].splitlines())
    cells = [f",{row['u_px']},{row['v_px']},1" for row in rows]
    table = trial_of(session) / "trace_low.csv"
    scorer, joints, axes, *frames = table.read_text().splitlines()
    lines = [
        scorer + 6 * ",tracker",
        joints + 3 * ",bar_top" + 3 * ",bar_low",
        axes + 2 * ",x,y,likelihood",
    ]
    lines += [frame + top + low for frame, top, low in zip(frames, cells[::2], cells[1::2])]
    table.write_text("\n".join(lines) + "\n")


def state_place(session):
    """Let a stage say where the object of a trial stands: its axis where it passes the height of the base."""
    with (session / "session.toml").open("a") as manifest:
        manifest.write('\n[truth]\nsource = "stage"\n')
    with (trial_of(session) / "trial.toml").open("a") as manifest:
        manifest.write("\n[object]\npoint_mm = [57.58, 6.69, 0.0]\npoint_sigma_mm = 0.02\n")


def show_board(session):
    """Let pictures of the board on the rig be those of a board that is fixed to the bar."""
    manifest = read_toml(session / "session.toml", "session.toml")
    T_board_rig = invert_transform(np.array(manifest["rig"]["T_rig_board"]))
    truth = read_toml(trial_of(session) / "truth.toml", "truth.toml")
    axis = true_axis(truth)
    (point_mm,) = apply(T_board_rig, axis.point_mm[None])
    direction = T_board_rig[:, :3] @ axis.direction
    for camera in ("high", "low"):
        picture = session / "boards" / "rig" / f"{camera}.jpg"
        shutil.copy(picture, trial_of(session) / f"board_{camera}.jpg")
    with (trial_of(session) / "trial.toml").open("a") as file:
        file.write(f"\n[object]\nboard_point_mm = {point_mm.tolist()}\n")
        file.write(f"board_point_sigma_mm = 0.05\nboard_axis = {direction.tolist()}\n")


@pytest.mark.parametrize("way", ["points", "stage", "board"])
def test_traces_alone_give_the_truth(alone, points, way, tmp_path):
    """With points of the object, its place by a stage, or pictures of a board on it."""
    ways = {"points": add_points_and_joints, "stage": state_place, "board": show_board}
    ways[way](alone, *[points] * (way == "points"))
    problems = InputProblems()
    session = checked_session(alone, problems)
    assert [ability.count for ability in abilities(session)[:3]] == [1, 1, 1]
    (trial,) = session.trials
    calibration = calibrate_session(session, tmp_path / "out")
    inputs = TrialInputs(session, trial, read_signals(trial), calibration, Settings())
    seen = see_trial(inputs)
    drawn, *unchecked = seen.notes
    assert drawn == "the wire's lines are another program's (high, low), and no picture was read"
    assert unchecked == [PLACE_UNCHECKED] * (way != "points")
    assert problems.notes == [f"trials/{trial.name}: {note}" for note in unchecked]
    truth = read_toml(trial.folder / "truth.toml", "truth.toml")
    (whisk,) = seen.whisks
    assert not whisk.overlay
    assert abs(whisk.d_x_mm.value - truth["d_x_mm"]) < 2.0 * whisk.d_x_mm.sigma < 0.5
    at = whisk.at
    assert abs(at.slip_mm.value - truth["slip_at_3deg_mm"]) < 3.0 * at.slip_mm.sigma


def test_pictures_that_show_no_board_are_refused(alone):
    show_board(alone)
    picture = trial_of(alone) / "board_low.jpg"
    cv2.imwrite(str(picture), np.full((360, 640), 120, np.uint8))
    assert "board_low.jpg: shows no board of session.toml" in refusal(alone)
    picture.write_bytes(b"no picture")
    assert "board_low.jpg: cannot be read as a picture" in refusal(alone)


def test_a_board_picture_of_another_size_leaves_the_list_of_problems_whole(alone):
    """It is one line of them, where a part of that picture is a camera."""
    show_board(alone)
    (trial_of(alone) / "signals.csv").write_text("none\n")
    manifest = alone / "session.toml"
    part = '{ name = "part", of = "low", crop = [0, 0, 640, 100] }'
    text = manifest.read_text().replace("cameras = [", f"cameras = [\n    {part},")
    manifest.write_text(text)
    picture = trial_of(alone) / "board_low.jpg"
    cv2.imwrite(str(picture), np.full((180, 320), 120, np.uint8))
    problems = InputProblems(stop_at_first=False)
    checked_session(alone, problems)
    signals, line = problems.refusals
    assert "signals.csv" in signals
    assert "board_low.jpg: board_low.jpg is 320 x 180 px, the others are 640 x 360 px" in line


def test_nothing_that_places_the_object_is_refused_with_what_to_do(alone):
    line = refusal(alone)
    assert line.startswith(f"trials/{trial_of(alone).name}/trace_high.csv: there are no pictures")
    assert "object_<camera>.csv" in line and '[truth] source = "stage"' in line


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: (t / "frames.csv").unlink(), "frames.csv: is missing; traces without pictures"),
        (
            lambda t: (t / "object_low.csv").write_text("frame,u_px,v_px\n13,1,1\n"),
            "object_low.csv: frame 13 is not there; frames.csv has 13 rows, counted from 0",
        ),
        (
            lambda t: (t / "object_low.csv").write_text("frame,x,y\n0,1,1\n"),
            "object_low.csv, row 1: column u_px is missing",
        ),
        (
            lambda t: (t / "object_low.csv").write_text("frame,u_px,v_px\n0,900,1\n1,1,900\n"),
            "100% of its points are outside the picture of camera low",
        ),
        (lambda t: (t / "object_low.csv").rename(t / "object_low.txt"), "of no kind that is read"),
        (
            lambda t: (t / "object_low.csv").rename(t / "object_lwo.csv"),
            "object_lwo.csv: there is no camera lwo; there are high, low",
        ),
        (
            lambda t: (t / "trace_low.csv").rename(t / "trace_lwo.csv"),
            "cameras.toml: has no camera lwo; it has high, low",
        ),
        (
            lambda t: (t / "trial.toml").open("a").write("object_gives_way = true\n"),
            "traces without pictures need an object that stands",
        ),
        (
            lambda t: (t / "trial.toml").open("a").write('[object]\nshape = "sphere"\n'),
            "traces without pictures need a straight bar",
        ),
    ],
)
def test_faults_are_named(alone, points, change, said):
    add_points(alone, points)
    change(trial_of(alone))
    assert said in refusal(alone)


def test_points_of_one_camera_place_no_bar(alone, points):
    add_points(alone, points)
    (trial_of(alone) / "object_low.csv").unlink()
    distance, *_ = abilities(checked_session(alone))
    assert distance.count == 0 and "in a second camera" in distance.missing


def test_a_stage_gives_the_truth_once_the_traces_are_taken_out(alone):
    state_place(alone)
    for path in trial_of(alone).glob("trace_*"):
        path.unlink()
    session = checked_session(alone)
    distance, slope, seen, *_ = abilities(session)
    assert (distance.count, slope.count, seen.count) == (1, 1, 0)
    signals = read_signals(session.trials[0])
    stroke = forward_strokes(signals)[0]
    d_x_mm = stated_whisk(session, session.trials[0], signals, stroke).truth.d_x_mm
    true_mm = read_toml(trial_of(alone) / "truth.toml", "truth.toml")["d_x_mm"]
    assert abs(d_x_mm.value - true_mm) < 2.0 * d_x_mm.sigma < 1.0, (d_x_mm, true_mm)
    assert np.isfinite(d_x_mm.sigma)
