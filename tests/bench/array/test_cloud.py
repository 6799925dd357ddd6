"""Contacts felt in the rig frame, beside surfaces whose distance is known otherwise."""

import numpy as np
import pytest

from bench.array.cloud import Mount, contacts
from bench.array.shape_verdict import surface_lines, surface_verdict
from bench.array.surface import ObjectSurface
from bench.records.trial_result import (
    EstimateRow,
    FeltWhisk,
    TrialResult,
)
from bench.report.whisk_rows import Z_C_MM
from bench.session.session import Base
from tests.scenes.results import trial_result
from vision.geometry.rods import Wire
from vision.truth.value import Value

WIRE = Wire("cylinder", 100.0, 1.0)
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
BASE = Base("w1", np.column_stack([TURN, [10.0, 20.0, 5.0]]), 0.1, 0.002)
ALPHA = np.radians(10.0)


def felt(d_x_mm=60.0, touch_rad=0.3, beta=0.5, status="") -> TrialResult:
    row = EstimateRow(
        "with_friction", Value(d_x_mm, 0.5), ALPHA, beta, touch_covariance_mm_rad=0.001
    )
    touch, phi = Value(touch_rad, 0.004), Value(beta - ALPHA, 0.03)
    whisk = FeltWhisk(touch_felt_rad=touch, phi_felt_rad=phi, estimates=(row,), status=status)
    return trial_result(felt=(whisk,))


def cloud(result: TrialResult, surface: ObjectSurface | None = None, base: Base = BASE):
    mount = Mount(base, WIRE, ALPHA, 0.05)
    return list(contacts(mount, [result], {"t": surface} if surface else {}))


def test_point_and_covariance_are_those_of_draws():
    """First order against 50,000 draws of d_x, touch, height and base: 0.6 % of scatter, and terms of second order."""
    (contact,) = cloud(felt())
    rng, n = np.random.default_rng(0), 50_000
    polar = rng.multivariate_normal([60.0, 0.3], [[0.25, 0.001], [0.001, 1.6e-5]], n)
    points = np.column_stack(
        [
            polar[:, 0] * np.cos(polar[:, 1]),
            polar[:, 0] * np.sin(polar[:, 1]),
            Z_C_MM.sigma * rng.standard_normal(n),
        ]
    )
    arm = points @ TURN.T
    drawn = (
        arm
        + np.cross(0.002 * rng.standard_normal((n, 3)), arm)
        + [10, 20, 5]
        + 0.1 * rng.standard_normal((n, 3))
    )
    np.testing.assert_allclose(contact.point_mm, drawn.mean(axis=0), atol=0.01)
    size = np.sqrt(np.diag(contact.covariance_mm2))
    np.testing.assert_allclose(
        np.cov(drawn.T) / np.outer(size, size),
        contact.covariance_mm2 / np.outer(size, size),
        atol=0.02,
    )
    assert contact.normal_sigma_rad == pytest.approx(np.hypot(0.03, 0.05))


def bar(along_mm: float) -> tuple[ObjectSurface, Base]:
    """A bar of slope 0.5 that a whisker at the origin touches at 60 mm and 0.3 rad; its point moved along the axis."""
    across, axis = (
        np.array([0.0, -np.cos(0.5), np.sin(0.5)]),
        np.array([0.0, np.sin(0.5), np.cos(0.5)]),
    )
    cos, sin = np.cos(0.3), np.sin(0.3)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    point = turn @ (np.array([60.0, 0.0, 0.0]) - 3.5 * across + along_mm * axis)
    return ObjectSurface("bar", point, turn @ axis, 3.0), Base("w1", np.eye(3, 4), 0.0, 0.0)


def test_a_contact_on_the_surface_is_on_it():
    surface, base = bar(17.0)
    (contact,) = cloud(felt(), surface, base)
    assert contact.distance_mm.value == pytest.approx(0.0, abs=1e-9)
    assert contact.along_mm.value == pytest.approx(0.0, abs=1e-5)
    assert contact.normal_off_rad == pytest.approx(0.0, abs=1e-6)


def test_an_error_of_distance_shows_along_the_whisker_and_one_of_touch_across_it():
    surface, base = bar(0.0)
    (far,) = cloud(felt(61.0), surface, base)
    assert far.along_mm.value == pytest.approx(1.0, abs=1e-5)
    assert far.distance_mm.value == pytest.approx(np.hypot(3.5, 1.0) - 3.5, abs=1e-9)
    assert far.normal_off_rad == pytest.approx(0.0, abs=1e-6)
    (early,) = cloud(felt(touch_rad=0.299), surface, base)
    assert early.distance_mm.value == pytest.approx(60.0 * 0.001 * np.cos(0.5), rel=0.02)
    (leaning,) = cloud(felt(beta=0.6), surface, base)
    assert leaning.normal_off_rad == pytest.approx(0.1, abs=1e-9)


def test_distances_from_rings_and_spheres():
    points = np.array([[23.0, 0.0, 0.0], [0.0, 20.0, 4.0], [0.0, 0.0, 15.0]])
    ring = ObjectSurface("ring", np.zeros(3), np.array([0.0, 0.0, 1.0]), 2.0, 20.0)
    outside, normals = ring.distance_mm(points[:2])
    np.testing.assert_allclose(outside, [1.0, 2.0])
    np.testing.assert_allclose(normals, [[1, 0, 0], [0, 0, 1]], atol=1e-12)
    sphere = ObjectSurface("sphere", np.zeros(3), np.array([0.0, 0.0, 1.0]), 10.0)
    np.testing.assert_allclose(sphere.distance_mm(points)[0], [13.0, np.hypot(20, 4) - 10.0, 5.0])


def test_distances_from_a_cone():
    """Its tip at the origin, pointing up, opening by 30°: beside it, inside, and above the tip."""
    cone = ObjectSurface(
        "cone", np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.0, half_angle_rad=np.pi / 6
    )
    beside = np.array([0.5, 0.0, -np.sqrt(0.75)]) * 10.0 + 2.0 * np.array([np.sqrt(0.75), 0.0, 0.5])
    outside, normals = cone.distance_mm(np.array([beside, [0.0, 1e-9, -4.0], [3.0, 0.0, 4.0]]))
    np.testing.assert_allclose(outside, [2.0, -2.0, 5.0], atol=1e-8)
    np.testing.assert_allclose(
        normals[::2], [[np.sqrt(0.75), 0.0, 0.5], [0.6, 0.0, 0.8]], atol=1e-12
    )


def test_flagged_contacts_are_in_the_table_and_not_in_the_verdict():
    surface, base = bar(0.0)
    sound, flagged = cloud(felt(), surface, base), cloud(felt(80.0, status="odd"), surface, base)
    (line,) = surface_verdict([*sound, *flagged])
    assert "1 contact felt by 1 whisker lie 0.00 mm RMS off the object (manifest)" in line
    assert not list(surface_verdict(flagged)) and not list(surface_lines(flagged))
