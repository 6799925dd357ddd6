"""(10) at the kinetic ends of teeth: found in the moments alone, and only where there are any."""

import csv

import numpy as np
import pytest

from bench.base.settings import Settings
from bench.rig.simulation import simulate
from bench.workflows.session_evaluation import evaluate
from tests.scenes.rig_sessions import protocol_file

PROTOCOL = """
name = "teeth"
[gauges]
known = true
[friction]
irregular = 0.3
[motor]
before_deg = 3.0
[[trials]]
surface = "sandpaper"
beta_deg = [-50, 50]
friction = 0.34
static_friction = 0.43
d_x_scatter_mm = 0.0
[[trials]]
surface = "steel"
beta_deg = [0, 50]
friction = 0.34
"""
KINETIC_DEG = float(np.degrees(np.arctan(0.34)))


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    """estimates.csv by trial and estimator, α_est the kinetic angle; the manifest's slopes and distances taken away."""
    folder = tmp_path_factory.mktemp("teeth")
    session = simulate(
        folder / "session", protocol=protocol_file(folder, PROTOCOL), signals_only=True, seed=3
    )
    for path in session.glob("trials/*/trial.toml"):
        kept = [
            line
            for line in path.read_text().splitlines()
            if not line.startswith(("beta_deg", "d_x_mm"))
        ]
        path.write_text("\n".join(kept))
    evaluate(session, folder / "out", Settings(alpha_est_deg=KINETIC_DEG), workers=0)
    with (folder / "out" / "estimates.csv").open(newline="") as file:
        return {(row["trial"], row["estimator"]): row for row in csv.DictReader(file)}


@pytest.mark.parametrize("trial", ["sandpaper_b50_v10", "sandpaper_b-50_v10"])
def test_the_kinetic_end_has_the_kinetic_angle(rows, trial):
    """At β = 50° half a degree of α, the kinetic end's own sigma, is 1 %."""
    plain, kinetic = (
        float(rows[trial, f"with_friction{name}"]["d_x_est_mm"]) for name in ("", "_kinetic")
    )
    assert kinetic == pytest.approx(60.0, rel=0.02)
    assert plain - 60.0 > 2 * abs(kinetic - 60.0)


def test_a_contact_that_slides_or_rests_has_no_teeth(rows):
    assert not [
        key for key in rows if key[0].startswith("steel") and key[1] == "with_friction_kinetic"
    ]
