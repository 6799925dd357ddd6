"""C, EI and section: numbers of the paper's whisker, and integrals over the section that share no formula."""

import numpy as np
import pytest
from scipy.integrate import quad

from estimator.beam import (
    Beam,
    flexural_rigidity,
    moment_in_EI_per_metre,
    second_moment_of_area,
)


def test_second_moment_is_the_integral_over_the_section():
    """I = ∫ y² dA over a disc; quad is good to 1e-8 of it."""
    radius = 0.65
    integral, _ = quad(lambda y: y**2 * 2 * np.sqrt(radius**2 - y**2), -radius, radius)
    assert second_moment_of_area(2 * radius) == pytest.approx(integral, rel=1e-7)


def test_nitinol_wire_of_the_paper():
    """Section V: 1 mm Nitinol; at 60 GPa that is the 2945.2 N·mm² of the session format."""
    assert flexural_rigidity(60.0, 1.0) == pytest.approx(2945.2, abs=0.05)
    assert Beam.from_modulus(60.0, 1.0, 100.0).C_Nmm2 == pytest.approx(3 * 2945.243, rel=1e-6)


def test_rigidity_and_modulus_make_the_same_beam():
    rigidity = flexural_rigidity(60.0, 1.0)
    assert Beam.from_rigidity(rigidity, 100.0, "cone") == Beam.from_modulus(
        60.0, 1.0, 100.0, "cone"
    )
    assert Beam.from_rigidity(rigidity, 100.0).rigidity_Nmm2 == pytest.approx(rigidity, rel=1e-15)


def test_unit_of_figure_8():
    """|m|/EI in 1/m is 1000 |m| [N·mm] / EI [N·mm²]: a curvature of 1/m is one of 0.001/mm."""
    assert moment_in_EI_per_metre(2.9452, 2945.2) == pytest.approx(1.0, rel=1e-15)


@pytest.mark.parametrize(
    "C, length", [(0.0, 100.0), (-1.0, 100.0), (np.inf, 100.0), (np.nan, 100.0), (1.0, 0.0)]
)
def test_impossible_beams_are_refused(C, length):
    with pytest.raises(ValueError, match="must be positive and finite"):
        Beam(C, length)


def test_unknown_shape_is_refused():
    with pytest.raises(ValueError, match="shape = 'prism': must be one of cylinder, cone"):
        Beam(1.0, 1.0, "prism")
