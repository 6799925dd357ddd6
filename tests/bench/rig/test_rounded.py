"""Rings, spheres and cones: their derivatives, and that a large one is a straight bar."""

import math

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.rig.bar import TouchedBar, find_first_touch
from bench.rig.elastic_rod import Rod
from bench.rig.linear import rotate_about_z
from bench.rig.protocol import load
from bench.rig.round_objects import TouchedCone, TouchedRing, TouchedSphere
from bench.rig.simulation import simulate
from bench.rig.stick_slip import FrictionCoefficients
from bench.rig.whisk_mechanics import WhiskMechanics
from tests.scenes.rig_sessions import protocol_file

ROD = Rod("cylinder", 100.0, 1.0, 60.0)
TOUCHED = rotate_about_z(np.array([60.0, 0.0, 0.0]), 0.04)


def placed(radius_mm: float = 3.0) -> TouchedBar:
    angles = {"beta_rad": 0.6, "psi_rad": 0.0, "touch_rad": 0.04}
    return TouchedBar.at_contact(d_x_mm=60.0, **angles, radius_mm=radius_mm, whisker_radius_mm=0.5)


def sphere(radius_mm: float) -> TouchedSphere:
    bar = placed(radius_mm)
    return TouchedSphere(bar.point_mm, bar.axis, radius_mm)


def marched(bar: TouchedBar, friction: FrictionCoefficients) -> WhiskMechanics:
    touch, step = find_first_touch(ROD, bar, 0.04, 60.0), math.radians(0.2)
    return WhiskMechanics.run(
        ROD, bar, friction, touch, touch.motor_rad + math.radians(3.0), step_rad=step
    )


def cone(radius_mm: float = 20.0, half_angle_rad: float = 0.35) -> TouchedCone:
    return TouchedCone.from_bar(placed(radius_mm), TOUCHED, half_angle_rad)


THINGS = [placed(), TouchedRing.from_bar(placed(), TOUCHED, 20.0), sphere(20.0), cone()]


@pytest.mark.parametrize("thing", THINGS, ids=type)
def test_what_a_contact_sees_has_these_derivatives(thing):
    """By central differences of 1e-6 mm, whose rounding is 1e-9; the way is that from the foot."""
    point = TOUCHED + np.array([0.3, 0.2, -0.4])
    way, flat, axis, turning = thing.local_bar(point)
    np.testing.assert_allclose(way, point - thing.foot_mm(point), atol=1e-12)
    assert abs(axis @ axis - 1) < 1e-12 and abs(axis @ way) < 1e-12
    ends = [[thing.local_bar(point + sign * h) for sign in (1, -1)] for h in 1e-6 * np.eye(3)]
    for made, number in ((flat, 0), (turning, 2)):
        differences = np.stack([(up[number] - down[number]) / 2e-6 for up, down in ends], -1)
        np.testing.assert_allclose(made, differences, atol=1e-8)


@pytest.mark.parametrize(
    "friction",
    [FrictionCoefficients(0.2, 0.2, 1e-3), FrictionCoefficients(0.3, 0.2, 1e-3)],
    ids=["sliding", "teeth"],
)
def test_a_large_ring_is_a_straight_bar(friction):
    """Of a circle of 1e5 mm the axis turns by 2e-5 over 2 mm of slip: moments to some parts in 1e5."""
    straight, bent = (
        marched(bar, friction) for bar in (placed(), TouchedRing.from_bar(placed(), TOUCHED, 1e5))
    )
    at = straight.touch.motor_rad + np.radians([0.5, 1.5, 2.5])
    np.testing.assert_allclose(
        bent.forward.moments_at(at), straight.forward.moments_at(at), rtol=2e-4
    )
    np.testing.assert_allclose(bent.slip_at(0.04), straight.slip_at(0.04), rtol=2e-4)


def test_a_large_sphere_is_a_plane_as_a_large_bar_is():
    friction = FrictionCoefficients(0.2, 0.2, 1e-3)
    bar, ball = (marched(thing, friction) for thing in (placed(1e6), sphere(1e6)))
    at = bar.touch.motor_rad + np.radians([0.5, 1.5, 2.5])
    np.testing.assert_allclose(ball.forward.moments_at(at), bar.forward.moments_at(at), rtol=2e-5)


def test_force_on_a_sphere_lies_on_the_cone_about_its_normal():
    whisk = marched(sphere(20.0), FrictionCoefficients(0.2, 0.2, 1e-3))
    for state in whisk.forward.states[2:]:
        normal = (state.point_mm - whisk.bar.point_mm) / 20.5
        force = rotate_about_z(state.force_hub_N, state.motor_rad)
        press = force @ normal
        assert np.linalg.norm(state.point_mm - whisk.bar.point_mm) == pytest.approx(20.5, abs=1e-9)
        assert np.linalg.norm(force - press * normal) == pytest.approx(0.2 * press, rel=1e-6)


def test_a_cone_is_touched_where_the_bar_is_and_ends_at_its_tip():
    bar, thing = placed(20.0), cone()
    touch, same = (find_first_touch(ROD, one, 0.04, 60.0) for one in (bar, thing))
    assert same.motor_rad == pytest.approx(touch.motor_rad, abs=1e-9)
    assert thing.slope(0.04, same.point_mm) == pytest.approx(bar.slope(0.04, TOUCHED), abs=1e-9)
    down = -thing.axis
    surface = thing.tip_mm + 30.0 * (
        np.cos(0.35) * down + np.sin(0.35) * np.cross(thing.axis, [1.0, 0.0, 0.0])
    )
    assert thing.outside_mm(np.array([surface, thing.tip_mm + 3.0 * thing.axis]))[
        1
    ] == pytest.approx(3.0)
    with pytest.raises(ArithmeticError, match="past the cone's tip"):
        thing.local_bar(thing.tip_mm + thing.axis + [0.0, 1e-3, 0.0])


@pytest.mark.parametrize(
    "friction",
    [FrictionCoefficients(0.2, 0.2, 1e-3), FrictionCoefficients(0.3, 0.2, 1e-3)],
    ids=["sliding", "teeth"],
)
def test_a_slim_cone_is_a_bar(friction):
    """Of a half-angle of 1e-5 the radius changes by 2e-5 mm over 2 mm of slip."""
    bar, slim = (marched(thing, friction) for thing in (placed(), cone(3.0, 1e-5)))
    at = bar.touch.motor_rad + np.radians([0.5, 1.5, 2.5])
    np.testing.assert_allclose(slim.forward.moments_at(at), bar.forward.moments_at(at), rtol=2e-4)


@pytest.mark.parametrize(
    "said, text",
    [
        ("cone_half_angle_deg belongs to", "cone_half_angle_deg = 10"),
        ("cone_half_angle_deg belongs to", 'object = "cone"'),
        ("1 to 75 is allowed", 'object = "cone"\ncone_half_angle_deg = 80'),
        ("cone_half_angle_deg", 'object = "cone"\ncone_half_angle_deg = -5'),
    ],
)
def test_a_cone_that_cannot_be_is_refused(tmp_path, said, text):
    with pytest.raises(BadInput) as refused:
        load(protocol_file(tmp_path, f"[[trials]]\n{text}\n"))
    assert said in str(refused.value) and "\n" not in str(refused.value)


def test_a_ring_bends_away_from_the_whisker(tmp_path):
    """Above and below the middle an array's whiskers touch later than on the straight bar; trial.toml has the ring."""
    text = "[[columns]]\nheights_mm = [-8, 0, 8]\n[[trials]]\nbeta_scatter_deg = 0\n"
    touches = []
    for name, bent in (("bar", ""), ("ring", 'object = "ring"\nring_diameter_mm = 80\n')):
        made = simulate(
            tmp_path / name, protocol=protocol_file(tmp_path, text + bent), signals_only=True
        )
        rows = sorted(made.glob("trials/*/truth@*.toml"))
        touches.append([float(row.read_text().split()[2]) for row in rows])
    assert 'shape = "ring"' in next(made.glob("trials/*/trial.toml")).read_text()
    below, middle, above = np.subtract(*touches[::-1])
    assert middle == pytest.approx(0.0, abs=1e-6)
    sagitta = 40.0 - math.sqrt(40.0**2 - 8.0**2)
    assert [below, above] == pytest.approx([math.degrees(sagitta / 60.0)] * 2, rel=0.15)
