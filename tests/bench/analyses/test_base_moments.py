"""Moments and force at the base from the pictures: against the rig's truth in every frame, and beside felt ones."""

from dataclasses import replace

import numpy as np
import pytest

from bench.analyses.base_moments import (
    BASE_MOMENTS,
    BaseMoments,
    WhiskLoads,
    base_loads,
    felt_beside,
)
from bench.records.trial_result import FeltWhisk
from bench.session.session import load_session
from bench.session.whisker import Whisker
from tests.scenes.results import trial_result
from vision import Value

WHISKER = Whisker(shape="cylinder", length_mm=100.0, diameter_mm=1.0, youngs_modulus_GPa=60.0)
THETA_DEG = 3.0


@pytest.fixture
def trial(steel_signals):
    return load_session(steel_signals).trial("gauge_roll0")


@pytest.fixture
def seen(trial, exact_record):
    return exact_record(trial)


def beside(seen, m_z_Nmm: float, whisker: Whisker, is_by_wire: bool) -> dict:
    """The row of a felt moment beside the seen one."""
    felt = FeltWhisk(
        m_y_Nmm=Value(0.0, 0.1), m_z_Nmm=Value(m_z_Nmm, 0.1), covariance_at=0.01 * np.eye(2)
    )
    result = replace(trial_result([seen]), theta_deg=THETA_DEG)
    return felt_beside(WhiskLoads(result, seen, felt, base_loads(seen, whisker), is_by_wire))


def test_moments_of_every_frame_are_the_rig_s(trial, seen):
    """Within 0.15 %, the friction along the rod that is not known."""
    loads = base_loads(seen, WHISKER)
    frames = seen.truth.frames
    truth = np.genfromtxt(trial.folder / "truth.csv", delimiter=",", names=True)
    truth = truth[np.isin(truth["frame"], frames.index[loads.rows])]
    assert len(truth) == len(loads.rows) == frames.touching.sum()
    assert loads.values[:, 1] == pytest.approx(truth["m_z_Nmm"], rel=1.5e-3)
    sigma = np.sqrt(loads.covariance[:, 1, 1])
    assert np.all(np.abs(loads.values[:, 1] - truth["m_z_Nmm"]) < 3 * sigma)


def test_frames_between_those_of_the_deflection_have_moments_too(seen):
    """One of five frames left out: the cubic through the others is within 1e-3 of it, and as wide."""
    d = seen.deflection
    kept = np.array([0, 1, 3, 4])
    names = "theta_rad motor_rad slip_mm slip_sigma_mm along_mm across_y_mm across_z_mm past_mm"
    each = {name: getattr(d, name)[kept] for name in names.split()}
    rows = (3 * kept[:, None] + np.arange(3)).ravel()
    covariance = d.covariance[np.ix_(rows, rows)]
    errors = d.by_camera_error_mm[rows]
    fewer = replace(d, **each, covariance=covariance, by_camera_error_mm=errors)
    whole = base_loads(seen, WHISKER)
    found = base_loads(replace(seen, deflection=fewer), WHISKER)
    np.testing.assert_array_equal(found.rows, whole.rows)
    assert found.values[2, 1] == pytest.approx(whole.values[2, 1], rel=1e-3)
    assert found.covariance[2, 1, 1] == pytest.approx(whole.covariance[2, 1, 1], rel=0.2)


def test_force_times_lever_is_the_moment(seen):
    """A contact without slip lies in the plane of rotation: m_z = x F_push - lag F_axial."""
    d = seen.deflection
    loads = base_loads(seen, WHISKER)
    at = np.flatnonzero(np.isin(loads.motor_rad, d.motor_rad))
    known = np.isin(d.motor_rad, loads.motor_rad)
    _, m_z, axial, push, _ = loads.values[at].T
    lever = d.along_mm[known] * push - d.across_y_mm[known] * axial
    assert lever == pytest.approx(m_z, rel=1e-6)
    assert np.all(push > 0)


def test_the_stiffness_is_a_part_that_all_share(seen):
    """5 % of E: 5 % of each moment and force, and nothing of it in the frames' own covariance."""
    vague = replace(WHISKER, youngs_modulus_sigma_GPa=3.0)
    one, other = base_loads(seen, WHISKER), base_loads(seen, vague)
    assert (one.stiffness_share, other.stiffness_share) == (0.0, pytest.approx(0.05))
    np.testing.assert_array_equal(one.covariance, other.covariance)
    result = trial_result([seen])
    whisk = WhiskLoads(result, seen, FeltWhisk(), other, True)
    rows = BaseMoments().rows([whisk])[BASE_MOMENTS]
    for row in rows:
        assert row["m_z_shared_sigma_Nmm"] == pytest.approx(0.05 * row["m_z_Nmm"])
        assert row["m_z_sigma_Nmm"] > row["m_z_shared_sigma_Nmm"]


def test_felt_moments_stand_beside_with_ratio_and_z(seen):
    """A felt moment 2 % larger; the stiffness counts only where the gauges do not have it from the wire."""
    vague = replace(WHISKER, youngs_modulus_sigma_GPa=3.0)
    size = beside(seen, 1.0, WHISKER, True)["m_seen_Nmm"]
    row = beside(seen, 1.02 * size, vague, True)
    assert row["ratio"] == pytest.approx(1.02, abs=1e-3)
    sigma = np.hypot(row["m_seen_sigma_Nmm"], row["m_felt_sigma_Nmm"])
    assert row["z"] == pytest.approx((row["m_felt_Nmm"] - size) / sigma)
    assert beside(seen, 1.02 * size, vague, False)["m_seen_sigma_Nmm"] > 0.05 * size


def test_no_row_where_nothing_is_felt_or_the_frames_end_before(seen):
    loads = base_loads(seen, WHISKER)
    result = trial_result([seen])
    assert felt_beside(WhiskLoads(result, seen, FeltWhisk(), loads, True)) is None
    assert loads.at(loads.motor_rad.max() + 0.01) is None


def test_a_rod_that_is_not_bent_so_has_no_rows(seen):
    d = seen.deflection
    far = replace(seen, deflection=replace(d, across_y_mm=0.7 * d.along_mm))
    assert base_loads(far, WHISKER) is None
