"""The error of (10) explained: shares add up, and α as seen is the true one."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from bench.analyses.alphas import felt_friction
from bench.analyses.explained import by_10
from bench.base.settings import Settings
from bench.records.trial_result import FeltWhisk
from bench.session.session import load_session
from bench.session.whisker import Whisker
from bench.trials.seen_friction import with_seen_friction
from bench.workflows.session_evaluation import evaluate
from estimator.beam import Beam
from estimator.builtin import with_friction
from estimator.whisk import EstimatorSettings, Whisk
from vision.truth.at_angle import TruthAtAngle
from vision.truth.records import SeenObject
from vision.truth.value import Value

WIRE = Whisker(shape="cylinder", length_mm=100.0, diameter_mm=1.0, youngs_modulus_GPa=60.0)


@pytest.mark.parametrize("trial", ["b30_3", "b60_4"])
def test_friction_as_seen_is_the_true_one(exact_record, steel_signals, trial):
    """10.5°, within 0.05°: 0.01 mm of rounding in truth.csv over a deflection of 3 mm."""
    record = exact_record(load_session(steel_signals).trial(trial))
    found = with_seen_friction(record, WIRE).friction_rad
    alpha, sigma = np.degrees([found.value, found.sigma])
    assert alpha == pytest.approx(10.5, abs=0.05)
    assert 0.0 < sigma < 0.5


def test_an_offset_common_to_all_deflections_drops_out(exact_record, steel_signals):
    """To first order: 0.01 mm turns a deflection of 3 mm by 0.2°, and α by a hundredth of that, the second order."""
    record = exact_record(load_session(steel_signals).trial("b60_4"))
    before = with_seen_friction(record, WIRE).friction_rad.value
    raised = replace(record.deflection, across_z_mm=record.deflection.across_z_mm + 0.01)
    after = with_seen_friction(replace(record, deflection=raised), WIRE).friction_rad.value
    assert np.degrees(after) == pytest.approx(np.degrees(before), abs=0.002)


def solid(shape: str) -> SeenObject:
    """Return an object of 20 mm radius at the origin."""
    return SeenObject(shape, np.zeros(3), np.ones(3), 20.0, 0.0, 0.3)


def test_along_a_sphere_alpha_is_that_at_theta_and_along_a_cone_the_deflections_slope(
    exact_record, steel_signals
):
    """What slides on a sphere comes to another slope: the normal there tells α, and none is felt."""
    record = exact_record(load_session(steel_signals).trial("b60_4"))
    at = TruthAtAngle(theta_rad=0.05, alpha_rad=Value(0.2, 0.01))
    of = {
        shape: replace(record, at=at, truth=replace(record.truth, rounded=solid(shape)))
        for shape in ("sphere", "ring", "cone")
    }
    for shape in ("sphere", "ring"):
        assert with_seen_friction(of[shape], WIRE).friction_rad.value == 0.2
        assert with_seen_friction(of[shape], WIRE).friction_rad.sigma == 0.01
    of_cone, as_of_bar = (
        with_seen_friction(one, WIRE).friction_rad for one in (of["cone"], record)
    )
    assert of_cone.value == as_of_bar.value
    felt = FeltWhisk(0, phi_felt_rad=Value(0.85, 0.01))
    assert not felt_friction(of["sphere"], felt, 0.05, 1.0).is_known
    of_bar = felt_friction(record, felt, 0.05, 1.0)
    assert felt_friction(of["cone"], felt, 0.05, 1.0).value == of_bar.value
    assert np.isfinite([of_bar.value, of_bar.sigma]).all()


def test_no_slip_no_friction_angle(exact_record, steel_signals):
    record = exact_record(load_session(steel_signals).trial("b00_2"))
    assert np.isnan(with_seen_friction(record, WIRE).friction_rad.value)


def test_shares_add_up_and_what_remains_is_small(steel_signals, exact_vision, tmp_path):
    """With a wrong α_est of 15° the friction angle explains the error at 60°; beam theory leaves less than 1 %."""
    evaluate(steel_signals, tmp_path, Settings(alpha_est_deg=15.0), workers=0)
    with (tmp_path / "explained.csv").open(newline="") as file:
        rows = {
            row.pop("trial"): {k: float(v or "nan") for k, v in row.items()}
            for row in csv.DictReader(file)
        }
    for row in rows.values():
        parts = row["by_touch_mm"] + row["by_moments_mm"] + row["by_alpha_mm"] + row["remainder_mm"]
        assert parts == pytest.approx(row["error_mm"], abs=1e-6)
        assert abs(row["remainder_mm"]) < 0.65
    steep = rows["b60_4"]
    assert abs(steep["by_alpha_mm"]) > 3 * max(
        abs(steep["by_touch_mm"]), abs(steep["by_moments_mm"])
    )


def test_a_cone_is_a_cone_here_too():
    """(10) as the estimator has it, for both shapes."""
    theta, m_y, m_z, alpha = np.radians(3.0), 2.0, 7.0, np.radians(10.0)
    for shape in ("cylinder", "cone"):
        whisker = Whisker(shape=shape, length_mm=100.0, diameter_mm=1.0, youngs_modulus_GPa=60.0)
        beam, nothing = Beam(whisker.C_Nmm2, 100.0, shape), np.zeros(0)
        felt = Whisk(nothing, nothing, nothing, nothing, theta, m_y, m_z, np.eye(2), 0.0, beam)
        expected = with_friction(felt, EstimatorSettings(alpha)).d_x_mm
        assert by_10(theta, m_y, m_z, alpha, whisker) == pytest.approx(expected, rel=1e-12)
