"""Several whiskers before one bar: each feels what it would feel alone."""

import math

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.rig import build
from bench.rig.array_rig import ArrayRecording, find_touch_from_afar, mount_whiskers
from bench.rig.bar import TouchedBar, find_first_touch
from bench.rig.protocol import Protocol
from bench.rig.protocol_tables import ColumnTable, TrialTable
from bench.rig.recording import Recording
from bench.rig.simulation import simulate
from tests.scenes.rig_sessions import protocol_file

TRIAL = TrialTable(
    beta_deg=40.0, d_x_mm=55.0, beta_scatter_deg=0.0, d_x_scatter_mm=0.0, touch_scatter_deg=0.0
)
QUIET = {"noise_V": 0.0, "hum_V": 0.0, "adc_bits": 0}


def protocol(**column) -> Protocol:
    table = ColumnTable(**{"heights_mm": [0.0], "gauge_scatter": 0.0} | column)
    plain = Protocol(trials=[TRIAL], columns=[table])
    quiet = {key: getattr(plain.gauges, key) for key in plain.gauges.__struct_fields__} | QUIET
    return Protocol(trials=[TRIAL], columns=[table], gauges=type(plain.gauges)(**quiet))


def recorded(made: Protocol) -> ArrayRecording:
    whiskers = mount_whiskers(made, np.random.default_rng(0))
    rngs = [np.random.default_rng(k) for k in range(1 + len(whiskers))]
    return ArrayRecording.make(*made.runs(), whiskers, rngs)


def test_one_whisker_at_the_origin_feels_what_it_feels_alone():
    """Its march stops at other frames, and moments lie on straight lines between instants 0.1° apart: over a bend of
    1 % a degree of a slope of 0.1 V a degree that is 1e-6 V."""
    made = protocol()
    alone = Recording.make(*made.runs(), np.random.default_rng(0))
    array = recorded(made)
    assert array.recordings["w1"].touch.motor_rad == pytest.approx(alone.touch.motor_rad, abs=1e-12)
    for name, column in zip(("time_s", "motor_deg", "y_V@w1", "z_V@w1"), alone.signals.T):
        np.testing.assert_allclose(array.channels[name], column, atol=5e-6)


@pytest.mark.parametrize("base_deg", [(0.0, 0.0, 25.0), (10.0, -20.0, 160.0)])
def test_base_and_bar_moved_alike_leave_the_touch_as_it_is(base_deg):
    made = protocol(base_mm=(7.0, -11.0, 3.0), base_deg=base_deg)
    (whisker,), rod = mount_whiskers(made, np.random.default_rng(0)), build.rod(made)
    angles = {"beta_rad": 0.6, "psi_rad": 0.2, "touch_rad": 0.04}
    bar = TouchedBar.at_contact(d_x_mm=55.0, **angles, radius_mm=3.0, whisker_radius_mm=0.5)
    turn, shift = whisker.pose[:, :3], whisker.pose[:, 3]
    moved = TouchedBar(turn @ bar.point_mm + shift, turn @ bar.axis, bar.radius_mm)
    found = find_touch_from_afar(rod, moved.in_frame(whisker.pose), 0.0)
    expected = find_first_touch(rod, bar, 0.04, 55.0)
    assert found.motor_rad == pytest.approx(expected.motor_rad, abs=1e-9)
    np.testing.assert_allclose(found.point_mm, expected.point_mm, atol=1e-6)


def test_each_whisker_of_a_column_touches_where_the_bar_is_at_its_height():
    """A bar that leans by β towards +y is further on by h·tan β at height h; d_x is 55 mm and lean is small."""
    array = recorded(protocol(heights_mm=[-8.0, 0.0, 8.0]))
    touch = np.array([one.touch.motor_rad for one in array.recordings.values()])
    y = 55.0 * np.tan(touch - touch[1])
    expected = np.array([-8.0, 0.0, 8.0]) * math.tan(math.radians(40.0))
    np.testing.assert_allclose(y, expected, rtol=0.02, atol=1e-9)


def test_a_whisker_that_reaches_nothing_feels_nothing():
    array = recorded(protocol(heights_mm=[0.0, 8.0], length_mm=[100.0, 20.0]))
    assert array.recordings["w2"] is None
    assert np.ptp(array.channels["y_V@w2"]) < 1e-12 < np.ptp(array.channels["y_V@w1"])


def test_columns_move_motors_of_their_own():
    bases = {"a": (0.0, 0.0, 0.0), "b": (0.0, -20.0, 0.0)}
    columns = [
        ColumnTable(name=name, base_mm=base, heights_mm=[0.0]) for name, base in bases.items()
    ]
    array = recorded(Protocol(trials=[TRIAL], columns=columns))
    assert list(array.channels)[:2] == ["time_s", "motor_deg@a"] and "motor_deg@b" in array.channels
    starts = [array.channels[f"motor_deg@{name}"][0] for name in "ab"]
    touches = [math.degrees(array.recordings[f"{name}1"].touch.motor_rad) for name in "ab"]
    np.testing.assert_allclose(
        np.diff(starts), np.diff(touches), atol=0.006
    )  # a step of the encoder is 0.005°


@pytest.mark.parametrize(
    "text, said",
    [
        ("heights_mm = [0, 9]\nlength_mm = [90]", "length_mm has 1 values, heights_mm 2"),
        ("heights_mm = [0]\n[[columns]]\nheights_mm = [9]", "need names of their own"),
        ("heights_mm = []", "heights_mm"),
        ("heights_mm = [0]\nbase_mm = [60, 6, 0]", "whisker w1 stands in the bar before it moves"),
    ],
)
def test_what_the_rig_cannot_build_is_refused(tmp_path, text, said):
    made = protocol_file(tmp_path, f"[[trials]]\n[[columns]]\n{text}\n")
    with pytest.raises(BadInput) as refused:
        simulate(tmp_path / "s", protocol=made, signals_only=True)
    assert said in str(refused.value)
