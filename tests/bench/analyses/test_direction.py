"""The direction of the force on a pushed whisker, beside one made of turned vectors."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bench.analyses.direction import slip_angle


@pytest.mark.parametrize("beta_deg, off_deg", [(20.0, 5.0), (45.0, 14.0), (70.0, 10.0)])
def test_without_a_push_it_is_the_slope_less_the_friction_angle(beta_deg, off_deg):
    found = slip_angle(np.zeros(1), np.radians(beta_deg), np.radians([off_deg]))
    assert np.degrees(found[0]) == pytest.approx(beta_deg - off_deg, abs=1e-9)


@pytest.mark.parametrize("left, tangent_over_chord", [(1.0, 1.5), (0.5, 2.0)])
def test_a_push_turns_bar_and_tangent(left, tangent_over_chord):
    """A uniform rod, and a cone touched in its middle. The force is across the bent whisker but for friction
    along the bar, which turns back by θ in the hub's frame."""
    beta, off, theta = np.radians([40.0, 10.0, 8.0])
    (found,) = slip_angle(np.array([theta]), beta, np.array([off]), left)
    phi = beta - off
    bar = Rotation.from_rotvec([0, 0, -theta]).apply([0.0, np.sin(beta), np.cos(beta)])
    about = np.cross([1.0, 0.0, 0.0], [0.0, -np.cos(phi), np.sin(phi)])
    chord = theta * np.cos(beta) / np.cos(off)
    tangent = Rotation.from_rotvec(tangent_over_chord * chord * about).apply([1.0, 0.0, 0.0])
    normal = np.cross(tangent, bar)
    force = normal / np.linalg.norm(normal) - np.tan(off) * bar
    assert force[1] < 0 and found > phi
    assert found == pytest.approx(np.arctan2(force[2], -force[1]), abs=1e-12)
