"""A wire of measured diameters: the taper that it may be, and quadrature."""

import numpy as np
import pytest
from scipy.integrate import quad

from vision.geometry import ProfiledWire, Wire, centrelines

WIDTHS = (1.0, -0.35, -0.9, 0.45)


def test_a_taper_by_its_widths_is_that_taper():
    """To 1e-9 of the bend, the quadrature's."""
    sizes = ("tapered", 100.0, 1.0, 0.0, 0.0, 0.2, ((0.0, 0.0, 4.0), (0.0, 0.0, -2.0)))
    rest = np.zeros((2, 4))
    bend = np.array([0.2, 0.05])
    taper, same = (
        centrelines(rest, bend, 70.0, 0.1, wire).points_mm
        for wire in (Wire(*sizes), ProfiledWire(*sizes, widths=(1.0, -0.8)))
    )
    assert np.abs(same - taper).max() < 1e-7


@pytest.mark.parametrize("contact_mm", [20.0, 60.0, 90.0])
def test_the_bend_is_the_integral(contact_mm):
    """From 0.2 of the diameter on."""
    wire = ProfiledWire("tapered", 100.0, 1.0, tip_diameter_mm=0.2, widths=WIDTHS)
    for arc_mm in (5.0, 0.7 * contact_mm, contact_mm):
        exact, _ = quad(
            lambda s: (contact_mm - s) / np.polynomial.polynomial.polyval(s / 100, WIDTHS) ** 4,
            0.0,
            arc_mm,
            epsrel=1e-12,
        )
        found = wire.turn(np.array(arc_mm), np.array(contact_mm))
        assert found == pytest.approx(exact, rel=1e-9)


def test_it_is_uniform_only_where_its_diameters_are_alike():
    assert not ProfiledWire("tapered", 100.0, 1.0, tip_diameter_mm=0.2, widths=WIDTHS).is_uniform
    assert ProfiledWire("cylinder", 100.0, 1.0, widths=(1.0, 0.0)).is_uniform
