"""The blurred picture of a cylinder against what is known in closed form and against plain integration."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import erf

from vision.wire.cylinder import (
    WAVES,
    _integrated,
    rim_bells,
    round_the_rod,
    shading_basis,
    slopes_of,
)

# Linear between 12 rows a blur and between steps of 5 % in radius over blur: (1/12)²/8 and 0.05²/8, times at most the
# 0.5 of a blurred edge's curvature; and of higher waves somewhat more.
TABLED = 1e-3


@pytest.mark.parametrize(("radius", "blur"), [(0.8, 0.6), (2.7, 0.9), (16.0, 1.5)])
def test_its_first_wave_is_the_blurred_box(radius, blur):
    """Coverage against the error function: exact for a box of any width."""
    u = np.linspace(-6, 6, 121)
    box = 0.5 * (erf((u + radius) / blur / np.sqrt(2)) - erf((u - radius) / blur / np.sqrt(2)))
    found = shading_basis(u, np.array(radius), blur, 4)
    assert np.allclose(found[:, 0], box, atol=TABLED)
    # the bells are slopes of the box, and bend twice as much
    assert np.allclose(found[:, 4:], rim_bells(u, radius, blur), atol=2 * TABLED)
    # differences over 0.1 px: 0.1²/6 times the box's third derivative, 0.4/blur³ at most from each edge
    slope = np.gradient(box, u)
    assert np.allclose(
        -rim_bells(u, radius, blur)[:, 0] / blur, slope, atol=0.1**2 / 6 * 0.8 / blur**3
    )


@pytest.mark.parametrize("offset", [-3.1, -0.4, 1.9, 4.0])
def test_every_wave_is_its_integral_round_the_rod(offset):
    radius, blur = 2.7, 0.93

    def light(t, k):
        bell = np.exp(-0.5 * ((offset - radius * np.sin(t)) / blur) ** 2) / (
            blur * np.sqrt(2 * np.pi)
        )
        return bell * radius * np.cos(t) * round_the_rod(np.array(t), WAVES)[k]

    exact = [quad(light, -np.pi / 2, np.pi / 2, args=(k,), limit=200)[0] for k in range(WAVES)]
    assert np.allclose(
        shading_basis(np.array([offset]), np.array(radius), blur, WAVES)[0, :WAVES],
        exact,
        atol=TABLED,
    )


@pytest.mark.parametrize("taper", [0.05, 0.5])
def test_slopes_are_differences_of_the_basis(rng, taper):
    """Along one radius by tables, along a taper by integration: the same rule."""
    offset = rng.uniform(-5.0, 5.0, (6, 40))
    radius, waves = 2.0 * np.linspace(1.0, 1.0 + taper, 6), rng.normal(0.0, 1.0, (6, WAVES))
    behind, ahead = (shading_basis(offset + d, radius[:, None], 0.8, WAVES) for d in (-0.05, 0.05))
    slopes, curvatures = slopes_of(offset, radius, 0.8, waves)
    # differences over a tenth of a pixel: the next but one derivative, of the order of 1/blur³ (1/blur⁴), times 0.05²/6
    # (0.05²/12); differences twice over rows a twelfth of a blur apart tell the curvature to some 5 % of 0.4/blur²
    for found, expected, most in (
        (slopes, (ahead - behind) / 0.1, 4e-3),
        (curvatures, _integrated_bends(offset, radius, waves.shape[1]), 3e-2),
    ):
        assert np.allclose(found[1], expected[..., 0], atol=most)
        assert np.allclose(
            found[0],
            np.sum(expected[..., :WAVES] * waves[:, None], axis=-1),
            atol=most * np.abs(waves).sum(),
        )


def _integrated_bends(offset, radius, terms):
    """Second differences (s, p, terms + 2) of the basis without tables, whose steps they would show."""
    bends = []
    for own, own_radius in zip(offset, radius):
        behind, here, ahead = (
            _integrated((own + d) / 0.8, own_radius / 0.8, terms) for d in (-0.05, 0.0, 0.05)
        )
        bends.append((ahead - 2.0 * here + behind) / 0.05**2)
    return np.array(bends)


def test_a_cone_is_drawn_to_its_point():
    """Radii to 0 with one just above the least that counts, 0.05 px, which are then all of that one."""
    radius = np.array([0.3, 0.0505, 0.02, 0.0])
    offset = np.broadcast_to(np.linspace(-2, 2, 9), (4, 9))
    found = shading_basis(offset, radius[:, None], 0.9, 4)
    thin = shading_basis(offset[:1], np.array([[0.05]]), 0.9, 4)
    assert np.isfinite(found).all()
    assert found[2] == pytest.approx(thin[0], abs=TABLED)
    assert found[3] == pytest.approx(thin[0], abs=TABLED)
    slopes, curvatures = slopes_of(offset, radius, 0.9, np.ones((4, 3)))
    assert np.isfinite([slopes, curvatures]).all()
