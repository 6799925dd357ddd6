"""The force at the base: that of the exact rod, beside the gauges, with noise of its own."""

import msgspec
import numpy as np
import pytest

from bench.rig.force_sensor import sample_forces_N
from bench.rig.protocol import Protocol, load
from bench.rig.protocol_tables import GaugesTable, LoadCellTable, TrialTable
from bench.rig.recording import Recording
from bench.rig.simulation import simulate
from tests.scenes.rig_sessions import protocol_file
from tests.scenes.six_axes import pushed

QUIET = {
    "noise_N": 0.0,
    "hum_N": 0.0,
    "hum_Hz": 50.0,
    "drift_N_per_s": 0.0,
    "step_N": 0.0,
}
GAUGES = GaugesTable(filter_Hz=0.0, rate_Hz=2000.0)
TRIAL = TrialTable(beta_deg=40.0, d_x_mm=55.0)


def recording(**changes) -> Recording:
    protocol = Protocol(trials=[TRIAL], **changes)
    return Recording.make(*protocol.runs(), np.random.default_rng(5))


@pytest.mark.parametrize("beta_deg, alpha_deg", [(0.0, 20.0), (40.0, 10.0), (70.0, 5.0)])
def test_moment_is_that_of_the_force_at_the_contact(beta_deg, alpha_deg):
    """m = P × f of the base's force f: the rod carries no other load. Its component along the whisker is left out."""
    push = pushed(beta_deg=beta_deg, alpha_deg=alpha_deg)
    assert np.cross(push.point_hub_mm, push.force_N)[1:] == pytest.approx(push.moment_Nmm, rel=1e-9)


def test_a_load_cell_changes_nothing_of_the_gauges():
    plain, with_cell = recording(), recording(load_cell=LoadCellTable())
    assert with_cell.signals.shape[1] == 7
    np.testing.assert_array_equal(with_cell.signals[:, :4], plain.signals)


def test_noise_drift_and_steps_are_of_their_size():
    none, rng = np.zeros((80_000, 3)), np.random.default_rng(1)
    noisy = sample_forces_N(LoadCellTable(**QUIET | {"noise_N": 0.003}), GAUGES, none, rng)
    assert noisy.std(axis=0) == pytest.approx(np.full(3, 0.003), rel=0.03)
    drifting = sample_forces_N(LoadCellTable(**QUIET | {"drift_N_per_s": 0.01}), GAUGES, none, rng)
    assert np.abs(drifting).max() <= 0.01 * len(drifting) / 2000
    stepped = sample_forces_N(
        LoadCellTable(**QUIET | {"noise_N": 0.01, "step_N": 0.005}), GAUGES, none, rng
    )
    assert stepped / 0.005 == pytest.approx(np.rint(stepped / 0.005), abs=1e-9)


def test_columns_of_the_cell_stand_where_there_is_one(tmp_path):
    text = "[load_cell]\n[[trials]]\nbeta_deg = 20\n"
    session = simulate(tmp_path / "six", protocol=protocol_file(tmp_path, text), signals_only=True)
    (signals,) = session.glob("trials/*/signals.csv")
    assert signals.read_text().partition("\n")[0] == "time_s,motor_deg,y_V,z_V,f_x_N,f_y_N,f_z_N"


def test_a_protocol_without_a_cell_is_what_it_was():
    """Sessions that were simulated before go on where they stopped."""
    assert b"load_cell" not in msgspec.json.encode(load("quick"))
