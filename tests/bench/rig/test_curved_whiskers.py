"""Curved whiskers on a bar: marched as straight ones in the limit, where the protocol wants them, and drawn."""

import math
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.rig.bar import find_first_touch
from bench.rig.elastic_rod import RestShape, Rod
from bench.rig.linear import rotate_about_z
from bench.rig.protocol import load
from bench.rig.recording import Recording
from bench.rig.rod_contact import moments_Nmm
from bench.rig.simulation import simulate
from bench.session.session import load_session
from tests.scenes.marches import touched_bar, whisk

STRAIGHT = Rod("cylinder", 100.0, 1.0, 60.0)


@pytest.mark.parametrize("beta", [20.0, 60.0])
def test_a_set_of_a_nanometre_changes_nothing(beta):
    """The planar elastica and the rod in space are two solvers of one whisk: moments within 1e-6, and
    within what 1 nm moves."""
    bent = replace(STRAIGHT, rest=RestShape(100.0, set_y_mm=1e-6))
    thetas = np.arange(0.25, 4.01, 0.25)
    plane, space = (whisk(thetas, rod=rod, beta=beta)[2][-1] for rod in (STRAIGHT, bent))
    assert moments_Nmm(space) == pytest.approx(moments_Nmm(plane), rel=1e-6)
    assert space.arc_mm == pytest.approx(plane.arc_mm, abs=1e-5)


def test_a_hair_that_turns_the_other_way_is_its_mirror_image():
    """Mirrored in z = 0, set and slope change sign, and with them m_y; m_z does not."""
    ends = []
    for sign in (1, -1):
        rod = replace(STRAIGHT, rest=RestShape(100.0, 0.0, -4.0, sign * 6.0))
        ends.append(whisk(np.arange(0.25, 3.01, 0.25), rod=rod, beta=sign * 40.0)[2][-1])
    m_y, m_z = moments_Nmm(ends[0])
    assert moments_Nmm(ends[1]) == pytest.approx((-m_y, m_z), rel=1e-6)


@pytest.mark.parametrize("name", ["nitinol", "thin-wire", "polymer-cone", "vibrissa"])
def test_each_kind_of_whisker_meets_its_bar_where_the_protocol_wants(name):
    """Without scatter. A hair that is aslant meets the bar beside its foremost line: d_x within 1 %, touch
    within 0.2°."""
    protocol = load(name)
    run = protocol.runs()[-1]
    exact = {key: 0.0 for key in run.table.__struct_fields__ if "scatter" in key}
    run = msgspec.structs.replace(run, table=msgspec.structs.replace(run.table, **exact))
    recording = Recording.make(run, np.random.default_rng(1))
    assert recording.touch.d_x_mm == pytest.approx(run.d_x_mm, rel=0.01)
    assert math.degrees(recording.touch.motor_rad) == pytest.approx(2.3, abs=0.2)
    whisk = recording.whisks[0]
    state = whisk.forward.states[-1]
    drawn = whisk.centreline_mm(state.motor_rad, state, np.array([state.arc_mm]))[0]
    assert drawn == pytest.approx(state.point_mm, abs=1e-6)


def test_a_traced_vibrissa_is_stated_as_it_is(tmp_path):
    protocol = tmp_path / "one.toml"
    protocol.write_text(
        "[whisker]\nset_y_mm = -3.0\nset_z_mm = -4.0\nstates_rest = true\n[[trials]]\n"
    )
    simulate(tmp_path / "session", protocol=protocol, signals_only=True)
    wire = load_session(tmp_path / "session").whisker.wire
    assert wire.rest_mm[0] == pytest.approx([0.0, 0.0, -3.0], abs=1e-5)
    assert wire.rest_mm[1] == pytest.approx([0.0, 0.0, -4.0], abs=1e-5)


def test_an_unloaded_whisker_that_turns_back_is_refused_in_one_line(tmp_path):
    protocol = tmp_path / "coil.toml"
    protocol.write_text("[whisker]\nset_y_mm = 60.0\n[[trials]]\n")
    with pytest.raises(BadInput, match=r"coil\.toml: sag_mm, set_y_mm.*would turn back"):
        simulate(tmp_path / "session", protocol=protocol)


def test_a_touch_on_the_far_side_of_the_bar_is_refused():
    """From a guess behind the bar, the root of the gap is where the whisker leaves it."""
    bar, _ = touched_bar(STRAIGHT, 60.0, radius_mm=1.0)
    behind = bar.shift(rotate_about_z([0.0, -6.0, 0.0], 0.0))
    with pytest.raises(ArithmeticError, match="never touches"):
        find_first_touch(STRAIGHT, behind, 0.0, 60.0)
    assert find_first_touch(STRAIGHT, behind, -0.12, 60.0).motor_rad == pytest.approx(
        -0.1, abs=0.01
    )
