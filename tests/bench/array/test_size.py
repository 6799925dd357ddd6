"""Sizes of objects from touches and distances that are drawn with the errors which are stated of them."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bench.array.cloud import ContactPoint
from bench.array.size import fit_size, fit_sizes, size_lines
from bench.array.surface import SEEN, ObjectSurface
from vision.geometry.rods import Wire

WIRE, UP = Wire("cylinder", 100.0, 1.0), np.array([0.0, 0.0, 1.0])
BASES = [np.array([0.0, y, z]) for y in (0.0, -12.0) for z in (-10.0, 0.0, 10.0)]
BALL = ObjectSurface("sphere", np.array([55.0, 32.0, 2.0]), UP, 30.0)
CONE = ObjectSurface("cone", np.array([55.0, 22.0, 60.0]), UP, 0.0, half_angle_rad=np.radians(20.0))
RING = ObjectSurface("ring", np.array([55.0, 45.0, 2.0]), np.array([1.0, 0.0, 0.0]), 3.0, 40.0)
SURFACES = {surface.shape: surface for surface in (BALL, CONE, RING)}
TOUCH_SIGMA, D_SIGMA, ALPHA_MM = 5e-4, 0.5, 0.8


@cache
def touched(name: str, number: int) -> tuple[float, float]:
    """Arc and angle at which a straight whisker that turns in its plane comes to the surface, by halving."""
    surface, base = SURFACES[name], BASES[number]

    def gap(angle: float) -> tuple[float, float]:
        towards = np.array([np.cos(angle), np.sin(angle), 0.0])
        nearest = surface.nearest_arc_mm(base, towards, WIRE.length_mm)
        return float(surface.distance_mm((base + nearest * towards)[None])[0][0]) - 0.5, nearest

    low, high = -1.0, next(angle for angle in np.arange(-1.0, 1.5, 0.01) if gap(angle)[0] < 0)
    for _ in range(50):
        low, high = (
            (low, (low + high) / 2) if gap((low + high) / 2)[0] < 0 else ((low + high) / 2, high)
        )
    return gap(low)[1], low


def drawn(
    surface: ObjectSurface, rng: np.random.Generator, scale: float = 1.0
) -> list[ContactPoint]:
    """Contacts of all bases, their distances with an error of each and one of all."""
    contacts, common = [], scale * rng.standard_normal()
    for number, base in enumerate(BASES):
        arc, angle = touched(surface.shape, number)
        arc += scale * D_SIGMA * rng.standard_normal() - ALPHA_MM * common
        angle += scale * TOUCH_SIGMA * rng.standard_normal()
        towards, aside = np.array(
            [[np.cos(angle), np.sin(angle), 0.0], [-np.sin(angle), np.cos(angle), 0.0]]
        )
        covariance = (D_SIGMA**2 + ALPHA_MM**2) * np.outer(towards, towards)
        covariance += (arc * TOUCH_SIGMA) ** 2 * np.outer(aside, aside) + 1e-8 * np.outer(UP, UP)
        contacts.append(
            ContactPoint(
                whisker=f"w{number}",
                trial="t",
                whisk=0,
                estimator="with_friction",
                point_mm=base + arc * towards,
                covariance_mm2=covariance,
                normal=np.full(3, np.nan),
                normal_sigma_rad=np.nan,
                status="",
                base_mm=base,
                wire=WIRE,
                by_alpha_mm=-ALPHA_MM,
            )
        )
    return contacts


@pytest.mark.parametrize("surface", [BALL, CONE, RING], ids=lambda surface: surface.shape)
def test_sizes_come_back_from_where_they_are_not_quite_said_to_be(surface, rng):
    """Without noise, begun 2 mm and a twentieth of the size aside: to the steps' accuracy."""
    contacts = drawn(surface, rng, 0.0)
    key = fit_size("t", contacts, surface).surface.form.size
    said = {
        "point_mm": surface.point_mm + np.array([2.0, -1.0, 1.0]),
        key: 1.05 * getattr(surface, key),
    }
    found = fit_size("t", contacts, ObjectSurface(**(vars(surface) | said)))
    assert found.size.value == pytest.approx(getattr(surface, key), rel=1e-4)
    assert not found.status and found.chance > 0.999


def test_sigmas_are_the_scatter(rng):
    """60 draws tell a standard deviation to 9 %: three of these. The friction angle's error is one for all."""
    found = [fit_size("t", drawn(BALL, rng), BALL) for _ in range(60)]
    pulls = [(one.size.value - 30.0) / one.size.sigma for one in found]
    assert np.std(pulls) == pytest.approx(1.0, abs=0.28) and abs(np.mean(pulls)) < 0.39
    assert np.mean([one.chance for one in found]) == pytest.approx(0.5, abs=0.11)


def test_what_is_not_told_is_not_said(rng):
    contacts = drawn(BALL, rng, 0.0)
    few = fit_size("t", contacts[:2], BALL)
    assert few.status.codes == ("contacts_few",) and list(size_lines([few]))
    by_touch = fit_size("t", [replace(contact, status="odd") for contact in contacts], BALL)
    assert by_touch.distances == 0 and by_touch.size.value == pytest.approx(30.0, rel=1e-4)
    assert by_touch.size.sigma > fit_size("t", contacts, BALL).size.sigma
    contacts[0].point_mm[1] += 1.0
    assert fit_size("t", contacts, BALL).status.codes == ("contacts_off_surface",)
    seen = ObjectSurface("bar", np.zeros(3), UP, 3.0, source=SEEN)
    assert not fit_sizes(contacts, {"t": seen, "other": BALL})
