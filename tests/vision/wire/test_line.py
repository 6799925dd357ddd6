"""Profile fits against pictures whose truth is known: bias and scatter apart; and the parts they are made of.

The pictures are those of tests/studies/accuracy/lines.py, drawn by brute force; nothing of the fit is used.
"""

import numpy as np
import pytest

from tests.studies.accuracy.lines import NOISE, PIECE_PX, SCENES, Figures, bounds, find
from vision.pictures.pixel_noise import measure_noise
from vision.wire.bands import read_band

PLAIN = [
    "even rod, flat background",
    "step of a fifth of the contrast",
    "highlight and step",
]
HIGHLIGHT = "within 2° of the rows, highlight"


def test_a_highlight_before_an_even_floor_moves_a_wire_by_no_more_than_is_stated(rng):
    """A dark rim is no edge there: light alone decides where the wire lies, to a tenth of its width."""
    figures = Figures.of(find(SCENES[HIGHLIGHT], rng))
    assert abs(figures.bias) < figures.stated < 0.1 * 2 * SCENES[HIGHLIGHT].radius
    assert figures.ratio < 1.2 * 1.08
    assert 0.85 < figures.z < 1.15
    assert figures.kept > 0.95


@pytest.mark.parametrize("name", PLAIN)
def test_a_wire_is_found_near_the_bound_without_bias_and_as_stated(rng, name):
    """Bias of 0.02 px at most; scatter within 1.2 of the bound that knows all but the centre; z of unit variance.

    299 pieces less 23 places: the scatter is known to 4 %, two of which are allowed on top. Blur and shading unknown,
    noise alone moves the whole wire by 0.014 px (curvature of the evidence), two of which are allowed on the bias;
    tests/studies/accuracy/lines.py averages over repeats.
    """
    figures = Figures.of(find(SCENES[name], rng))
    assert abs(figures.bias) < 0.02 + 2 * 0.014
    assert figures.ratio < 1.2 * 1.08
    assert 0.85 < figures.z < 1.15
    assert figures.kept > 0.95


def test_over_printed_squares_nothing_is_biased_nor_lost(rng):
    """There the bound is some 0.006 px and what is left of the borders' light twice that (tests/studies/accuracy/lines.py)."""
    figures = Figures.of(find(SCENES["highlight over printed squares"], rng))
    assert abs(figures.bias) < 0.02
    assert figures.kept > 0.95
    assert figures.z < 2.2


def test_the_bound_of_an_even_rod_is_the_known_formula():
    """sigma_n/A sqrt(sqrt(pi) s / (L (1 - exp(-w²/4s²)))), s the blur of lens and pixel."""
    scene = SCENES["even rod, flat background"]
    s, contrast = np.hypot(scene.blur, 12**-0.5), 60.0
    formula = (
        NOISE
        / contrast
        * np.sqrt(np.sqrt(np.pi) * s / (PIECE_PX * (1 - np.exp(-(scene.radius**2) / s**2))))
    )
    # the rows lie at up to 6 degrees and the pixel is a box, not a bell: a percent each
    assert np.median(bounds(scene, [0], np.full((110, 300), 60.0))) == pytest.approx(
        formula, rel=0.03
    )


@pytest.mark.parametrize("angle_deg", range(5, 360, 30))
def test_a_band_is_counted_to_the_left_of_its_way_in_any_direction(angle_deg):
    """Pictures of the pixels' own columns and rows: offset and normal say where each of them lies."""
    row, column = np.mgrid[:400, :400].astype(float)
    way = np.array([np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))])
    length = np.linspace(0.0, 150.0, 31)
    band = read_band(column, row, 200.0 + length[:, None] * way, length, np.full(31, 2.0), 5)
    assert np.allclose(band.normal[2:-2], [-way[1], way[0]])  # the ends are rounded to whole pixels
    pixels = np.stack([band.grey, band.background], axis=-1)
    away = np.sum((pixels - band.foot_px[:, None]) * band.normal[:, None], axis=-1)
    assert np.allclose(away[2:-2], band.offset_px[2:-2])


@pytest.mark.parametrize("angle_deg", range(5, 360, 30))
def test_both_edges_of_a_rod_that_widens_lie_half_a_width_from_a_bands_middle(angle_deg):
    """Rows of pixels run across askew, where one edge is farther along than the other. Left over is r (r' sin)², 0.001 px."""
    row, column = np.mgrid[:400, :400].astype(float)
    way = np.array([np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))])
    length = np.linspace(0.0, 150.0, 31)
    radius = 20.0 + 0.01 * (length - 75.0)
    band = read_band(column, row, 200.0 + (length - 75.0)[:, None] * way, length, radius, 40)
    pixels = np.stack([band.grey, band.background], axis=-1)
    along = (pixels - 200.0) @ way
    across = (pixels - 200.0) @ np.array([-way[1], way[0]])
    for side in (-1.0, 1.0):
        beyond_px = side * across - (20.0 + 0.01 * along)
        rows = list(zip(beyond_px, band.offset_px, band.radius_px))
        for distance, offset, half in rows[2:-2]:  # the ends are rounded to whole pixels
            order = np.argsort(distance)
            edge_px = np.interp(0.0, distance[order], offset[order])
            assert edge_px == pytest.approx(side * half, abs=0.002)


def test_no_pixel_is_read_twice_and_none_outside(rng):
    picture = np.arange(600.0).reshape(20, 30)
    band = read_band(
        picture, picture, np.array([[2.0, 3.0], [27.0, 9.0]]), [0.0, 1.0], [2.0, 2.0], 6
    )
    inside = band.grey[np.isfinite(band.grey)]
    assert len(np.unique(inside)) == len(inside)
    assert np.isnan(band.grey).any()
    assert np.array_equal(band.grey, band.background, equal_nan=True)


def test_noise_is_measured_by_grey_level(rng):
    scene = np.repeat(np.linspace(10, 200, 400)[None], 400, axis=0)
    first, second = (
        scene + rng.standard_normal(scene.shape) * np.sqrt(2.0 + 0.1 * scene) for _ in range(2)
    )
    noise = measure_noise(first, second)
    # variance of the class medians: 13 000 pixels a class, 1.2 % each; the fit's ends are good to 10 %
    for grey in (30.0, 100.0, 180.0):
        assert noise.sigma(grey) == pytest.approx(np.sqrt(2.0 + 0.1 * grey), rel=0.07)
