"""α seen of whiskers that taper, from exact deflections."""

import numpy as np
import pytest

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
