"""α seen of whiskers that taper, from exact deflections."""

from dataclasses import replace

import numpy as np
import pytest

from bench.trials.seen_friction import with_seen_friction
from tests.studies.accuracy.combined_numbers import DrawnSession, push


class NoNoise:
    """A generator that draws means."""

    def uniform(self, low, high):
        return 0.5 * (low + high)

    def normal(self, size=()):
        return np.zeros(size)


@pytest.fixture(scope="module")
def session():
    return DrawnSession("cone", NoNoise())


@pytest.mark.parametrize("psi_deg", [-10.0, 0.0, 10.0])
def test_of_a_cone_it_knows_that_the_normal_leans_along_the_whisker(session, psi_deg):
    """Else it is off by −0.08, −0.03 and +0.02°."""
    mechanics = push(session.rod, np.radians(-60.0), np.radians(psi_deg), 60.0, session.alpha_rad)
    seen = session.seen(0, mechanics, 0.2)
    assert np.degrees(seen.friction_rad.value - session.alpha_rad) == pytest.approx(0.0, abs=0.005)


@pytest.mark.parametrize("beta_deg", [-60.0, 45.0])
def test_cameras_that_turn_deflection_and_slope_alike_leave_alpha_as_it_is(session, beta_deg):
    """To θ² at 8°, 0.02 of the turn; cameras that turn the slope alone turn α with its sign."""
    mechanics = push(session.rod, np.radians(beta_deg), 0.0, 60.0, session.alpha_rad)
    seen = session.seen(0, mechanics, 0.2)
    d = seen.deflection
    turn = np.stack([0.0 * d.along_mm, -d.across_y_mm, d.across_z_mm], axis=1).reshape(-1, 1)
    slope_alone = seen.friction_by_camera_error_rad / seen.truth.shared.beta_by_camera_error_rad
    assert slope_alone == pytest.approx(np.sign(beta_deg), abs=0.1)
    shared = replace(
        seen.truth.shared,
        beta_by_camera_error_rad=np.array([-1.0]),
        psi_by_camera_error_rad=np.zeros(1),
    )
    turned = replace(
        seen,
        truth=replace(seen.truth, shared=shared),
        deflection=replace(d, by_camera_error_mm=turn),
    )
    found = with_seen_friction(turned, session.whisker)
    assert found.friction_by_camera_error_rad == pytest.approx(0.0, abs=0.03)
