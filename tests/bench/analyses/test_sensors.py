"""sensors.csv and the summary's lines: a session with a load cell, simulated, evaluated, judged sensor by sensor."""

import csv

import numpy as np
import pytest

from bench.analyses.table_i_sensors import SENSORS
from bench.base.settings import Settings
from bench.rig.simulation import simulate
from bench.workflows.session_evaluation import evaluate
from tests.scenes.rig_sessions import protocol_file

PROTOCOL = """
[gauges]
known = true
[load_cell]
[pictures]
step_deg = 1.5
[[trials]]
beta_deg = [5, 60]
d_x_mm = 55.0
friction = 0.3
"""


@pytest.fixture
def run(tmp_path, exact_vision):
    """Folder of the evaluated session, seen exactly."""
    session = simulate(
        tmp_path / "six", protocol=protocol_file(tmp_path, PROTOCOL), signals_only=True, seed=2
    )
    settings = Settings(figures=False, estimators=("estimator.sensors:moment_rate",))
    evaluate(session, tmp_path / "out", settings, workers=0, announce=lambda text: None)
    return tmp_path / "out"


def rows(path) -> list[dict]:
    return list(csv.DictReader(path.read_text().splitlines()))


def test_each_sensor_is_judged_by_slope(run):
    """Friction assumed 10° and 16.7° in truth: at 60° that is worth some 10 % to an angle and moments, and nothing to
    force and moment; a touch alone is off by what it does not know."""
    table = {
        (row["estimator"], float(row["beta_from_deg"])): row for row in rows(run / SENSORS.file)
    }
    assert {slope for _, slope in table} == {0.0, 52.5}
    errors = {key: float(row["error_rms_percent"]) for key, row in table.items()}
    assert errors["with_friction", 52.5] > 8.0 > 2.0 > errors["force_and_moment", 52.5]
    assert errors["no_slip", 52.5] > 50.0
    assert errors["touch_alone", 0.0] == pytest.approx(100 * 5 / 55, abs=2.0)
    assert all(
        float(row["inside_percent"]) == 100.0
        for (name, _), row in table.items()
        if name == "force_and_moment"
    )
    text = (run / "summary.txt").read_text()
    assert "Sensors of Table I" in text and "force and moment" in text and SENSORS.file in text
    page = (
        (run / "report.html").read_text().split('<section id="together">')[1].split("</section>")[0]
    )
    assert f"<td>{errors['with_friction', 52.5]:.1f} <span" in page and "tilts.csv" in page


def test_they_stand_beside_the_other_estimates(run):
    """One's own choice of them, too, which is asked at every pushing angle."""
    table = rows(run / "estimates.csv")
    names = [row["estimator"] for row in table if row["trial"] == table[0]["trial"]]
    assert {
        "touch_alone",
        "moment_rate",
        "force_and_moment",
        "estimator.sensors:moment_rate",
    } <= set(names)
    same = [float(row["d_x_est_mm"]) for row in table if "moment_rate" in row["estimator"]]
    assert same[0::2] == pytest.approx(same[1::2])
    by_theta = [row for row in rows(run / "against_theta.csv") if "moment_rate" in row["estimator"]]
    assert np.array([int(row["whisks"]) for row in by_theta]).sum() > 10


def test_without_a_load_cell_there_is_nothing_to_say(exact_run):
    assert rows(exact_run / SENSORS.file) == []
    assert "Sensors of Table I" not in (exact_run / "summary.txt").read_text()


def test_newtons_that_go_with_the_wires_stiffness_are_in_the_sigma(tmp_path, exact_vision):
    """Gauges fitted to a wire whose modulus is known to 2 % and a load cell disagree by that; (2) does not feel it."""
    text = PROTOCOL.replace("known = true", "known = false").replace(
        "beta_deg = [5, 60]", "beta_deg = 5"
    )
    text += (
        '[[trials]]\npurpose = "gauge"\n'
        + '[[trials]]\npurpose = "gauge"\nfollicle_roll_deg = 90.0\n'
    )
    session = simulate(
        tmp_path / "six", protocol=protocol_file(tmp_path, text), signals_only=True, seed=2
    )
    manifest = session / "session.toml"
    stated = manifest.read_text().replace("[whisker]", "[whisker]\nyoungs_modulus_sigma_GPa = 1.2")
    manifest.write_text(stated)
    evaluate(
        session, tmp_path / "out", Settings(figures=False), workers=0, announce=lambda text: None
    )
    table = {
        row["estimator"]: row
        for row in rows(tmp_path / "out" / "estimates.csv")
        if "b05" in row["trial"]
    }
    shares = {
        name: float(row["d_x_est_sigma_mm"]) / float(row["d_x_est_mm"])
        for name, row in table.items()
    }
    of_gauges = shares[
        "no_slip"
    ]  # moments with their gauges' own sigma, which force and moment have, too
    assert of_gauges < 0.015
    assert 0.02 < shares["force_and_moment"] < np.hypot(0.021, of_gauges) + 0.005
