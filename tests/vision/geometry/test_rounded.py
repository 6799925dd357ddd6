"""Rings, spheres and cones as contacts and cameras see them, held to the rig's own, which share no code with them."""

import numpy as np
import pytest

from bench.rig.bar import TouchedBar
from bench.rig.linear import rotate_about_z
from bench.rig.round_objects import TouchedCone, TouchedRing, TouchedSphere
from tests.scenes.model_scenes import CAMERAS
from vision.geometry.centreline import Curves
from vision.geometry.cone import Cone as SeenCone
from vision.geometry.contact import clearance, closest_arc
from vision.geometry.forms import FORMS, touched_object
from vision.geometry.grazing import sights_beside
from vision.geometry.refusals import Refused
from vision.geometry.ring import Ring as SeenRing
from vision.geometry.rods import Wire
from vision.geometry.rounded import RoundedAxis
from vision.geometry.sphere import Sphere as SeenSphere
from vision.geometry.touched import StatedSizes

WIRE = Wire("cone", 100.0, 3.0)
SPOT = rotate_about_z(np.array([60.0, 0.0, 0.0]), 0.04)


def placed(radius_mm):
    angles = {"beta_rad": 0.6, "psi_rad": 0.05, "touch_rad": 0.04}
    return TouchedBar.at_contact(d_x_mm=60.0, **angles, radius_mm=radius_mm, whisker_radius_mm=0.5)


RING, SPHERE = (
    TouchedRing.from_bar(placed(3.0), SPOT, 25.0),
    TouchedSphere(placed(15.0).point_mm, placed(15.0).axis, 15.0),
)
CONE = TouchedCone.from_bar(placed(6.0), SPOT, 0.3)
THINGS = [
    (RING, RoundedAxis(RING.point_mm, RING.axis, SeenRing(6.0, 0.0, 50.0), SPOT), 3.0),
    (SPHERE, RoundedAxis(SPHERE.point_mm, SPHERE.axis, SeenSphere(30.0), SPOT), 15.0),
    (CONE, RoundedAxis(CONE.tip_mm, CONE.axis, SeenCone(0.3), SPOT), 0.0),
]
each = pytest.mark.parametrize(
    ("thing", "axis", "radius_mm"), THINGS, ids=["ring", "sphere", "cone"]
)


@each
def test_distance_and_slope_are_those_of_the_rig(thing, axis, radius_mm):
    points = SPOT + np.random.default_rng(1).normal(size=(20, 3))
    outside, _ = axis.outside_mm(points)
    np.testing.assert_allclose(outside - radius_mm, thing.outside_mm(points), atol=1e-10)
    np.testing.assert_allclose(
        axis.bar_at(points).direction, [thing.axis_at(p) for p in points], atol=1e-12
    )


@each
def test_sights_graze_the_outline_and_nothing_else_is_as_near(thing, axis, radius_mm):
    """On the surface, at right angles to the normal; 0.1 mm farther out the sight passes by 0.1 mm."""
    camera = CAMERAS.cameras[0]
    points, normals = (
        of.reshape(-1, 3) for of in axis.silhouette(camera.centre_mm, radius_mm, 15.0, 9)
    )
    np.testing.assert_allclose(thing.outside_mm(points), 0.0, atol=1e-9)
    np.testing.assert_allclose(
        np.sum((points - camera.centre_mm) * normals, axis=1), 0.0, atol=1e-9
    )
    far = np.linalg.norm(points - camera.centre_mm, axis=1)
    for away_mm in (0.0, 0.1):
        near = sights_beside(camera, axis, camera.project(points + away_mm * normals), far + 1.0)
        np.testing.assert_allclose(near.outside_mm - radius_mm, away_mm, atol=2e-3 * away_mm + 1e-7)


@each
def test_a_wire_is_nearest_where_none_of_its_points_is_nearer(thing, axis, radius_mm):
    """A straight cone that passes by, slanting; 20 001 points of it are 5 µm apart."""
    ways = np.array([0.98, 0.1, 0.17]) / np.linalg.norm([0.98, 0.1, 0.17])
    base = SPOT - 60.0 * ways - np.array([0.0, 2.0, -1.0])
    arc = np.linspace(0.0, 100.0, 41)
    wire = Curves(arc, base + arc[:, None] * ways, np.tile(ways, (41, 1)))
    along = np.linspace(0.0, 100.0, 20001)
    dense = thing.outside_mm(base + along[:, None] * ways) - WIRE.radius_mm(along)
    distance, at, _ = clearance(wire, axis, WIRE)
    assert distance - radius_mm - WIRE.radius_mm(at) == pytest.approx(dense.min(), abs=1e-6)
    assert at == pytest.approx(0.005 * np.argmin(dense), abs=0.02)
    assert closest_arc(wire, axis, WIRE, at) == pytest.approx(at, abs=1e-4)


def test_a_ring_hides_its_far_side_and_a_sphere_nothing():
    _, ring, radius_mm = THINGS[0]
    edge_on = ring.point_mm + 300.0 * (SPOT - ring.point_mm) / np.linalg.norm(SPOT - ring.point_mm)
    far_side = ring.point_mm - (25.0 + radius_mm + 0.1) * (SPOT - ring.point_mm) / np.linalg.norm(
        SPOT - ring.point_mm
    )
    assert ring.hides_itself(edge_on, far_side[None], radius_mm)[0]
    assert not ring.hides_itself(ring.point_mm + 300.0 * ring.direction, far_side[None], radius_mm)[
        0
    ]
    assert not THINGS[1][1].hides_itself(edge_on, far_side[None], 15.0)[0]


def test_no_outline_from_before_the_tip():
    _, cone, _ = THINGS[2]
    assert np.all(
        np.isnan(cone.silhouette(cone.point_mm + 200.0 * cone.direction, 0.0, 15.0, 5)[0])
    )


@pytest.mark.parametrize(
    ("form", "stated"),
    [
        ("bar", StatedSizes(0.0)),
        ("ring", StatedSizes(6.0, ring_diameter_mm=5.0)),
        ("ring", StatedSizes(6.0)),
        ("sphere", StatedSizes(0.0)),
        ("cone", StatedSizes(half_angle_rad=0.0)),
    ],
)
def test_objects_that_cannot_be_are_refused(form, stated):
    with pytest.raises(Refused):
        touched_object(form, stated)


@pytest.mark.parametrize("form", FORMS)
def test_an_object_has_the_sizes_that_are_stated(form):
    """What a form does not take is not in its sizes, so that the same object is made of them."""
    stated = StatedSizes(6.0, 0.1, ring_diameter_mm=50.0, half_angle_rad=0.3)
    found = touched_object(form, stated)
    assert touched_object(form, found.sizes) == found
    assert found.name == form
