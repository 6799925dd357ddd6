"""How a rod bends under one force at 0.6 rad, friction along it included, beside the rig's exact elastica."""

import numpy as np
import pytest

from bench.rig.elastic_rod import Rod
from bench.rig.elastica import Bent, Elastica
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
