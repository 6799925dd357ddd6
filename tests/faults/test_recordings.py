"""Faults in signals.csv, frames.csv and the pictures: each one clear line with file, row and cure."""

import re

import cv2
import numpy as np
import pytest

from bench.base.input_problems import InputProblems
from bench.session.footage import read_frames
from bench.session.frame_times import frame_times
from bench.session.session import load_session
from bench.session.session_check import checked_session, find_damage
from bench.session.signals import forward_strokes, read_signals
from tests.scenes.refusals import refusal

TRIAL = "b30_3"


@pytest.fixture
def signals(session):
    return session / "trials" / TRIAL / "signals.csv"


@pytest.fixture
def frames(session):
    return session / "trials" / TRIAL / "frames.csv"


def notes(session) -> list[str]:
    problems = InputProblems()
    checked_session(session, problems)
    return problems.warnings


def trial(session):
    return load_session(session).trial(TRIAL)


def with_row(file, row: int, text: str) -> None:
    """Replace one row; rows count from 1, the header's."""
    lines = file.read_text().splitlines()
    lines[row - 1] = text
    file.write_text("\n".join(lines) + "\n")


def with_column(file, name: str, change) -> None:
    """Apply `change` to a column's values."""
    header, *lines = file.read_text().splitlines()
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    at = header.split(",").index(name)
    rows[:, at] = change(rows[:, at])
    file.write_text(
        "\n".join([header, *(",".join(f"{cell:.9g}" for cell in row) for row in rows)]) + "\n"
    )


@pytest.mark.parametrize(
    ("row", "text", "expected"),
    [
        (
            7,
            "0.0025,0.775,text,0.1",
            r"signals.csv, row 7, column y_V: 'text' is not a finite number",
        ),
        (7, "0.0025,0.775,nan,0.1", r"row 7, column y_V: 'nan' is not a finite number"),
        (7, "0.0025,0.775,0.1,inf", r"row 7, column z_V: 'inf' is not a finite number"),
        (7, "0.0025,0.775,,0.1", r"row 7, column y_V: is empty"),
        (7, "", r"row 7: is empty"),
        (7, "0.0025,0.775,0.1", r"row 7: has 3 values, the header names 4"),
        (7, "0,0025,0,775,0,1,0,1", r"row 7: has 8 values, the header names 4\. Decimal commas\?"),
        (7, '"0,0025","0,775","0,1","0,1"', r"row 7, column time_s: '0,0025' has a decimal comma"),
        (7, "0.0025;0.775;0.1;0.1", r"row 7: values are separated by semicolons"),
        (7, "0.0015,0.775,0.1,0.1", r"row 7, column time_s: goes back from 0.002 to 0.0015"),
        (7, "0.0020,0.775,0.1,0.1", r"row 7, column time_s: 0.002 comes twice"),
        (1, "time_s;motor_deg;y_V;z_V", r"columns are separated by semicolons; export with commas"),
        (1, "time_s\tmotor_deg\ty_V\tz_V", r"columns are separated by tabs"),
        (
            1,
            "time_s,motor_rad,y_V,z_V",
            r"row 1: column motor_deg is missing; found 'motor_rad' \(names carry units\)",
        ),
        (1, "time_s,motor_deg,y_V,m_z_Nmm", r"has volts and moments"),
        (1, "time_s,motor_deg,y_V,y_V", r"a column is named twice"),
        (1, "0.0000,0.750,-0.02139,-0.03153", r"row 1: the first row must name the columns"),
    ],
)
def test_fault_in_a_row_of_signals(session, signals, row, text, expected):
    with_row(signals, row, text)
    assert re.search(
        rf"^trials/{TRIAL}/signals.csv.*{expected.removeprefix('signals.csv')}", refusal(session)
    )


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("", "signals.csv: is empty"),
        ("time_s,motor_deg,y_V,z_V\n", "signals.csv: has a header and no rows"),
        ("time_s,motor_deg,y_V,z_V\n0,0,0,0\n", "signals.csv: has one row"),
    ],
)
def test_signals_without_content(session, signals, content, expected):
    signals.write_text(content)
    assert expected in refusal(session)


def test_utf16_from_a_spreadsheet(session, signals):
    signals.write_bytes(signals.read_text().encode("utf-16"))
    assert "is not UTF-8 text" in refusal(session)


def test_bom_crlf_and_trailing_empty_rows_are_taken(session, signals):
    before = read_signals(trial(session))
    text = signals.read_text() + "\n\n"
    signals.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    after = read_signals(trial(session))
    np.testing.assert_array_equal(after.y, before.y)
    np.testing.assert_array_equal(after.time_s, before.time_s)


def test_identical_duplicates_are_dropped_and_counted(session, signals):
    lines = signals.read_text().splitlines()
    signals.write_text("\n".join([*lines[:10], lines[9], *lines[10:]]) + "\n")
    read = read_signals(trial(session))
    assert dict(read.dropped) == {"duplicate rows": 1}
    assert len(read.time_s) == len(lines) - 1
    assert any("1 duplicate rows" in note for note in notes(session))


def test_motor_in_radians_is_refused_with_a_hint(session, signals):
    with_column(signals, "motor_deg", np.radians)
    assert re.search(r"motor_deg spans 0.108. Is it in radians\?", refusal(session))


def test_motor_in_radians_is_seen_without_a_stated_speed_too(session, signals):
    with_column(signals, "motor_deg", np.radians)
    manifest = signals.with_name("trial.toml")
    manifest.write_text(manifest.read_text().replace("speed_deg_s = 10.0", ""))
    assert re.search(r"motor_deg spans 0.108. Is it in radians\?", refusal(session))


def test_motor_in_encoder_counts_is_refused(session, signals):
    with_column(signals, "motor_deg", lambda angle: angle * 1000)
    assert "Is it in encoder counts?" in refusal(session)


def test_gauges_in_millivolts_are_refused_with_a_hint(session, signals):
    with_column(signals, "z_V", lambda volts: volts * 1000)
    assert re.search(r"the largest z_V is \d+.*millivolts", refusal(session))


def test_times_in_milliseconds_are_refused_with_a_hint(session, signals):
    with_column(signals, "time_s", lambda time: time * 1000)
    assert re.search(r"step of time_s is 0.5;.*milliseconds", refusal(session))


def test_another_speed_than_stated_is_a_note(session):
    manifest = session / "trials" / TRIAL / "trial.toml"
    manifest.write_text(manifest.read_text().replace("speed_deg_s = 10.0", "speed_deg_s = 90.0"))
    assert notes(session) == [
        f"trials/{TRIAL}/signals.csv: the motor goes at 10°/s, speed_deg_s says 90"
    ]


def test_a_motor_that_stands_still_is_a_note(session, signals):
    with_column(signals, "motor_deg", np.zeros_like)
    assert any("the motor stands still" in note for note in notes(session))
    assert forward_strokes(read_signals(trial(session))) == ()


def test_encoder_wraps_are_mended_and_counted(session, signals):
    plain = read_signals(trial(session))
    with_column(signals, "motor_deg", lambda angle: (angle + 357.0) % 360.0)
    wrapped = read_signals(trial(session))
    assert dict(wrapped.dropped) == {"encoder wraps": 1}
    np.testing.assert_allclose(wrapped.motor_rad - plain.motor_rad, np.radians(357.0), atol=1e-9)


def test_frames_and_rows_differ_in_number(session, frames):
    lines = frames.read_text().splitlines()
    frames.write_text("\n".join(lines[:-1]) + "\n")
    assert re.search(
        rf"trials/{TRIAL}/frames.csv: has 10 rows, camera high has 11 frames", refusal(session)
    )


@pytest.mark.parametrize(
    ("row", "text", "expected"),
    [
        (5, "3,0.1", r"frames.csv, row 5, column time_s: goes back from 0.1005 to 0.1"),
        (5, "2,0.1505", r"frames.csv, row 5, column frame: 2 comes twice; frame numbers"),
        (5, "3,", r"frames.csv, row 5, column time_s: is empty"),
        (1, "frame,time_ms", r"frames.csv, row 1: column time_s is missing"),
    ],
)
def test_fault_in_a_row_of_frames(session, frames, row, text, expected):
    with_row(frames, row, text)
    assert re.search(expected, refusal(session))


def test_frame_times_in_milliseconds(session, frames):
    with_column(frames, "time_s", lambda time: time * 1000)
    assert "Are the frames' times in milliseconds?" in refusal(session)


def test_frame_times_of_another_clock(session, frames):
    with_column(frames, "time_s", lambda time: time + 1e6)
    assert "They must be times of one clock" in refusal(session)


def test_no_frame_times_at_all(session, frames):
    frames.unlink()
    assert re.search(
        rf"trials/{TRIAL}/frames.csv: there are no frame times; write frames.csv", refusal(session)
    )


def replace_picture(file, grey: np.ndarray) -> None:
    file.unlink()
    assert cv2.imwrite(str(file), grey)


def test_pictures_of_another_size(session):
    replace_picture(
        session / "trials" / TRIAL / "low" / "000003.jpg", np.zeros((480, 640), np.uint8)
    )
    expected = (
        rf"trials/{TRIAL}/low/000003.jpg: is 640 x 480 px, but boards/low/00.jpg is 1280 x 720 px"
    )
    assert re.search(expected, refusal(session))


def test_an_undecodable_picture_keeps_its_place(session):
    low = session / "trials" / TRIAL / "low"
    whole = (low / "000003.jpg").read_bytes()
    (low / "000003.jpg").unlink()
    (low / "000003.jpg").write_bytes(whole[: len(whole) // 2])
    frames = read_frames(low, range(11))
    assert [index for index, grey in frames.items() if grey is None] == [3]
    assert len(frames) == len(frame_times(trial(session))) == 11
    problems = InputProblems()
    find_damage(checked_session(session, problems), problems)
    assert problems.warnings == [
        f"trials/{TRIAL}/low: frame 3 cannot be read (damaged or cut short)"
    ]


def test_a_video_in_place_of_pictures_is_taken(session, as_video):
    video, pictures = as_video(session / "trials" / TRIAL / "low", ".mkv", "FFV1")
    assert notes(session) == []
    frames = read_frames(video, range(len(pictures)))
    assert all((frames[k] == picture).all() for k, picture in enumerate(pictures))


def test_a_truncated_video_gives_damaged_frames(session, as_video):
    video, pictures = as_video(session / "trials" / TRIAL / "low", ".avi", "MJPG")
    data = video.read_bytes()
    video.write_bytes(data[: int(0.6 * len(data))])
    problems = InputProblems()
    loaded = checked_session(session, problems)
    find_damage(loaded, problems)
    frames = read_frames(video, range(len(pictures)))
    lost = [index for index, grey in frames.items() if grey is None]
    assert len(frames) == len(pictures)
    assert lost == list(range(lost[0], len(pictures)))
    assert any(
        note.startswith(f"trials/{TRIAL}/low.avi: frame {lost[0]}") for note in problems.warnings
    )


def test_a_video_that_does_not_open_is_the_trials_trouble(session, as_video):
    video, pictures = as_video(session / "trials" / TRIAL / "low", ".mp4", "mp4v")
    video.write_bytes(video.read_bytes()[:20000])
    assert notes(session) == [
        f"trials/{TRIAL}/low.mp4: the video cannot be opened: truncated or damaged",
    ]
    assert set(read_frames(video, range(len(pictures))).values()) == {None}
