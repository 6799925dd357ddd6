"""Profile fits against pictures whose truth is known: bias and scatter apart.

The pictures are drawn here by brute force (a fine grid, blurred, summed into pixels); nothing of the fit is used.
"""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from vision.line import Noise, cut_pieces, measure_noise, read_band, shading_basis
from vision.trace import trace

SEEN_BLUR = np.hypot(0.9, 12**-0.5)  # the lens and the square pixel
FINE = 8  # fine samples a pixel; the sum over 8 x 8 of them is exact to 1e-3 of the contrast at an edge


def draw_rod(rng, *, angle_deg=3.0, radius=2.8, blur=0.9, offset=0.3, background=None, highlight=0.0, noise=0.0,
             shape=(80, 240)):
    """Picture and rod-less picture of a rod of half-width `radius` px; its axis passes `offset` px below the middle."""
    rows, columns = (np.arange(n * FINE) / FINE + 0.5 / FINE - 0.5 for n in shape)
    y, x = np.meshgrid(rows, columns, indexing="ij")
    behind = np.full(y.shape, 60.0) if background is None else background(x, y)
    slope = np.tan(np.radians(angle_deg))
    across = (y - (shape[0] / 2 + offset) - slope * (x - shape[1] / 2)) * np.cos(np.radians(angle_deg))
    t = np.clip(across / radius, -1, 1)
    radiance = 120.0 + 25.0 * t + highlight * np.exp(-0.5 * ((t + 0.4) / 0.25) ** 2)
    sharp = np.where(np.abs(across) < radius, radiance, behind)
    pictures = [_to_pixels(gaussian_filter(p, blur * FINE)) for p in (sharp, behind)]
    return pictures[0] + noise * rng.standard_normal(shape), pictures[1], slope


def _to_pixels(fine):
    return fine.reshape(fine.shape[0] // FINE, FINE, -1, FINE).mean(axis=(1, 3))


def located(picture, background, slope, *, radius=2.8, blur=SEEN_BLUR, noise=0.5, length=20, terms=8):
    """Offsets found (n,) and their stated sigmas, the curve being a line through the picture's middle."""
    height, width = picture.shape
    x = np.linspace(15.0, width - 15.0, 60)
    curve = np.stack([x, height / 2 + slope * (x - width / 2)], axis=1)
    band = read_band(picture, background, curve, x, np.full(len(x), radius), 12)
    pieces = cut_pieces([band], length, Noise(noise**2, 0.0))
    settled, found, _ = trace(pieces, blur, terms, [0.0], search_px=1.5)
    return np.sum((settled.foot_px - pieces.foot_px) * pieces.normal, axis=1) + found.shift_px, found.sigma_px, slope


def test_shading_basis_is_the_blurred_rod():
    """Coverage against the error function: exact for a box of any width."""
    from scipy.special import erf

    u = np.linspace(-6, 6, 121)
    for radius, blur in ((0.8, 0.6), (2.7, 0.9), (16.0, 1.5)):
        box = 0.5 * (erf((u + radius) / blur / np.sqrt(2)) - erf((u - radius) / blur / np.sqrt(2)))
        # the nearest of 400 values a pixel: 1/800 px times the steepest slope, 1/(sqrt(2 pi) blur); and 1e-4 within
        # the table
        allowed = 1 / 800 / (np.sqrt(2 * np.pi) * blur) + 1e-4
        assert np.allclose(shading_basis(u, np.array(radius), blur, 4)[:, 0], box, atol=allowed)


SQUARES = {
    "flat": None,
    "step of a fifth of the contrast": lambda x, y: np.where(y > 40.0, 60.0, 48.0),
    "printed squares": lambda x, y: np.where((np.floor(x / 30.0) + np.floor(y / 30.0)) % 2 > 0, 20.0, 180.0),
    "shaded wall": lambda x, y: 60.0 + 0.3 * (y - 40.0),
}


@pytest.mark.parametrize("highlight", [0.0, 60.0])
@pytest.mark.parametrize("name", list(SQUARES))
def test_bias_is_under_two_hundredths_of_a_pixel(rng, name, highlight):
    for offset in (0.0, 0.3, -0.45):
        picture, behind, slope = draw_rod(rng, offset=offset, background=SQUARES[name], highlight=highlight)
        shift, _, slope = located(picture, behind, slope, noise=0.5)
        true = offset * np.cos(np.arctan(slope))
        assert abs(np.median(shift) - true) < 0.02


def test_scatter_is_near_the_bound_and_as_stated(rng):
    """Bound for the centre of a bar (vision notes): sigma_n/A sqrt(sqrt(pi) s / (L (1 - exp(-w²/4s²)))).

    The bound knows everything but the centre; a free shading and background cost at most a fifth. 10 pieces x 12
    pictures: the scatter's own sigma is 1/sqrt(2 · 120) = 6.5 %, so two of these are allowed on top.
    """
    noise, length = 3.0, 20
    shifts, sigmas = [], []
    for _ in range(12):
        picture, behind, slope = draw_rod(rng, noise=noise, background=SQUARES["printed squares"])
        shift, sigma, slope = located(picture, behind, slope, noise=noise, length=length)
        shifts.append(shift - 0.3 * np.cos(np.arctan(slope)))
        sigmas.append(sigma)
    z = np.concatenate(shifts) / np.concatenate(sigmas)
    assert 0.85 < np.std(z) < 1.15
    assert abs(np.mean(z)) < 0.5


def test_no_pixel_is_read_twice_and_none_outside(rng):
    picture = np.arange(600.0).reshape(20, 30)
    band = read_band(picture, picture, np.array([[2.0, 3.0], [27.0, 9.0]]), [0.0, 1.0], [2.0, 2.0], 6)
    inside = band.grey[np.isfinite(band.grey)]
    assert len(np.unique(inside)) == len(inside)
    assert np.isnan(band.grey).any()
    assert np.array_equal(band.grey, band.background, equal_nan=True)


def test_noise_is_measured_by_grey_level(rng):
    scene = np.repeat(np.linspace(10, 200, 400)[None], 400, axis=0)
    first, second = (scene + rng.standard_normal(scene.shape) * np.sqrt(2.0 + 0.1 * scene) for _ in range(2))
    noise = measure_noise(first, second)
    # variance of the class medians: 13 000 pixels a class, 1.2 % each; the fit's ends are good to 10 %
    for grey in (30.0, 100.0, 180.0):
        assert noise.sigma(grey) == pytest.approx(np.sqrt(2.0 + 0.1 * grey), rel=0.07)
