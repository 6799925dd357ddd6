"""Contours by touch alone: what lines enclose of a circle and an ellipse, their noise, and lines that enclose nothing."""

import numpy as np
import pytest

from estimator.contour import OPEN, Contour, TouchingLines, contour

WHISKER_MM = 0.5
BACK_MM = 60.0


def touching(
    directions_deg, half_axes_mm=(20.0, 20.0), sigma_rad=0.0, off_rad=0.0
) -> TouchingLines:
    """Lines that touch an ellipse on their left, each from 60 mm before the contact, turned about there by `off_rad`."""
    direction = np.radians(directions_deg)
    normal = np.stack([-np.sin(direction), np.cos(direction)], axis=-1)
    along = np.stack([np.cos(direction), np.sin(direction)], axis=-1)
    squared = np.square(half_axes_mm) * normal
    contact = -squared / np.linalg.norm(half_axes_mm * normal, axis=-1, keepdims=True)
    none = np.zeros(len(direction))
    return TouchingLines(
        contact - WHISKER_MM * normal - BACK_MM * along,
        direction + off_rad,
        none + sigma_rad,
        none + WHISKER_MM,
        none,
    )


@pytest.mark.parametrize("count", [3, 8, 32])
def test_a_circle_is_enclosed_by_a_regular_polygon(count):
    found = contour(touching(np.linspace(0.0, 360.0, count, endpoint=False)))
    assert found.edge_mm == pytest.approx(40.0 * np.tan(np.pi / count))
    assert np.linalg.norm(found.middle_mm, axis=-1) == pytest.approx(20.0)
    assert np.linalg.norm(found.corner_mm, axis=-1) == pytest.approx(20.0 / np.cos(np.pi / count))


def test_every_edge_of_an_uneven_polygon_touches_the_ellipse():
    """With half axes as units it is a circle: no corner is inside of it, and every edge is one unit from its centre."""
    axes_mm = np.array([30.0, 12.0])
    rng = np.random.default_rng(3)
    directions_deg = np.arange(0.0, 360.0, 24.0) + rng.uniform(0.0, 20.0, 15)
    found = contour(touching(rng.permutation(directions_deg), axes_mm))
    assert sorted(found.line) == list(range(15))
    corners = found.corner_mm / axes_mm
    assert np.linalg.norm(corners, axis=-1).min() > 1.0
    start = np.roll(corners, 1, axis=0)
    along = corners - start
    off = np.abs(along[:, 0] * start[:, 1] - along[:, 1] * start[:, 0])
    assert off / np.linalg.norm(along, axis=-1) == pytest.approx(1.0, abs=1e-12)


def test_sigmas_are_those_of_draws():
    """Of 4000 draws a scatter is known to 1.1 %; four of these are allowed."""
    directions_deg = np.array([10.0, 80.0, 130.0, 200.0, 300.0])
    sigma_rad = 1e-4
    exact = contour(touching(directions_deg, sigma_rad=sigma_rad))
    normal = np.stack(
        [-np.sin(np.radians(directions_deg)), np.cos(np.radians(directions_deg))], axis=-1
    )
    outward = -(normal + np.roll(normal, -1, axis=0))
    outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
    across, out = [], []
    rng = np.random.default_rng(5)
    for off_rad in sigma_rad * rng.standard_normal((4000, 5)):
        drawn = contour(touching(directions_deg, off_rad=off_rad))
        across.append(np.sum((drawn.middle_mm - exact.middle_mm) * normal, axis=-1))
        out.append(np.sum((drawn.corner_mm - exact.corner_mm) * outward, axis=-1))
    assert exact.middle_sigma_mm == pytest.approx(np.std(across, axis=0), rel=0.045)
    assert exact.corner_sigma_mm == pytest.approx(np.std(out, axis=0), rel=0.045)


def test_a_line_that_noise_keeps_off_is_left_out():
    """Turned away by 0.1 rad, 6 mm at the contact, where neighbours at 10° leave a corner 0.3 mm outside."""
    off_rad = np.array([0.0, -0.1, 0.0, 0.0, 0.0])
    found = contour(touching([0.0, 10.0, 20.0, 120.0, 240.0], off_rad=off_rad))
    assert isinstance(found, Contour) and sorted(found.line) == [0, 2, 3, 4]


@pytest.mark.parametrize(
    "directions_deg", [[0.0, 90.0], [0.0, 60.0, 170.0], [5.0, 5.0, 120.0, 240.0]]
)
def test_touches_from_one_side_enclose_nothing(directions_deg):
    assert contour(touching(directions_deg)) is OPEN
