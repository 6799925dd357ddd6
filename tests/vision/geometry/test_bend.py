"""How a rod bends under one force at 0.6 rad, friction along it included, beside the rig's exact rods."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from bench.rig.elastic_rod import RestShape, Rod
from bench.rig.elastica import Bent, Elastica
from bench.rig.kirchhoff_rod import KirchhoffRod
from vision.geometry.centreline import centrelines
from vision.geometry.rods import Wire

ARC_MM, CONTACT_MM, BEND_RAD = np.linspace(0.0, 100.0, 41), 60.0, 0.6


def bent(rod: Rod, pull: float) -> tuple[Elastica, Bent]:
    """Bent by so much by a force across it at the contact, and along it `pull` times as much: its size by secants."""
    elastica = Elastica(rod)
    ahead = np.array([np.cos(BEND_RAD), np.sin(BEND_RAD)])
    way = np.array([-ahead[1], ahead[0]]) + pull * ahead
    sizes, slopes = [0.0, 0.01], [0.0]
    while abs(slopes[-1] - BEND_RAD) > 1e-9:
        found = elastica.solve(*(sizes[-1] * way), CONTACT_MM)
        slopes.append(found.slope)
        rise = (slopes[-1] - slopes[-2]) / (sizes[-1] - sizes[-2])
        sizes.append(sizes[-1] + (BEND_RAD - slopes[-1]) / rise)
    return elastica, found


@pytest.mark.parametrize(("shape", "most_mm"), [("cylinder", 0.003), ("cone", 0.012)])
@pytest.mark.parametrize("pull", [0.0, 0.3])
def test_large_bends_are_those_of_an_elastica(shape, most_mm, pull):
    """A beam of small bends, 2u - u², is 0.05 mm and more away from it."""
    elastica, exact = bent(Rod(shape, 100.0, 1.0, 60.0), pull)
    wire = Wire(shape, 100.0, 1.0)
    curve = centrelines(np.zeros((2, 4)), np.array([BEND_RAD, 0.0]), CONTACT_MM, 0.0, wire, pull)
    true = elastica.curve_mm(exact, ARC_MM)
    assert np.abs(curve.points_mm[:, :2] - true).max() < most_mm


def bent_in_space(rod: Rod, force_N: np.ndarray, contact_mm: float, pull: float) -> np.ndarray:
    """Points (40, 3) of a curved whisker under a force (3,) less what of it is along the whisker, and pull
    times as much along it."""
    exact = KirchhoffRod(rod)
    load = np.append(force_N, contact_mm)
    for _ in range(20):
        along = exact.solve(np.eye(3), load, None).tangent
        across = force_N - (force_N @ along) * along
        load[:3] = across + pull * np.linalg.norm(across) * along
    return exact.curve_mm(load, None, np.linspace(0.0, 1.3 * contact_mm, 40))


@pytest.mark.parametrize("pull", [0.0, 0.2])
@pytest.mark.parametrize(
    ("shape", "length_mm", "set_mm", "contact_mm", "heading_deg"),
    [
        ("cone", 45.0, (-3.0, -4.0), 26.0, 180.0),
        ("cone", 45.0, (4.0, -4.5), 20.0, 130.0),
        ("cylinder", 60.0, (0.8, -0.5), 40.0, 180.0),
    ],
)
def test_a_curved_whisker_bends_and_twists_as_the_exact_rod(
    shape, length_mm, set_mm, contact_mm, heading_deg, pull
):
    """Within 0.3 µm, a tenth of a thin whisker's sigma of slip, where bends are free as in a fit. Curvatures and
    bends that only add up are 1 to 4 µm away from it."""
    rod = Rod(shape, length_mm, 0.2, 3.0, rest=RestShape(length_mm, 0.0, *set_mm))
    wire = Wire(shape, length_mm, 0.2, rest_mm=((0.0, 0.0, set_mm[0]), (0.0, 0.0, set_mm[1])))
    heading = np.radians(heading_deg)
    direction = np.array([0.0, np.cos(heading), np.sin(heading)])
    left = float(rod.width(contact_mm))
    force_N = 0.12 * 6.0 * left**2 / (1.0 + 2.0 * left) * rod.rigidity_Nmm2 / contact_mm**2
    true = bent_in_space(rod, force_N * direction, contact_mm, pull)
    arc_mm = np.linspace(0.0, 1.3 * contact_mm, len(true))

    def off_mm(bend_rad):
        curve = centrelines(np.zeros((2, 4)), bend_rad, contact_mm, 0.0, wire, pull)
        return (curve.at(arc_mm)[0] - true).ravel()

    fitted = least_squares(off_mm, 0.12 * direction[1:] + 1e-3, xtol=1e-12, ftol=1e-12)
    assert np.linalg.norm(fitted.x) == pytest.approx(0.12, rel=0.1)
    assert np.abs(fitted.fun).max() < 0.0003
