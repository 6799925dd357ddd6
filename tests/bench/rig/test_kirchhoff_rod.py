"""The rod in space against the planar elastica, closed forms, another solver, and itself in other units."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from bench.rig.elastic_rod import RestShape, Rod
from bench.rig.kirchhoff_rod import TORSION_OVER_BENDING, KirchhoffRod
from bench.rig.planar_rod import PlanarRod

CYLINDER = Rod("cylinder", 100.0, 1.0, 60.0)
CONE = Rod("cone", 100.0, 1.0, 60.0)
VIBRISSA = Rod("tapered", 45.0, 0.2, 3.0, rest=RestShape(45.0, 0.1, 6.0, 2.0), tip_diameter_mm=0.01)
HUB = np.eye(3)


def unknowns(rod: Rod, load: float, arc_mm: float) -> np.ndarray:
    """A force across and a little along the rod, in EI at the base over the arc's square, and the arc."""
    return np.append(load * rod.rigidity_Nmm2 / arc_mm**2 * np.array([0.2, -0.8, 0.5]), arc_mm)


@pytest.mark.parametrize(
    "rod, arc_mm, tolerance",
    [(CYLINDER, 60.0, 1e-10), (CONE, 60.0, 1e-10), (CONE, 85.0, 1e-9)],
)
@pytest.mark.parametrize("load", [0.05, 1.0, 2.5])
def test_a_straight_rod_bends_as_the_planar_elastica_says(rod, arc_mm, tolerance, load):
    """Within 1e-10 of the arc, where the planar one differs by as much with 20 nodes and 30; the thin
    end of a cone within 1e-9."""
    at = unknowns(rod, load * rod.width(arc_mm), arc_mm)
    plane = PlanarRod(rod).solve(HUB, at, None)
    space = KirchhoffRod(rod).solve(HUB, at, None)
    assert np.abs(space.point - plane.point).max() < tolerance * arc_mm
    assert np.abs(space.tangent - plane.tangent).max() < tolerance
    scale = np.abs(plane.point_by).max()
    assert np.abs(space.point_by - plane.point_by).max() < 100 * tolerance * scale
    along = np.linspace(0, 100, 21)
    curves = [way(rod).curve_mm(at, None, along) for way in (PlanarRod, KirchhoffRod)]
    assert np.abs(curves[0] - curves[1]).max() < 10 * tolerance * arc_mm


class Arc:
    """A quarter of a circle in the x–y plane, as an unloaded shape."""

    is_straight = False

    def __init__(self, radius_mm: float):
        self.radius_mm = radius_mm

    def tangent(self, arc_mm):
        angle = np.asarray(arc_mm) / self.radius_mm
        return np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1)

    def tangent_by_arc(self, arc_mm):
        angle = np.asarray(arc_mm) / self.radius_mm
        return np.stack([-np.sin(angle), np.cos(angle), 0 * angle], -1) / self.radius_mm

    def point_mm(self, arc_mm):
        angle = np.asarray(arc_mm) / self.radius_mm
        return self.radius_mm * np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], -1)


def test_a_curved_beam_bends_and_twists_as_castigliano_says():
    """End load on a quarter circle, out of its plane: δ = F R³/EI (π/4 + (1 + ν)(3π/4 − 2)); in it, along
    x, F R³/EI π/4, and along y, F R³/EI (3π/4 − 2). Loads of both signs leave the third order, (F R²/EI)² = 1e-8."""
    radius, load = 40.0, 1e-4
    arc = radius * math.pi / 2
    rod = replace(CYLINDER, rest=Arc(radius))
    force = load * rod.rigidity_Nmm2 / radius**2
    beam = KirchhoffRod(rod, 24)
    moved = []
    for axis in np.eye(3):
        ends = [
            beam.solve(HUB, np.append(sign * force * axis, arc), None).point for sign in (1, -1)
        ]
        moved.append(0.5 * (ends[0] - ends[1]) @ axis)
    bending = [math.pi / 4, 3 * math.pi / 4 - 2, math.pi / 4]
    torsion = [0, 0, (1 + TORSION_OVER_BENDING) * (3 * math.pi / 4 - 2)]
    expected = load * radius * np.add(bending, torsion)
    assert moved == pytest.approx(expected.tolist(), rel=1e-7)


def test_a_cone_bends_as_small_angle_theory_says():
    """Load at s on a cone to a point at L: deflection F s³ L/(3EI (L − s)); second order is 1e-8."""
    arc, force = 60.0, 1e-6
    moved = KirchhoffRod(CONE).solve(HUB, np.array([0, force, 0, arc]), None).point[1]
    expected = force * arc**3 * CONE.length_mm / (3 * CONE.rigidity_Nmm2 * (CONE.length_mm - arc))
    assert moved == pytest.approx(expected, rel=1e-7)


def test_a_vibrissa_bends_as_a_boundary_value_solver_says():
    """SciPy's solve_bvp, by shooting for the load's place, with its own mesh, to 1e-10."""
    arc, rod = 30.0, VIBRISSA
    at = unknowns(rod, 1.2, arc)
    force = at[:3]
    found = KirchhoffRod(rod).solve(HUB, at, None)
    steps = np.linspace(0, arc, 61)

    def rates(s, y):
        """y (15, n): the section's turn Q, row by row, its point, and the load's place."""
        turn = y[:9].reshape(3, 3, -1)
        tangent = np.einsum("ijn,nj->in", turn, rod.rest.tangent(s))
        moment = np.cross((y[12:15] - y[9:12]).T, force).T
        twist = (moment * tangent).sum(0)
        rigidity = rod.rigidity_Nmm2 * rod.width(s) ** 4
        spin = (moment + TORSION_OVER_BENDING * tangent * twist) / rigidity
        # each column of Q turns
        turned = np.stack([np.cross(spin.T, turn[:, k].T).T for k in range(3)], 1)
        return np.concatenate([turned.reshape(9, -1), tangent, np.zeros((3, len(s)))])

    def ends(base, end):
        return np.concatenate([base[:9] - np.eye(3).ravel(), base[9:12], end[9:12] - end[12:15]])

    first = np.zeros((15, 61))
    first[:9] = np.eye(3).ravel()[:, None]
    first[9:12] = rod.rest.point_mm(steps).T
    first[12:] = found.point[:, None] + 0.5
    solved = solve_bvp(rates, ends, steps, first, tol=1e-10, max_nodes=20000)
    assert solved.success
    assert np.abs(found.point - solved.y[9:12, -1]).max() < 1e-7 * arc
    turn = solved.y[:9, -1].reshape(3, 3)
    assert found.tangent == pytest.approx(turn @ rod.rest.tangent(arc), abs=1e-7)


@pytest.mark.parametrize("part", range(4))
def test_answers_equal_finite_differences(part):
    """Central differences of 1e-4 relative: truncation 1e-8, cancellation 1e-13/1e-4."""
    beam, at = KirchhoffRod(VIBRISSA), unknowns(VIBRISSA, 1.0, 30.0)
    here = beam.solve(HUB, at, None)
    step = 1e-4 * abs(at[part]) * np.eye(4)[part]
    up, down = (beam.solve(HUB, at + sign * step, None) for sign in (1, -1))
    for name in ("point", "tangent"):
        by = getattr(here, f"{name}_by")[:, part]
        difference = (getattr(up, name) - getattr(down, name)) / (2 * step[part])
        assert by == pytest.approx(difference, abs=1e-6 * np.abs(by).max())


@pytest.mark.parametrize("larger", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("modulus_GPa", [1e-3, 3.0, 1e3])
def test_the_shape_has_no_scale(larger, modulus_GPa):
    """In parts of its length, under a load in parts of EI/s², a rod of any size and stiffness is one."""
    rod = Rod(
        "tapered",
        45.0 * larger,
        0.2 * larger,
        modulus_GPa,
        rest=RestShape(45.0 * larger, 0.1 * larger, 6.0 * larger, 2.0 * larger),
        tip_diameter_mm=0.01 * larger,
    )
    here = KirchhoffRod(rod).solve(HUB, unknowns(rod, 1.0, 30.0 * larger), None)
    one = KirchhoffRod(VIBRISSA).solve(HUB, unknowns(VIBRISSA, 1.0, 30.0), None)
    assert here.point / larger == pytest.approx(one.point, rel=1e-9)
    assert here.tangent == pytest.approx(one.tangent, rel=1e-9)
    assert here.point_by[:, 3] == pytest.approx(one.point_by[:, 3], rel=1e-9)


def test_twice_the_nodes_change_nothing():
    """16 nodes of a cylinder and 32 of a whisker that tapers to a twentieth: 1e-8 of the arc."""
    for rod, arc in ((replace(CYLINDER, rest=RestShape(100.0, 0.2, 8.0)), 60.0), (VIBRISSA, 38.0)):
        at = unknowns(rod, 1.0, arc)
        coarse, fine = (KirchhoffRod(rod, n).solve(HUB, at, None).point for n in (0, 64))
        assert np.abs(coarse - fine).max() < 1e-8 * arc


def test_a_bend_that_the_nodes_do_not_resolve_is_refused():
    with pytest.raises(ArithmeticError, match="too thin"):
        KirchhoffRod(CONE).solve(HUB, unknowns(CONE, 0.01, 98.0), None)


def test_a_load_far_past_buckling_raises():
    with pytest.raises(ArithmeticError, match="no equilibrium found for"):
        KirchhoffRod(VIBRISSA).solve(HUB, unknowns(VIBRISSA, 1e5, 30.0), None)


def test_an_unloaded_shape_that_turns_back_is_refused():
    with pytest.raises(ValueError, match="turn back"):
        RestShape(45.0, set_y_mm=30.0)
