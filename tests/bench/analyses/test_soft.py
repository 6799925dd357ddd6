"""Softness of an object from whisks at two distances: exact compliances, and a simulated session."""

import csv

import numpy as np
import pytest

from bench.analyses.soft import NO_PUSH, NOT_SOFT, Place, Softness, softness
from bench.base.settings import Settings
from bench.records.trial_result import TrialFacts
from bench.rig.simulation import simulate
from bench.session.whisker import Whisker
from bench.workflows.session_evaluation import evaluate
from estimator.compliance import compliance_on_soft_object
from tests.scenes.rig_sessions import protocol_file
from vision.truth.value import Value

WHISKER = Whisker(shape="cylinder", length_mm=100.0, diameter_mm=1.0, youngs_modulus_GPa=60.0)
FACTS = TrialFacts("soft", "measure", "sponge", 10.0)
NOTHING_SHARED, FRICTIONLESS = np.zeros(1), Value(0.0, 0.0)
PROTOCOL = """
name = "soft"
[gauges]
known = true
[[trials]]
surface = "sponge"
d_x_mm = [45.0, 65.0]
stiffness_N_mm = 0.3
beta_scatter_deg = 0.0
d_x_scatter_mm = 0.0
[[trials]]
surface = "steel"
d_x_mm = [45.0, 65.0]
beta_scatter_deg = 0.0
d_x_scatter_mm = 0.0
"""


def places(stiffness: float, sigma: float = 1e-6, whisker: Whisker = WHISKER) -> list[Place]:
    known = whisker.C_Nmm2, whisker.beam.taper / whisker.length_mm
    each = ((d, compliance_on_soft_object(d, stiffness, *known)) for d in (45.0, 65.0))
    return [Place(d, 0.0, float(k), sigma, 1, NOTHING_SHARED) for d, k in each]


@pytest.mark.parametrize("shape, tip", [("cylinder", None), ("cone", None), ("tapered", 0.4)])
def test_two_places_tell_the_stiffness_to_what_is_corrected(shape, tip):
    """At θ = 1e-4 what (2) leaves out is nothing."""
    whisker = Whisker(
        shape=shape, length_mm=100.0, diameter_mm=1.0, youngs_modulus_GPa=60.0, tip_diameter_mm=tip
    )
    found = softness(whisker, FACTS, *places(0.5, whisker=whisker), 1e-4, FRICTIONLESS)
    assert found.give_mm_N.value == pytest.approx(2.0, abs=1e-3)
    k, low, high = found.stiffness_N_mm
    assert low < k < high and k == pytest.approx(0.5, rel=1e-3)
    assert found.d_x_mm.value == pytest.approx(45.0, abs=1e-2)


def test_a_rigid_object_is_only_stiffer_than_something():
    found = softness(WHISKER, FACTS, *places(np.inf, sigma=2e-5), 1e-4, FRICTIONLESS)
    assert found.status == NOT_SOFT
    _, low, high = found.stiffness_N_mm
    assert 0 < low < np.inf and high == np.inf
    (line,) = Softness().lines([found])
    assert "stiffer than" in line and "inf" not in line


def test_what_no_distance_explains_has_no_stiffness():
    _, far = places(0.5)
    found = softness(
        WHISKER, FACTS, Place(45.0, 0.0, 1e-9, 1e-6, 1, NOTHING_SHARED), far, 0.05, FRICTIONLESS
    )
    assert found.status == NO_PUSH and np.isnan(found.stiffness_N_mm).all()
    assert list(Softness().lines([found])) == []


def test_a_simulated_sponge_is_soft_and_steel_is_not(tmp_path):
    session = simulate(
        tmp_path / "session", protocol=protocol_file(tmp_path, PROTOCOL), signals_only=True, seed=2
    )
    evaluate(session, tmp_path / "out", Settings(), workers=0)
    with (tmp_path / "out" / "compliance.csv").open(newline="") as file:
        sponge, steel = csv.DictReader(file)
    assert float(sponge["stiffness_low_N_mm"]) < 0.3 < float(sponge["stiffness_high_N_mm"])
    assert float(sponge["stiffness_N_mm"]) == pytest.approx(0.3, rel=0.1)
    assert abs(float(sponge["d_x_mm"]) - 45.0) < 2 * float(sponge["d_x_sigma_mm"])
    assert steel["status"] == NOT_SOFT and float(steel["stiffness_low_N_mm"]) > 1.0
    assert "gives way by" in (tmp_path / "out" / "summary.txt").read_text()
