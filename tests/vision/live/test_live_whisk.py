"""A whisk that is evaluated while it is recorded has the truth of one that is evaluated after it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.scenes.recorded import RODS, Recorded
from vision.geometry.centreline import REST_POWERS
from vision.geometry.reasons import NO_REASON
from vision.live.whisk import LiveBench, LiveWhisk
from vision.truth.line_source import EarlierWhisk

# [sigmas] Allowed between two readings of the same pictures, and of errors against the truth.
ONE, MOST = 1.0, 3.0
# [sigmas] Allowed between two slopes: the bar's line is of the first frames alone, or of all.
TWO = 2.0
# [steps] After the last frame: its bend and its line.
LAST_STEPS = 2
# [mm] A pixel on this bench: both searches end within half of one (`vision.touched.search`).
PIXEL_MM = 0.1


@pytest.fixture(scope="module")
def recorded(small_session):
    return Recorded(small_session, "b30_3")


@pytest.fixture(scope="module")
def after(recorded):
    """The truth by the whole recording."""
    return recorded.see()


def begun(recorded):
    """A whisk to be recorded."""
    motor_rad = np.radians(recorded.rows["motor_deg"])
    stroke_rad = (float(motor_rad.min()), float(motor_rad.max()))
    return LiveWhisk(LiveBench(recorded.cameras, RODS, recorded.background, stroke_rad))


def add(live, recorded, frame, number=None):
    """Feed a frame of all cameras, by its own number or another."""
    number = frame if number is None else number
    time_s = float(recorded.rows["time_s"][frame])
    motor_rad = float(np.radians(recorded.rows["motor_deg"][frame]))
    for name, pictures in recorded.frames.items():
        live.add(name, number, time_s, motor_rad, pictures[frame])


def steps(live):
    """Do all that is due; the number of steps."""
    count = 0
    while live.work():
        count += 1
    return count


@pytest.fixture(scope="module")
def fed(recorded):
    """The truth by frames fed one at a time, and the steps after each."""
    live = begun(recorded)
    counts = []
    for frame in range(len(recorded.rows["time_s"])):
        add(live, recorded, frame)
        counts.append(steps(live))
    return live.finish(), counts


def assert_alike(one, other):
    """Within a sigma of each other, slopes within two: both rest on the same pixels of the wire."""
    for name, most in {"touch_rad": ONE, "d_x_mm": ONE, "beta_rad": TWO}.items():
        a, b = getattr(one, name), getattr(other, name)
        assert a.value == pytest.approx(b.value, abs=most * np.hypot(a.sigma, b.sigma)), name
    a, b = one.frames.slip_mm, other.frames.slip_mm
    assert abs(a.value[-1] - b.value[-1]) < ONE * np.hypot(a.sigma[-1], b.sigma[-1])


def test_the_truth_is_that_of_the_whole_recording(fed, after):
    assert fed[0].status == NO_REASON
    assert_alike(fed[0], after)


def test_errors_are_as_large_as_stated(fed, recorded):
    truth, written = fed[0], recorded.truth
    assert truth.d_x_mm.value == pytest.approx(written["d_x_mm"], abs=MOST * truth.d_x_mm.sigma)
    touch_rad = np.radians(written["touch_deg"])
    assert truth.touch_rad.value == pytest.approx(touch_rad, abs=MOST * truth.touch_rad.sigma)
    slip_mm = recorded.rows["slip_mm"][truth.frames.index[-1]]
    slip = truth.frames.slip_mm
    assert slip.value[-1] == pytest.approx(slip_mm, abs=MOST * slip.sigma[-1])


def test_little_is_left_after_the_last_frame(fed):
    """All that is costly is done by the first frames: the search, and the passes over wire and bar."""
    _, counts = fed
    assert counts[:2] == [0, 0]
    assert counts[4] == LAST_STEPS + 1  # the question where else the bar may be
    assert max(counts[3:4] + counts[5:]) <= LAST_STEPS


def test_frames_that_come_faster_than_they_are_worked_on_give_the_same(recorded, after):
    live = begun(recorded)
    for frame in range(len(recorded.rows["time_s"])):
        add(live, recorded, frame)
    assert_alike(live.finish(), after)


def test_all_that_is_costly_is_done_while_the_motor_stands(recorded, after):
    """Pictures of the whisker before it moves: a few are kept, and then a frame costs its bend and its line."""
    live = begun(recorded)
    rng = np.random.default_rng(11)
    motor_rad = float(np.radians(recorded.rows["motor_deg"][0]))
    for number in range(10):
        for name, pictures in recorded.frames.items():
            noisy = pictures[0] + 2.0 * rng.standard_normal(pictures[0].shape)
            picture = noisy.clip(0, 255).astype(np.uint8)
            live.add(name, number, 0.02 * number - 1.0, motor_rad, picture)
        steps(live)
    assert all(len(pictures) == 3 for pictures in live.frames.values())
    counts = []
    for frame in range(1, len(recorded.rows["time_s"])):
        add(live, recorded, frame, number=frame + 10)
        counts.append(steps(live))
    assert counts[1] == LAST_STEPS + 1  # the question where else the bar may be
    assert max(counts[:1] + counts[2:]) <= LAST_STEPS
    assert_alike(live.finish(), after)


def test_a_lost_frame_is_left_out(recorded, after):
    live = begun(recorded)
    for frame in range(len(recorded.rows["time_s"])):
        add(live, recorded, frame)
        if frame == 5:
            del live.frames["low"][frame]
        steps(live)
    truth = live.finish()
    assert 5 not in truth.frames.index
    assert_alike(truth, after)


def test_a_bar_that_is_not_there_is_said_at_once(recorded):
    """Three frames of the bench alone: nothing is waited for."""
    live = begun(recorded)
    rng = np.random.default_rng(7)
    for frame in range(3):
        for name, empty in recorded.background.items():
            noisy = empty + 2.0 * rng.standard_normal(empty.shape)
            live.add(name, frame, 0.05 * frame, 0.01 * frame, noisy.clip(0, 255).astype(np.uint8))
    steps(live)
    assert live.refused is not None and live.refused.codes
    truth = live.finish()
    assert np.isnan(truth.d_x_mm.value) and truth.status.codes[0] == live.refused.codes[0]


def test_a_push_that_ends_before_touch_has_no_number(recorded):
    live = begun(recorded)
    for frame in np.flatnonzero(recorded.rows["contact"] == 0).tolist():
        add(live, recorded, frame)
    truth = live.finish()
    assert np.isnan(truth.d_x_mm.value) and "never_touches" in truth.status.codes


def test_too_few_frames_are_counted(recorded):
    live = begun(recorded)
    for frame in range(2):
        add(live, recorded, frame)
    assert live.finish().status.codes == ("too_few_frames",)


def found_bar(recorded, bar):
    """The bar in the first frames of a whisk, looked for where it was."""
    live = begun(recorded)
    if bar is not None:
        live.bench = replace(live.bench, earlier=EarlierWhisk(bar, np.zeros((2, REST_POWERS)), {}))
    for frame in range(3):
        add(live, recorded, frame)
    live.work()
    return live._found.bar


def test_a_bar_is_looked_for_where_it_was(recorded, monkeypatch):
    """Moved by a millimetre it is found without a search, as near as by one; 15 mm away by the search."""
    searched = found_bar(recorded, None).axis

    def apart_mm(axis):
        off = np.cross(axis.point_mm - searched.point_mm, searched.direction)
        return float(np.linalg.norm(off))

    assert apart_mm(found_bar(recorded, away(searched, 15.0)).axis) == 0.0
    monkeypatch.setattr("vision.touched.search.find_bars", None)  # a search would raise
    assert apart_mm(found_bar(recorded, away(searched, 1.0)).axis) < PIXEL_MM


def test_a_whisker_that_slipped_in_its_hub_since_the_whisk_before_is_searched_for(recorded):
    """Its rest shape is 6 mm off at the tip; there is no line there, and the whisk begins by itself."""
    searched = found_bar(recorded, None).axis
    live = begun(recorded)
    slipped_mm = np.zeros((2, REST_POWERS))
    slipped_mm[0, 1] = 6.0
    slipped = EarlierWhisk(searched, slipped_mm, {"high": 1.0, "low": 1.0})
    live.bench = replace(live.bench, earlier=slipped)
    for frame in range(3):
        add(live, recorded, frame)
    while live._reading is None and live.work():
        pass
    assert live.refused is None and live.bench.earlier is None
    assert np.all(np.abs(live._follower.rest_mm[:, 1]) < 1.0)


def away(axis, distance_mm):
    """An axis farther from the base."""
    return replace(axis, point_mm=axis.point_mm + np.array([distance_mm, 0.0, 0.0]))
