"""Fig. 8 from the results: groups, means, and the friction angle that the moments hold."""

from dataclasses import replace

import numpy as np
import pytest

from bench.analyses.figure_8 import rows
from bench.analyses.surfaces import Felt, _fit, surfaces
from bench.records.plain import from_plain
from bench.records.trial_result import TrialResult
from estimator import slip
from estimator.beam import Beam
from vision.truth.value import Value

BEAM = Beam(8835.7, 100.0)
C = BEAM.C_Nmm2
THETA = np.radians(3.0)


def result(
    beta_deg,
    alpha_deg,
    d_x=60.0,
    *,
    surface="steel",
    speed=10.0,
    purpose="measure",
    seen=True,
    noise=(0, 0),
) -> TrialResult:
    """One whisk's result as (13), (14) have it."""
    m_y, m_z = slip.moments(d_x, THETA, np.radians(beta_deg), np.radians(alpha_deg), C)
    m_y, m_z = m_y + noise[0], m_z + noise[1]
    felt = {
        "m_y_Nmm": m_y,
        "m_z_Nmm": m_z,
        "m_y_sigma_Nmm": 0.02,
        "m_z_sigma_Nmm": 0.02,
        "phi_felt_rad": np.arctan2(m_y, m_z),
        "phi_felt_sigma_rad": 0.002,
    }
    truth = {"whisk": 0, "d_x_mm": None} | (
        {"d_x_mm": d_x, "beta_rad": np.radians(beta_deg)} if seen else {}
    )
    trial = {
        "name": f"b{beta_deg}",
        "surface": surface,
        "speed_deg_s": speed,
        "purpose": purpose,
        "beta_nominal_deg": beta_deg,
        "beta_nominal_sigma_rad": np.radians(3.0),
        "d_x_nominal_mm": d_x,
    }
    whisker = {"shape": "cylinder", "length_mm": 100.0, "diameter_mm": 1.0, "EI_Nmm2": C / 3}
    whole = {"trial": trial, "whisker": whisker, "theta_deg": 3.0}
    return from_plain(
        TrialResult,
        whole | {"seen": {"whisks": [{"truth": truth, "status": ""}]}, "felt": {"whisks": [felt]}},
    )


def test_fit_gives_the_friction_angle_back_with_distances_that_differ():
    found = surfaces(
        [result(b, 12.0, d) for b, d in ((0, 60), (30, 50), (60, 70), (-45, 55))], BEAM
    )
    assert len(found) == 1
    assert np.degrees(found[0].alpha_rad) == pytest.approx(12.0, abs=1e-6)


def test_repeats_of_a_few_recordings_are_not_independent(rng):
    """Four bars 0.4° off what was set by hand, three whisks each, gauges 0.4 % off: of 30 intervals 95 % hold, but for
    3 sigma of a binomial."""
    held = []
    for _ in range(30):
        gauges, whisks = np.eye(2) + 4e-3 * rng.normal(size=(2, 2)), []
        for number, beta_deg in enumerate((0, 20, 40, 60)):
            moments = slip.moments(
                60.0, THETA, np.radians(beta_deg + 0.4 * rng.normal()), np.radians(14.0), C
            )
            for _ in range(3):
                m = gauges @ moments + 0.02 * rng.normal(size=2)
                sigma, shared = (
                    np.hypot(0.02, 4e-3 * np.hypot(*m)),
                    4e-3 * np.kron(np.eye(2), m[:, None]),
                )
                felt = Felt(
                    np.radians(beta_deg),
                    60.0,
                    THETA,
                    *m,
                    shared,
                    m_y_sigma_Nmm=sigma,
                    m_z_sigma_Nmm=sigma,
                    phi_sigma_deg=0.3,
                    nominal=True,
                    recording=number,
                    beta_sigma_rad=np.radians(0.4),
                )
                whisks.append(felt)
        fit = _fit(whisks, BEAM)
        held.append(fit.low_rad < np.radians(14.0) < fit.high_rad)
    assert np.mean(held) > 0.83


def test_without_pictures_the_nominal_slope_is_taken():
    found = surfaces([result(b, 20.0, seen=False) for b in (0, 30, 60)], BEAM)[0]
    assert np.degrees(found.alpha_rad) == pytest.approx(20.0, abs=1e-6)
    assert all(f.nominal for f in found.felt)


def test_a_panel_for_each_surface_and_speed_and_none_for_gauge_trials():
    found = surfaces(
        [
            result(30, 10),
            result(30, 10, speed=90.0),
            result(30, 23, surface="sandpaper"),
            result(0, 10, purpose="gauge"),
        ],
        BEAM,
    )
    assert [(s.name, s.speed_deg_s) for s in found] == [
        ("steel", 10.0),
        ("steel", 90.0),
        ("sandpaper", 10.0),
    ]
    assert all(s.fit is None for s in found)  # one whisk each holds no α


def test_points_are_means_over_whisks_of_one_slope(rng):
    whisks = [result(b, 10.5, noise=rng.normal(0, 0.05, 2)) for b in (0, 45) for _ in range(10)]
    first, second = surfaces(whisks, BEAM)[0].points()
    assert (first.whisks, second.whisks) == (10, 10)
    assert second.beta_deg == pytest.approx(45)
    assert second.m_sd_Nmm == pytest.approx(0.05, rel=0.6)  # 10 samples: 24 % a sigma
    assert first.m_Nmm == pytest.approx(C * THETA / 60, abs=0.06)  # 0.05/√10, 4 sigma


def test_moments_are_scaled_to_one_distance():
    """|m| goes as 1/d_x, so whisks of one slope and friction at two distances are one point without scatter."""
    (point,) = surfaces([result(45, 10.5, d) for d in (50.0, 60.0, 70.0)], BEAM)[0].points()
    assert point.m_sd_Nmm == pytest.approx(0.0, abs=1e-9)


def test_no_slope_above_the_friction_angle_holds_none():
    assert surfaces([result(b, 25.0) for b in (0, 5, 10)], BEAM)[0].fit is None


@pytest.mark.parametrize("beam", [Beam(C, 100.0, "cone"), Beam(C, 100.0, "tapered", 0.4)])
def test_a_whisker_that_tapers_is_fitted_as_one(beam):
    """Its moments are those of the base's cylinder touched farther out; points lie on the fitted curve, at one d_x."""
    whisks = []
    for beta, d_x in ((0, 60), (30, 50), (60, 70), (-45, 55)):
        whisk = result(beta, 12.0, float(beam.as_cylinder_mm(d_x)))
        (seen,) = whisk.seen.whisks
        seen = replace(seen, truth=replace(seen.truth, d_x_mm=Value(float(d_x), 0.01)))
        whisks.append(replace(whisk, seen=replace(whisk.seen, whisks=(seen,))))
    (found,) = surfaces(whisks, beam)
    assert np.degrees(found.alpha_rad) == pytest.approx(12.0, abs=1e-6)
    for row in rows([found]):
        assert row["m_EI_per_metre"] == pytest.approx(row["m_fit_EI_per_metre"], rel=1e-6)
