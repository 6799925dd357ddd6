"""The whisker's end, by evidence along its curve."""

import numpy as np
import pytest

from vision.geometry.centreline import Curves
from vision.truth.wire_end import _end, _extend

PLACE_MM = np.arange(7.0, 160.0, 2.0)


def evidence(end_mm, rng, scatter=0.2):
    return np.where(end_mm > PLACE_MM, 3.0, 0.0) + scatter * rng.standard_normal(len(PLACE_MM))


@pytest.mark.parametrize("end_mm", [70.0, 90.0, 100.0, 130.0])
def test_the_end_is_where_the_evidence_ends(rng, end_mm):
    found = _end(PLACE_MM, evidence(end_mm, rng), 60.0)
    assert found.value == pytest.approx(end_mm, abs=found.sigma)
    assert found.sigma == pytest.approx(2.0, abs=0.1)


def test_an_end_behind_the_bar_is_known_by_the_gap(rng):
    seen = (PLACE_MM < 62.0) | (PLACE_MM > 80.0)
    found = _end(PLACE_MM[seen], evidence(70.0, rng)[seen], 60.0)
    assert found.value == pytest.approx(71.0) and found.sigma == pytest.approx(
        np.hypot(2.0, 18.0 / np.sqrt(12.0))
    )


def test_a_wire_that_leaves_the_picture_has_no_end(rng):
    seen = PLACE_MM < 104.0
    assert _end(PLACE_MM[seen], evidence(100.0, rng)[seen], 60.0) is None


def test_a_wire_that_hardly_stands_out_has_no_end(rng):
    assert _end(PLACE_MM, 0.2 * evidence(100.0, rng), 60.0) is None
    assert _end(PLACE_MM, evidence(100.0, rng), 5.0) is None


def test_a_curve_goes_straight_on():
    arc = np.linspace(0.0, 100.0, 51)
    flat = Curves(
        arc, np.stack([arc, 0.0 * arc, 0.0 * arc], axis=-1), np.tile([1.0, 0.0, 0.0], (51, 1))
    )
    longer = _extend(flat, 150.0)
    points, _ = longer.at(np.array([50.0, 120.0, 149.0]))
    assert points == pytest.approx(np.array([[50.0, 0, 0], [120.0, 0, 0], [149.0, 0, 0]]))
