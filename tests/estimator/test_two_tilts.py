"""Distance and friction of two whisks together: exact on (13), (14), honest with noise, and what cannot be told."""

from dataclasses import replace

import numpy as np
import pytest

from estimator import slip
from estimator.beam import Beam
from estimator.two_tilts import ALIKE, BELOW_ZERO, NO_PUSH, shared_contact
from estimator.whisk import EstimatorSettings, Whisk

ALPHA, D_X = np.radians(16.0), 60.0
BEAMS = {"cylinder": Beam(8835.7, 100.0), "cone": Beam(8835.7, 100.0, "cone")}
TOLD = EstimatorSettings(np.radians(10.0))


def whisk(
    beta_deg, *, theta=1e-3, alpha=ALPHA, beam=BEAMS["cylinder"], sigma=1e-9, noise=(0.0, 0.0)
) -> Whisk:
    """By (13), (14); at θ → 0 nothing is left out of (10)."""
    d = beam.as_cylinder_mm(D_X)
    m_y, m_z = np.array(slip.moments(d, theta, np.radians(beta_deg), alpha, beam.C_Nmm2)) + noise
    return Whisk(*(np.zeros(0),) * 4, theta, m_y, m_z, sigma**2 * np.eye(2), 0.0, beam)


@pytest.mark.parametrize("shape", BEAMS)
@pytest.mark.parametrize(
    "slopes", [(5.0, 60.0), (25.0, 55.0), (-30.0, 60.0), (30.0, -60.0), (0.0, -40.0)]
)
def test_distance_and_friction_come_back_whatever_alpha_est_is(shape, slopes):
    """To θ: 1e-3 of both."""
    told = shared_contact([whisk(beta, beam=BEAMS[shape]) for beta in slopes], TOLD)
    assert told.status == ""
    assert told.d_x_mm == pytest.approx(D_X, rel=1e-3)
    assert told.alpha_rad == pytest.approx(ALPHA, abs=1e-3)


def test_three_whisks_are_better_than_two():
    slopes, how = (5.0, 40.0, 60.0), {"theta": 0.05, "sigma": 0.02}
    two, three = (shared_contact([whisk(beta, **how) for beta in slopes[:n]], TOLD) for n in (2, 3))
    assert (np.diag(three.covariance) < np.diag(two.covariance)).all()
    assert np.linalg.det(two.covariance) > 0


def test_the_covariance_is_that_of_noise(rng):
    """300 draws at no thickness and no lean: a standard deviation of them is known to 4 %; three of these, and what is
    left of the model's own part."""
    found = []
    for _ in range(300):
        how = ({"theta": 0.02, "sigma": 0.01, "noise": 0.01 * rng.normal(size=2)} for _ in range(2))
        told = shared_contact([whisk(beta, **one) for beta, one in zip((30.0, 65.0), how)], TOLD)
        found.append((told.d_x_mm, told.alpha_rad))
    scatter = np.cov(np.array(found).T)
    assert np.sqrt(np.diag(told.covariance)) == pytest.approx(np.sqrt(np.diag(scatter)), rel=0.15)
    correlation = scatter[0, 1] / np.sqrt(scatter[0, 0] * scatter[1, 1])
    assert told.covariance[0, 1] / np.sqrt(np.prod(np.diag(told.covariance))) == pytest.approx(
        correlation, abs=0.1
    )


def test_what_all_whisks_have_in_common_is_no_noise():
    """Gauges that read all moments 1 % high make both distances 1 % short, and leave the friction alone."""
    plain = [whisk(beta, sigma=1e-4) for beta in (20.0, 60.0)]
    common = [0.01 * np.array([[w.m_y_at_Nmm, w.m_z_at_Nmm]]) for w in plain]
    whisks = [replace(w, covariance_at=w.covariance_at + c.T @ c) for w, c in zip(plain, common)]
    sigmas = np.sqrt(np.diag(shared_contact(whisks, TOLD, shared_Nmm=common).covariance))
    alone = np.sqrt(np.diag(shared_contact(plain, TOLD).covariance))
    assert np.sqrt(sigmas[0] ** 2 - alone[0] ** 2) == pytest.approx(0.01 * D_X, rel=0.2)
    assert sigmas[1] == pytest.approx(alone[1], rel=0.2)


def test_distances_that_may_be_apart_widen_both():
    whisks = [whisk(beta) for beta in (20.0, 60.0)]
    near, apart = (
        shared_contact(whisks, TOLD, apart_sigma_mm=sigma).covariance for sigma in (0.0, 0.5)
    )
    assert (np.diag(apart) > 10 * np.diag(near)).all()
    twice = shared_contact(2 * whisks, TOLD, apart_sigma_mm=0.5, places=(1, 2, 1, 2)).covariance
    assert twice == pytest.approx(apart, rel=1e-3)  # the same places again tell nothing new of them


def test_what_cannot_be_told():
    assert shared_contact([whisk(40.0), whisk(40.0)], TOLD).status == ALIKE
    assert shared_contact([whisk(5.0), whisk(8.0)], TOLD).status == ALIKE  # both held
    assert shared_contact([whisk(5.0), whisk(50.0, noise=(0.0, -1.0))], TOLD).status == NO_PUSH
    with pytest.raises(ValueError, match="two whisks"):
        shared_contact([whisk(40.0)], TOLD)


def test_friction_below_zero_is_said():
    """Frictionless moments whose m_z is a tenth too large where the whisker slips most."""
    steep = whisk(60.0, alpha=0.0)
    wrong = whisk(60.0, alpha=0.0, noise=(0.1 * steep.m_y_at_Nmm, 0.0), sigma=1e-5)
    told = shared_contact([whisk(5.0, alpha=0.0, sigma=1e-5), wrong], TOLD)
    assert told.status == BELOW_ZERO and told.alpha_rad == 0.0
