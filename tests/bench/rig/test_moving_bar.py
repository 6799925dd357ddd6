"""A bar that moves at constant speed: where it is, what its friction does, what is written of it, what is refused."""

import tomllib

import msgspec
import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.rig.protocol import Protocol, load
from bench.rig.protocol_tables import TrialTable
from bench.rig.recording import Recording
from bench.rig.simulation import simulate
from tests.scenes.rig_sessions import protocol_file

EXACTLY = {"beta_scatter_deg": 0.0, "d_x_scatter_mm": 0.0, "touch_scatter_deg": 0.0}


def recording(velocity_mm_s, **trial) -> Recording:
    table = TrialTable(object_velocity_mm_s=velocity_mm_s, **EXACTLY, **trial)
    protocol = Protocol(trials=[table])
    return Recording.make(*protocol.runs(), np.random.default_rng(5))


@pytest.mark.parametrize("velocity", [(0.0, 2.0, 0.0), (1.5, -2.0, 1.0)])
def test_the_contact_stays_on_the_bar_where_it_is(velocity):
    """Centreline to axis both radii, 3.5 mm, at each instant; the bar goes on at its speed at 10°/s."""
    made = recording(velocity, beta_deg=30.0)
    for state in made.whisks[0].forward.states[1::9]:
        seconds = (state.motor_rad - made.touch.motor_rad) / np.radians(10.0)
        point = made.bar.point_mm + seconds * np.array(velocity)
        away = state.point_mm - point
        away -= (away @ made.bar.axis) * made.bar.axis
        assert np.linalg.norm(away) == pytest.approx(3.5, abs=1e-8)


def test_a_bar_that_moves_along_itself_drags_the_whisker():
    """At β = 0 a standing bar's force has no part along it; one that runs up or down takes the whisker along, until it
    slides: then by the friction angle."""
    alpha = np.degrees(np.arctan(0.3))
    for up, expected in ((5.0, alpha), (-5.0, -alpha), (0.0, 0.0)):
        m_y, m_z = recording((0.0, 0.0, up), friction=0.3).whisks[0].forward.moment_Nmm[-1]
        assert np.degrees(np.arctan2(m_y, m_z)) == pytest.approx(expected, abs=0.3)


def test_slip_is_over_the_bar():
    """A bar that slides under a whisker, which stays: slip is what went by, less what the whisker gave way."""
    made = recording((0.0, 0.0, -5.0), friction=0.05).whisks[0]
    end = made.forward
    went = 5.0 * (end.motor_rad[-1] - made.touch.motor_rad) / np.radians(10.0)
    moved = end.point_mm[-1, 2] - made.touch.point_mm[2]
    assert made.slip_mm(end.point_mm[-1], end.motor_rad[-1]) == pytest.approx(
        went + moved, abs=1e-9
    )


def test_what_is_stated_is_off_by_its_sigma(tmp_path):
    text = "[[trials]]\nobject_velocity_mm_s = [0, 2, 0]\nobject_velocity_sigma_mm_s = 0.2\n"
    session = simulate(tmp_path / "s", protocol=protocol_file(tmp_path, text), signals_only=True)
    (manifest,) = session.glob("trials/*/trial.toml")
    keys = tomllib.loads(manifest.read_text())
    off = np.array(keys["object_velocity_mm_s"]) - [0, 2, 0]
    assert keys["object_velocity_sigma_mm_s"] == 0.2 and 0 < np.abs(off).max() < 1.0


@pytest.mark.parametrize(
    "text, said",
    [
        ("object_velocity_mm_s = [0, 8, 0]", "5.24 is allowed"),
        ("object_velocity_mm_s = [0, 1, 0]\nwhisks = 2", "single forward strokes"),
        ("object_velocity_mm_s = [0, 1, 0]\nstiffness_N_mm = 1", "is rigid"),
    ],
)
def test_what_no_march_covers_is_refused(tmp_path, text, said):
    with pytest.raises(BadInput, match=said):
        load(protocol_file(tmp_path, f"[[trials]]\n{text}\n"))


def test_a_protocol_of_standing_bars_is_what_it_was():
    """Sessions that were simulated before go on where they stopped."""
    written = msgspec.json.encode(load("quick"))
    assert b"object_velocity" not in written and b"both_ways" not in written
