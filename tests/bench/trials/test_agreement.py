"""Felt moments against those of the seen shape: what stands out, with its likeliest cause, spoils no other whisk."""

from types import SimpleNamespace

import numpy as np
import pytest

from bench.base.settings import Settings
from bench.gauges.gauge_readings import Pairs
from bench.gauges.matrix import (
    FROM_ALL,
    FROM_FILE,
    FROM_TRIALS,
    GaugeCalibration,
    GaugeMatrix,
    to_follicle,
)
from bench.rig.simulation import simulate
from bench.trials.agreement import agreement, other_units
from bench.trials.differences import LEAST_CHANCE
from bench.trials.felt_trial import against_shape
from bench.trials.readout import Readout
from bench.workflows.session_evaluation import evaluate
from tests.scenes.results import codes, table

MATRIX = np.array([[11.3, 0.32], [-0.25, 10.5]])
GAUGES = GaugeMatrix(MATRIX, (0.003 * 11) ** 2 * np.eye(4))
THETA = np.radians([0.5, 1.5, 2.5, 3.5, 4.5])
PER_RAD = np.array([90.0, 120.0])  # N·mm/rad, at φ = 37°


def pairs(rng, spoil=None) -> Pairs:
    """A whisk whose channels are what `spoil` (2, 2) makes of sound ones, with noise as stated."""
    exact = np.outer(THETA, PER_RAD)
    n = 2 * len(THETA)
    of_moments, of_volts = (0.01**2 + 0.003**2) * np.eye(n), 0.001**2 * np.eye(n)
    volts = np.linalg.solve(MATRIX, exact.T).T + 0.001 * rng.normal(size=exact.shape)
    volts = volts if spoil is None else volts @ np.asarray(spoil).T
    moments = exact + 0.01 * rng.normal(size=exact.shape)
    nothing = np.full(2, np.nan)
    return Pairs("t", 0, 0.0, THETA, moments, of_moments, volts, of_volts, nothing, nothing, 0.001)


@pytest.mark.parametrize(
    "source, tells", [(FROM_TRIALS, True), (FROM_ALL, True), (FROM_FILE, False)]
)
def test_gauges_fitted_to_the_wire_agree_with_it_whatever_its_stiffness(rng, source, tells):
    """C cancels between such gauges and the seen shape: moments 5 % too large are a fault, however badly C is known.
    GaugeCalibration with newtons of their own may show another C."""
    wire = SimpleNamespace(C_Nmm2=9000.0, C_sigma_Nmm2=450.0)
    unit = SimpleNamespace(
        session=SimpleNamespace(whisker=wire), gauges=GaugeCalibration(GAUGES, source)
    )
    found = against_shape(unit, Readout(GAUGES, is_gauged=True), pairs(rng, 1.05 * np.eye(2)))
    assert (found.chance < LEAST_CHANCE) == tells


def turned(degrees):
    """What a follicle that is turned further makes of the volts."""
    return np.linalg.inv(MATRIX) @ to_follicle(np.radians(degrees)) @ MATRIX


@pytest.mark.parametrize(
    "spoil, said, value, within",
    [
        (np.eye(2)[::-1], "y_V and z_V look exchanged", None, 0),
        (np.diag([-1, 1]), "y_V looks reversed", None, 0),
        (np.diag([1, -1]), "z_V looks reversed", None, 0),
        (-np.eye(2), "y_V and z_V look reversed", None, 0),
        (np.diag([0.8, 1]), "gauge y_V looks slipped, it gives ", 80.0, 1.0),
        (np.diag([1, 0.9]), "gauge z_V looks slipped, it gives ", 90.0, 1.0),
        (turned(8.0), "the follicle looks turned by ", 8.0, 0.3),
        (np.eye(2) / 1.1, "the whisker looks ", 110.0, 1.0),
    ],
)
def test_what_stands_out_is_named(rng, spoil, said, value, within):
    found = agreement(pairs(rng, spoil), GAUGES)
    assert found.chance < LEAST_CHANCE
    assert found.cause.startswith(said) and found.cause in found.status
    if value is not None:
        assert float(found.cause.removeprefix(said).split()[0].strip("°%")) == pytest.approx(
            value, abs=within
        )


@pytest.mark.parametrize(
    ("factor", "is_gauged", "said"),
    [
        (1e3, True, "y_V and z_V look like millivolts"),
        (1e-3, True, "the gauges' factors look like N·m per volt"),
        (1e-3, False, "m_y_Nmm and m_z_Nmm look like N·m: multiply them by 1000"),
        (1e3, False, "m_y_Nmm and m_z_Nmm look like N·µm: multiply them by 0.001"),
        (1e6, False, "m_y_Nmm and m_z_Nmm look like nN·m: multiply them by 1e-06"),
    ],
)
def test_a_factor_of_a_thousand_is_a_unit(rng, factor, is_gauged, said):
    """Beside it a gauge may have slipped by a tenth, which is said once the unit is right."""
    spoilt = pairs(rng, factor * np.diag([0.9, 1.0]))
    found = agreement(spoilt, GAUGES, others=other_units(GAUGES, is_gauged))
    assert found.is_explained and found.cause.startswith(said)


def test_a_fault_of_a_gauge_is_no_unit(rng):
    for spoil in (np.diag([-1, 1]), np.diag([0.2, 1]), np.eye(2) / 3.0, np.eye(2)[::-1]):
        found = agreement(pairs(rng, spoil), GAUGES, others=other_units(GAUGES, is_gauged=True))
        assert "look like" not in found.cause


def test_volts_named_moments_are_told_by_the_session_s_gauges(rng):
    """Recorded as moments, they are read without gauges: a tenth of what the whisker gives."""
    wire = SimpleNamespace(C_Nmm2=9000.0, C_sigma_Nmm2=0.0)
    unit = SimpleNamespace(
        session=SimpleNamespace(whisker=wire), gauges=GaugeCalibration(GAUGES, FROM_FILE)
    )
    found = against_shape(unit, Readout.bare(), pairs(rng))
    assert found.cause == "m_y_Nmm and m_z_Nmm look like the gauges' volts: name them y_V and z_V"


def test_what_no_gauge_does_may_be_another_trials_signals(rng):
    """Half the force from another side: y and z both change, each by a factor of its own."""
    assert "another trial's signals" in agreement(pairs(rng, np.diag([0.4, 1.3])), GAUGES).cause


def test_a_gauge_that_begins_to_drift_at_touch_is_told(rng):
    """0.17 V/s at 10°/s: in one whisk a drift that goes on is no other than a gauge that gives more."""
    drifting = pairs(rng)
    drifting.volts[:, 0] += 0.17 * THETA / np.radians(10.0)
    found = agreement(drifting, GAUGES)
    assert found.chance < LEAST_CHANCE and found.cause.endswith(
        "or drifts while the whisker pushes"
    )


def test_sound_whisks_agree_as_often_as_chance_allows(rng):
    """χ² of 2 degrees of freedom over 400 whisks whose errors are as stated, gauges' and distance's included."""
    root = np.linalg.cholesky(GAUGES.covariance)
    found = []
    for _ in range(400):
        one = pairs(rng)
        felt = GaugeMatrix(MATRIX + (root @ rng.normal(size=4)).reshape(2, 2), GAUGES.covariance)
        one.moments[:] *= 1.0 + one.scale_sigma * rng.normal()
        found.append(agreement(one, felt).chance)
    assert np.mean(np.array(found) < 0.05) == pytest.approx(
        0.05, abs=3 * np.sqrt(0.05 * 0.95 / 400)
    )
    assert agreement(pairs(rng), GAUGES).status == ""


PROTOCOL = """
[whisker]
shape = "{shape}"
[[trials]]
purpose = "gauge"
d_x_mm = 50.0
[[trials]]
purpose = "gauge"
d_x_mm = 50.0
follicle_roll_deg = 90.0
[[trials]]
beta_deg = [30, 45, 60]
d_x_mm = 55.0
"""


@pytest.mark.parametrize("shape", ["cylinder", "cone"])
def test_exchanged_channels_in_one_trial_are_found_and_spoil_no_other(
    tmp_path, exact_vision, shape
):
    (tmp_path / "p.toml").write_text(PROTOCOL.format(shape=shape))
    session = simulate(
        tmp_path / "session", protocol=str(tmp_path / "p.toml"), signals_only=True, seed=4
    )
    evaluate(session, tmp_path / "sound", Settings(), workers=0)
    assert {
        r["status"]
        for r in table(tmp_path / "sound" / "whisks.csv")
        if r["trial"].startswith("steel")
    } == {""}
    (trial,) = (session / "trials").glob("steel_b45*")
    signals = trial / "signals.csv"
    signals.write_text(signals.read_text().replace("y_V,z_V", "z_V,y_V", 1))
    evaluate(session, tmp_path / "out", Settings(), workers=0)
    status = {r["trial"]: r["status"] for r in table(tmp_path / "out" / "whisks.csv")}
    faulty = {name for name in status if "gauge_fault" in codes(tmp_path / "out", name)}
    assert faulty == {trial.name} and "y_V and z_V look exchanged" in status[trial.name]
    (sound,), (spoilt,) = (table(tmp_path / out / "surfaces.csv") for out in ("sound", "out"))
    alphas = [float(s["alpha_least_squares_deg"]) for s in (sound, spoilt)]
    assert alphas[1] == pytest.approx(alphas[0], abs=0.5)
    assert float(spoilt["alpha_felt_deg"]) == pytest.approx(float(sound["alpha_felt_deg"]), abs=0.5)


def test_signals_of_two_trials_exchanged_are_told_from_a_fault_of_one(tmp_path, exact_vision):
    (tmp_path / "p.toml").write_text(PROTOCOL.format(shape="cylinder"))
    session = simulate(
        tmp_path / "session", protocol=str(tmp_path / "p.toml"), signals_only=True, seed=4
    )
    one, other = (
        next((session / "trials").glob(f"steel_b{slope}*")) / "signals.csv" for slope in (30, 60)
    )
    texts = one.read_text(), other.read_text()
    for file, text in zip((other, one), texts):
        file.write_text(text)
    evaluate(session, tmp_path / "out", Settings(), workers=0)
    names = f"{one.parent.name} and {other.parent.name}"
    assert (
        f"the signals of trials {names} look exchanged"
        in (tmp_path / "out" / "summary.txt").read_text()
    )
    one.write_text(texts[0].replace("y_V,z_V", "z_V,y_V", 1))
    other.write_text(texts[1].replace("y_V,z_V", "z_V,y_V", 1))
    evaluate(session, tmp_path / "both", Settings(), workers=0)
    assert "look exchanged: each" not in (tmp_path / "both" / "summary.txt").read_text()
