"""The elastica against elliptic integrals, small-angle beams and its own finite differences."""

import math

import numpy as np
import pytest

from bench.rig.elastica import Elastica
from tests.scenes.elliptic import CONE, CYLINDER, elliptic_end


@pytest.mark.parametrize("direction_deg", [60, 90, 120])
@pytest.mark.parametrize("load", [0.05, 1.0, 3.0])
def test_against_elliptic_integrals(load, direction_deg):
    direction = math.radians(direction_deg)
    arc = 70.0
    force = load * CYLINDER.rigidity_Nmm2 / arc**2
    bent = Elastica(CYLINDER, nodes=30).solve(
        force * math.cos(direction), force * math.sin(direction), arc
    )
    end, slope = elliptic_end(load, direction)
    assert bent.end_mm / arc == pytest.approx(end, abs=1e-9)
    assert bent.slope == pytest.approx(slope, abs=1e-9)


def test_default_nodes_are_enough_for_whisking():
    """A whisk to 20° bends by load ≲ 1; the default nodes must be as good there as more of them."""
    force = 1.0 * CYLINDER.rigidity_Nmm2 / 60**2
    coarse, fine = (Elastica(CYLINDER, nodes=n).solve(0.1 * force, force, 60.0) for n in (0, 48))
    assert coarse.end_mm == pytest.approx(fine.end_mm, abs=1e-11 * 60)


def test_cone_bends_as_small_angle_theory_says():
    """Tip load at s on a cone to a point at L: deflection F s³ L/(3EI (L − s)); second order is (δ/s)² = 1e-8."""
    arc, force = 60.0, 1e-6
    bent = Elastica(CONE).solve(0.0, force, arc)
    expected = force * arc**3 * CONE.length_mm / (3 * CONE.rigidity_Nmm2 * (CONE.length_mm - arc))
    assert bent.end_mm[1] == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("rod", [CYLINDER, CONE])
def test_answers_equal_finite_differences(rod):
    """Central differences of 1e-4 relative: truncation 1e-8, cancellation 1e-12/1e-4."""
    elastica, at = Elastica(rod), np.array([-0.02, 0.15, 55.0])
    bent = elastica.solve(*at)
    for i, h in enumerate(1e-4 * np.abs(at)):
        up, down = (elastica.solve(*(at + s * h * np.eye(3)[i])) for s in (1, -1))
        assert bent.end_by[:, i] == pytest.approx(
            (up.end_mm - down.end_mm) / (2 * h), rel=1e-6, abs=1e-6
        )
        assert bent.slope_by[i] == pytest.approx((up.slope - down.slope) / (2 * h), rel=1e-6)


def test_no_force_leaves_the_rod_straight():
    bent = Elastica(CYLINDER).solve(0.0, 0.0, 50.0)
    assert bent.end_mm == pytest.approx([50.0, 0.0], abs=1e-12)


def test_curve_keeps_its_length_and_goes_straight_beyond_the_load():
    elastica = Elastica(CYLINDER)
    bent = elastica.solve(0.0, 0.5, 60.0)
    arc = np.linspace(0, 100, 4001)
    curve = elastica.curve_mm(bent, arc)
    steps = np.linalg.norm(np.diff(curve, axis=0), axis=1)
    assert steps.sum() == pytest.approx(
        100.0, abs=1e-5
    )  # chords of 0.025 mm at κ ≤ 0.01/mm fall short by 3e-9 each
    beyond = np.diff(curve[arc > 60.1], axis=0)
    assert np.ptp(np.arctan2(beyond[:, 1], beyond[:, 0])) < 1e-10
