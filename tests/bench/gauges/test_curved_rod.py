"""The curved rod against the rig's exact mechanics, the straight rod, and itself in other units."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.gauges.clamped_rod import load_at_clamp
from bench.gauges.curved_rod import KirchhoffRods
from bench.gauges.whisker_rods import CurvedRod, SeenContacts, StraightRod, rod_of
from bench.session.rest_shape import UnloadedRod
from bench.session.whisker import Whisker
from tests.scenes.curved_pushes import PROFILED, VIBRISSA, CurvedPush, feel, whisker_of


def seen(push: CurvedPush) -> tuple[SeenContacts, np.ndarray]:
    """Return what pictures without noise show of the contact, and the exact moments (2,)."""
    felt = feel(push)
    theta = np.radians([push.theta_deg])
    along = np.array([felt.along_mm])
    return SeenContacts(along, felt.across_mm[None], theta, felt.d_x_mm), felt.moments_Nmm


@pytest.mark.parametrize("d_x_mm", [20.0, 30.0])
@pytest.mark.parametrize("beta_deg", [0.0, 40.0, -60.0])
@pytest.mark.parametrize("theta_deg", [3.0, 10.0])
def test_moments_of_a_vibrissa_without_friction_are_the_rig_s(d_x_mm, beta_deg, theta_deg):
    """To 1e-6, where a straight rod in its place is off by 0.3 to 4 %."""
    push = CurvedPush(d_x_mm=d_x_mm, beta_deg=beta_deg, friction=0.0, theta_deg=theta_deg)
    contacts, exact = seen(push)
    whisker = whisker_of(push.rod)
    found = rod_of(whisker).moments_Nmm(contacts, 0.0)[0]
    size = np.linalg.norm(exact)
    assert np.abs(found - exact).max() < 1e-6 * size
    straight = StraightRod(whisker).moments_Nmm(contacts, 0.0)[0]
    assert np.linalg.norm(straight - exact) > 3e-3 * size


@pytest.mark.parametrize("rod", [VIBRISSA, PROFILED, replace(PROFILED, rest=None)])
@pytest.mark.parametrize("beta_deg", [0.0, 40.0])
def test_moments_and_force_of_any_rod_without_friction_are_the_rig_s(rod, beta_deg):
    """Moments to 1e-6, forces to 1e-5, for the taper is that at the distance and not at the arc: of a cone, of measured
    diameters curved, and straight."""
    push = CurvedPush(rod=rod, beta_deg=beta_deg, friction=0.0, theta_deg=6.0)
    contacts, exact = seen(push)
    whisker = whisker_of(rod)
    found = rod_of(whisker).loads(contacts, 0.0)[0]
    force_N = feel(push).force_N
    assert np.abs(found[:2] - exact).max() < 1e-6 * np.linalg.norm(exact)
    assert np.abs(found[2:] - force_N).max() < 1e-5 * np.linalg.norm(force_N)


@pytest.mark.parametrize("rod", [PROFILED, replace(PROFILED, rest=None)])
def test_a_cone_in_place_of_measured_diameters_would_be_far_off(rod):
    """By a half of the moment: the diameter goes by its fourth power."""
    push = CurvedPush(rod=rod, friction=0.0)
    contacts, exact = seen(push)
    cone = replace(whisker_of(rod), widths=())
    found = rod_of(cone).moments_Nmm(contacts, 0.0)[0]
    assert np.linalg.norm(found - exact) > 0.1 * np.linalg.norm(exact)


@pytest.mark.parametrize("friction", [0.0, -0.2, 0.2])
@pytest.mark.parametrize("shape", ["cylinder", "cone"])
def test_a_rod_without_curvature_is_the_straight_one(shape, friction):
    """Another solver of another equation; both converge to 1e-9."""
    whisker = Whisker(shape=shape, length_mm=100.0, diameter_mm=1.0, youngs_modulus_GPa=60.0)
    across = np.array([[0.0, 3.0], [2.0, 9.0], [-8.0, 15.0]])
    contacts = SeenContacts(
        np.full(3, 55.0), across, np.arctan2(np.linalg.norm(across, axis=1), 55.0), 60.0
    )
    straight, curved = (
        rod(whisker).moments_Nmm(contacts, friction) for rod in (StraightRod, CurvedRod)
    )
    assert isinstance(rod_of(whisker), StraightRod)
    np.testing.assert_allclose(curved, straight, rtol=1e-8, atol=1e-8 * np.abs(straight).max())


@settings(max_examples=10)
@given(
    length=st.floats(10.0, 500.0),
    taper=st.floats(0.0, 1.0),
    part=st.floats(0.1, 0.95),
    theta=st.floats(np.radians(0.1), np.radians(30.0)),
    sets=st.tuples(st.floats(-0.15, 0.15), st.floats(-0.15, 0.15)),
    rigidity=st.floats(1e-3, 1e6),
    length_unit=st.floats(1e-3, 1e3),
    force_unit=st.floats(1e-6, 1e6),
)
def test_the_answer_is_the_same_in_every_unit(
    length, taper, part, theta, sets, rigidity, length_unit, force_unit
):
    """A rod that no force bends so is refused in every unit."""

    def asked(unit, force):
        """Moments and force over their units, and the tangent at the contact; nothing where the rod is refused."""
        rest = UnloadedRod(tuple((0.0, 0.0, unit * length * tip) for tip in sets), unit * length)
        unbent = rest.point_mm(np.array([part * unit * length]))
        deflection = part * unit * length * np.array([[-0.5 * theta**2, -theta, 0.3 * theta]])
        rods = KirchhoffRods(
            rest, lambda share: 1.0 - taper * share, rigidity * force * unit**2, unbent + deflection
        )
        try:
            held = rods.held(np.array([-0.1]), deflection)
        except ArithmeticError:
            return ()
        return held.moments_Nmm / (force * unit), held.force_N / force, held.tangent

    for one, other in zip(asked(1.0, 1.0), asked(length_unit, force_unit), strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-9, atol=1e-9 * np.abs(one).max())


def test_a_contact_at_the_point_of_a_cone_has_no_moment():
    rest = UnloadedRod(((0.0, 0.0, 3.0), (0.0,)), 45.0)
    contact = rest.point_mm(np.array([44.9])) - [0.0, 2.0, 0.0]
    with pytest.raises(ArithmeticError, match="too near the end"):
        rods = KirchhoffRods(rest, lambda share: 1.0 - share, 0.24, contact)
        rods.held(np.zeros(1), np.array([[0.0, -2.0, 0.0]]))


def test_a_contact_far_beyond_the_end_is_refused_and_not_marched_for_ever():
    """Beyond its end the shape's slope exceeds 1, whose tangent is no number: no step of a march ends."""
    rest = UnloadedRod(((0.0, 0.0, 40.0), (0.0,)), 100.0)
    rods = KirchhoffRods(rest, np.ones_like, 100.0, np.array([[130.0, 10.0, 5.0]]))
    with pytest.raises(ArithmeticError, match="beyond the end"):
        rods.held(np.zeros(1), np.array([[0.0, 10.0, 5.0]]))


def test_near_the_point_of_a_cone_the_rod_is_bent_and_not_coiled():
    """From the force that bends a cylinder so, Newton's method came to a rod whose end has turned back: 46 % less."""
    along, across = 40.0 * np.cos(np.radians(8.0)), 40.0 * np.sin(np.radians(8.0))
    contact = np.array([[along, -across, 0.0]])
    rods = KirchhoffRods(
        UnloadedRod(((0.0,), (0.0,)), 50.0), lambda share: 1.0 - share, 1.0, contact
    )
    held = rods.held(np.zeros(1), np.array([[0.0, -across, 0.0]]))
    straight = load_at_clamp(along, across, lambda arc: (1.0 - arc / 50.0) ** 4)
    moment_Nmm = np.linalg.norm(held.moments_Nmm)
    assert moment_Nmm == pytest.approx(straight.moment_Nmm[0], rel=1e-8)
