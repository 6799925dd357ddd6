"""A stroke there and back: friction on both ways, stick and slip, contact at the tip."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from bench.rig.loading import quasi_static_Nmm
from bench.rig.protocol import load
from bench.rig.recording import Recording
from bench.rig.simulation import simulate
from bench.rig.stroke import Stroke
from bench.rig.whisk_mechanics import ContactPath
from tests.scenes.rig_sessions import protocol_file, rows

WAYS = """
[whisker]
length_mm = 100.0
[pictures]
step_deg = 0.05
back_stroke = true
[[trials]]
name = "teeth"
beta_deg = 60
beta_scatter_deg = 0
friction = 0.18
static_friction = 0.25
[[trials]]
name = "smooth"
beta_deg = 60
beta_scatter_deg = 0
friction = 0.18
"""


@pytest.fixture(scope="module")
def ways(tmp_path_factory):
    """Rows of truth.csv of both trials, a frame each 0.05° there and back; no pictures are taken."""
    folder = tmp_path_factory.mktemp("ways")
    session = simulate(
        folder / "session", protocol=protocol_file(folder, WAYS), seed=3, signals_only=True
    )
    return {f.name.split("_")[0]: rows(f / "truth.csv") for f in (session / "trials").iterdir()}


def column(table, name):
    return np.array([float(row[name]) for row in table])


def test_truth_goes_there_and_back(ways):
    for table in ways.values():
        motor, contact = column(table, "motor_deg"), column(table, "contact")
        assert len(table) == 2 * 125 - 1
        assert (np.diff(column(table, "time_s")) > 0).all()
        assert motor == pytest.approx(motor[::-1], abs=2e-6)
        assert (contact == contact[::-1]).all()
        assert {row["status"] for row, c in zip(table, contact) if not c} == {"free"}


def test_friction_holds_slip_and_moment_back_on_both_ways(ways):
    """Pushed in, friction points against the slip; on the way back the other way, so that more slip is left at the
    same angle, and φ is larger by twice the friction angle where it slides.
    """
    table = [r for r in ways["smooth"] if r["contact"] == "1"]
    half = len(table) // 2
    slip, phi = (
        column(table, "slip_mm"),
        np.degrees(np.arctan2(column(table, "m_y_Nmm"), column(table, "m_z_Nmm"))),
    )
    up, down = slip[:half], slip[:half:-1]
    assert (down[10:] > up[10:] + 1e-4).all()
    alpha_deg = math.degrees(math.atan(0.18))
    assert phi[half // 2] == pytest.approx(60 - alpha_deg, abs=0.5)
    assert phi[-10] == pytest.approx(60 + alpha_deg, abs=2.0)


@pytest.mark.parametrize("back", [False, True])
def test_the_whisker_that_is_drawn_touches_where_truth_says(back, tmp_path):
    """On both ways its centreline runs through the contact point, at frames and between them."""
    protocol = load(protocol_file(tmp_path, WAYS))
    recording = Recording.make(protocol.runs()[0], np.random.default_rng(2))
    whisk, way = recording.whisks[0], recording.whisks[0].path(back)
    frames = [
        motor
        for _, motor, _, b in recording.frames
        if b == back and way.state_at(motor) is not None
    ]
    assert len(frames) > 80
    for motor in frames[::5]:
        state = way.state_at(motor)
        assert way.state_between(motor) is state or way.state_between(
            motor
        ).force_hub_N == pytest.approx(state.force_hub_N, rel=1e-9)
        (point,) = whisk.centreline_mm(motor, way.state_between(motor), [state.arc_mm])
        assert point == pytest.approx(state.point_mm, abs=1e-8)
        between = motor + 1e-4
        if (aside := way.state_between(between)) is not None:
            (near,) = whisk.centreline_mm(between, aside, [aside.arc_mm])
            assert near == pytest.approx(point, abs=0.1)


def test_stick_slip_is_a_saw_tooth_in_truth(ways):
    """Held, the slip grows by no more than the contact rolls along the whisker, then jumps. Without static friction
    beyond the kinetic, each frame slips by much the same.
    """
    half = len(ways["teeth"]) // 2
    teeth, smooth = (
        [r for r in ways[n][:half] if r["contact"] == "1"] for n in ("teeth", "smooth")
    )
    steps, even = np.diff(column(teeth, "slip_mm"))[10:], np.diff(column(smooth, "slip_mm"))[10:]
    assert steps.sum() == pytest.approx(even.sum(), rel=0.1)
    assert even.max() < 1.3 * even.min()
    assert (steps < 0.1 * even.mean()).sum() > 20 and (steps > 1.5 * even.mean()).sum() > 20
    assert {"held", "sliding"} == {row["status"] for row in teeth}
    friction = np.array(
        [60 - math.degrees(math.atan2(float(r["m_y_Nmm"]), float(r["m_z_Nmm"]))) for r in teeth]
    )[10:]
    cones = [math.degrees(math.atan(mu)) for mu in (0.18, 0.25)]
    assert (
        cones[0] - 0.5 < friction.min() < cones[0] + 1
        and cones[1] - 1 < friction.max() < cones[1] + 0.5
    )


def test_tip_contact_and_letting_go_are_statuses(tmp_path):
    """At 99.9 mm of 100 the contact reaches the tip while pushed, and slides off; then nothing is felt."""
    text = """
[motor]
after_deg = 20.0
[pictures]
after_deg = 20.0
[[trials]]
beta_deg = 75
d_x_mm = 99.9
d_x_scatter_mm = 0
friction = 0.2
"""
    session = simulate(tmp_path / "s", protocol=protocol_file(tmp_path, text), signals_only=True)
    (folder,) = (session / "trials").iterdir()
    table = rows(folder / "truth.csv")
    statuses = [row["status"] for row in table]
    first, last = statuses.index("tip"), len(statuses) - 1 - statuses[::-1].index("tip")
    assert {"held", "sliding"} & set(statuses[:first]) and set(statuses[first : last + 1]) == {
        "tip"
    }
    assert set(statuses[last + 1 :]) == {"free"} and last + 1 < len(statuses)
    assert {row["arc_mm"] for row in table[first : last + 1]} == {"100.000000"}
    assert {(row["contact"], row["m_y_Nmm"], row["x_mm"]) for row in table[last + 1 :]} == {
        ("0", "0.000000", "nan")
    }


def test_a_sample_at_the_turn_belongs_to_the_forward_stroke():
    """Two steps of rounding after the turn are at the turn; a millisecond after it is not."""

    def path(moment_Nmm: float) -> ContactPath:
        moments = np.full((2, 2), moment_Nmm)
        points = np.zeros((2, 3))
        return ContactPath(np.array([0.0, 1.0]), points, np.zeros(2), moments, points, ())

    stroke = Stroke.plan(0.0, 1.0, 1.0, back=True)
    (_, turn_s), whisk = stroke.forward[0], SimpleNamespace(forward=path(1.0), back=path(2.0))
    times_s = turn_s + np.array([-1e-3, 0.0, 4e-16, 1e-3])
    moments = quasi_static_Nmm(stroke, [whisk], times_s)
    np.testing.assert_array_equal(moments[:, 0], [1.0, 1.0, 1.0, 2.0])
