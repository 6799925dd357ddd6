"""A bar on springs: it is where the contact is, the force over its stiffness from its place, and trial.toml says so."""

import numpy as np
import pytest

from bench.rig.protocol import Protocol
from bench.rig.protocol_tables import TrialTable
from bench.rig.recording import Recording
from bench.rig.session_files import trial_toml
from bench.rig.truth_files import truth_csv

EXACTLY = {"beta_scatter_deg": 0.0, "d_x_scatter_mm": 0.0, "touch_scatter_deg": 0.0}


def recording(**trial) -> Recording:
    protocol = Protocol(trials=[TrialTable(**EXACTLY, **trial)])
    return Recording.make(*protocol.runs(), np.random.default_rng(5))


@pytest.mark.parametrize("beta_deg", [0.0, 40.0])
def test_the_bar_is_painted_where_the_contact_is(beta_deg):
    """Centreline to axis both radii, 3.5 mm, in each frame, and the bar across itself from where it stood."""
    made = recording(beta_deg=beta_deg, stiffness_N_mm=0.05)
    whisk, most = made.whisks[0], 0.0
    for _, motor, _, back in made.frames:
        gave, state = whisk.gave_mm(motor, back), whisk.path(back).state_at(motor)
        if state is None:
            assert not gave.any()
            continue
        there = made.bar.shift(gave)
        assert np.linalg.norm(state.point_mm - there.foot_mm(state.point_mm)) == pytest.approx(
            3.5, abs=2e-4
        )
        assert abs(gave @ made.bar.axis) < 1e-12
        most = max(most, np.linalg.norm(gave))
    assert most > 1.0


def test_what_is_written_of_it():
    soft, rigid = recording(stiffness_N_mm=0.05), recording()
    assert "object_gives_way = true" in trial_toml(soft) and "gives" not in trial_toml(rigid)
    head, *_, last = truth_csv(soft).splitlines()
    assert head.endswith("gave_mm") and float(last.rpartition(",")[2]) > 1.0
    assert "gave_mm" not in truth_csv(rigid)
