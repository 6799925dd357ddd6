"""A whisker's shape and contact from force and moment: against the rig's exact mechanics, noise, and what has no contact."""

import numpy as np
import pytest

from estimator import profile
from estimator.beam import Beam
from tests.scenes.six_axes import beam_of, pushed

BEAM = beam_of()
# Newton's last step of the rig's contact, in parts of 100 mm.
RIG_MM = 1e-8
PUSHES = [
    {"theta_deg": 3.0},
    {"theta_deg": 20.0, "alpha_deg": 10.0},
    {"theta_deg": 20.0, "alpha_deg": 10.0, "beta_deg": 40.0, "psi_deg": 20.0},
    {"theta_deg": 20.0, "radius_mm": 30.0, "d_x_mm": 50.0},
]


def felt(push) -> np.ndarray:
    return np.array([*push.moment_Nmm, *push.force_N])


@pytest.mark.parametrize("shape", ["cylinder", "tapered", "cone"])
@pytest.mark.parametrize("where", PUSHES)
def test_the_contact_is_that_of_exact_mechanics(shape, where, monkeypatch):
    """Another solver and other unknowns: off by the steps' error alone, by fourth order 16/15 of what twice as many
    steps change; a fifth of that is left to the next order."""
    push = pushed(shape, **where)
    (found,) = profile.contact_in_hub(felt(push)[None], beam_of(shape))
    monkeypatch.setattr(profile, "_STEPS", 48)
    (finer,) = profile.contact_in_hub(felt(push)[None], beam_of(shape))
    by_steps = np.linalg.norm(found - finer)
    assert by_steps < 2e-6 * push.d_x_mm
    off = np.linalg.norm(found - push.point_hub_mm)
    assert off < 1.2 * 16 / 15 * by_steps + RIG_MM


def test_no_moment_is_left_at_the_contact():
    """The force's lever is about the contact, and the arc longer than its chord."""
    m_y, m_z, f_x, f_y, _ = felt(pushed(theta_deg=20.0))
    arc, x, back, slope = profile._bent_end(*np.array([[m_z], [f_y], [f_x]]), BEAM)[:, 0]
    assert np.hypot(m_y, m_z) - x * f_y - back * f_x == pytest.approx(0.0, abs=1e-6 * m_z)
    assert np.hypot(x, back) < arc < x / np.cos(slope)


def test_its_covariance_is_that_of_draws():
    """Variances from 4000 draws are known to 2.2 %; four of these are allowed."""
    push = pushed(theta_deg=10.0, beta_deg=40.0, alpha_deg=10.0)
    moments, forces = felt(push)[:2], felt(push)[2:]
    of_moments = np.array([[1e-4, 2e-5], [2e-5, 2e-4]])
    of_forces = np.diag([1e-7, 2e-7, 3e-7])
    _, covariance, why_none = profile.contact(moments, of_moments, forces, of_forces, BEAM)
    assert why_none == ""
    rng = np.random.default_rng(1)
    drawn = np.column_stack(
        [
            rng.multivariate_normal(moments, of_moments, 4000),
            rng.multivariate_normal(forces, of_forces, 4000),
        ]
    )
    scatter = np.cov(profile.contact_in_hub(drawn, BEAM).T)
    sizes = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    assert (covariance - scatter) / sizes == pytest.approx(np.zeros((3, 3)), abs=0.09)


@pytest.mark.parametrize(
    "felt_now, beam, code",
    [
        ((0.0, -3.0, 0.0, 0.06, 0.0), BEAM, "not_pushing"),
        ((0.0, 3.0, np.nan, 0.06, 0.0), BEAM, "value_missing"),
        ((0.0, 30.0, 0.0, 0.06, 0.0), BEAM, profile.NO_END.code),
        (
            (0.0, 3.0, 0.0, 0.06, 0.0),
            Beam(8835.7, 100.0, rest_mm=((0.0, 1.0), (0.0,))),
            "curved_unloaded",
        ),
    ],
)
def test_what_has_no_contact_says_why(felt_now, beam, code):
    """The third: a moment that this force has at 500 mm only."""
    felt_now = np.array(felt_now)
    point, _, why_none = profile.contact(felt_now[:2], np.eye(2), felt_now[2:], np.eye(3), beam)
    assert np.isnan(point).all() and why_none.code == code
