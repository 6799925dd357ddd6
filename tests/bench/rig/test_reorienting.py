"""A plane that is turned between rotations: where it ends, what is written, and what is refused."""

import tomllib

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.rig.parts import Job
from bench.rig.protocol import load
from bench.rig.reorienting import turned_plane
from bench.rig.simulation import make_part, simulate
from bench.session.session import load_session

ALPHA_DEG = 10.0
PROTOCOL = """
name = "turning"
[gauges]
known = true
[[trials]]
beta_deg = [40]
d_x_mm = 60.0
friction = 0.17632698
beta_scatter_deg = 0.0
d_x_scatter_mm = 0.0
rotations = 3
"""


@pytest.fixture
def protocol(tmp_path):
    path = tmp_path / "turning.toml"
    path.write_text(PROTOCOL)
    return path


def test_after_one_turn_the_slope_is_the_friction_angle(protocol):
    """To 0.5°: of the signals' noise 0.15°, and of bending by 3° a part of it."""
    loaded = load(protocol)
    first, second, third = loaded.runs()
    assert turned_plane(first, np.random.default_rng).plane_turn_deg == 0.0
    turned = turned_plane(second, np.random.default_rng)
    assert turned.beta_deg == pytest.approx(ALPHA_DEG, abs=0.5)
    assert turned.beta_deg + turned.plane_turn_deg == 40.0
    assert abs(turned_plane(third, np.random.default_rng).beta_deg) < ALPHA_DEG + 0.5


def test_a_trial_says_what_was_turned_whatever_was_made_before_it(protocol, tmp_path):
    simulate(tmp_path / "one", protocol=protocol, signals_only=True)
    job = Job(tmp_path / "two", load(protocol), 0, True)
    for part in reversed(list(job.parts())):
        make_part(job, part)
    names = sorted(folder.name for folder in (tmp_path / "one" / "trials").iterdir())
    assert names == ["steel_b40_v10_r1", "steel_b40_v10_r2", "steel_b40_v10_r3"]
    for name in names:
        texts = [tmp_path / which / "trials" / name / "trial.toml" for which in ("one", "two")]
        first, second = (text.read_text() for text in texts)
        assert first == second
        assert tomllib.loads(first)["contact"] == "steel_b40_v10"


@pytest.mark.parametrize(
    "change, message",
    [
        (("d_x_scatter_mm = 0.0\n", ""), "against one object"),
        (("rotations = 3", "rotations = 3\nwhisks = 2"), "single forward strokes"),
        (("rotations = 3", "rotations = 0"), "rotations"),
    ],
)
def test_rotations_that_would_meet_another_contact_are_refused(protocol, change, message):
    protocol.write_text(PROTOCOL.replace(*change))
    with pytest.raises(BadInput, match=message):
        load(protocol)


def test_a_protocol_whose_truth_is_a_stage_states_distance_and_slope(tmp_path):
    path = tmp_path / "turning.toml"
    path.write_text("stage = true\n" + PROTOCOL)
    session = simulate(tmp_path / "session", protocol=path)
    assert load_session(session).truth.source == "stage"
    for trial in load_session(session).trials:
        recorded = tomllib.loads((trial.folder / "truth.toml").read_text())
        assert trial.d_x_mm == pytest.approx(recorded["d_x_mm"], abs=1e-6)
        assert trial.beta_deg == pytest.approx(recorded["beta_deg"], abs=1e-3)
        assert trial.d_x_sigma_mm == trial.beta_sigma_deg == 0.0
