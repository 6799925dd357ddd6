"""A wire that may be another whisker's: by where it starts, and by where the others are."""

import numpy as np
import pytest

from bench.records.trial_result import Drawing, SeenTrial, SeenWhisk
from bench.trials.whose_wire import with_whose
from vision.pictures.others import RodLines
from vision.truth.records import WhiskTruth

PX_PER_MM = 4.0
RADIUS_MM = 0.5


def line(y_px: float, slope: float = 0.0) -> np.ndarray:
    x = np.linspace(0.0, 400.0, 41)
    return np.stack([x, y_px + slope * x], axis=1)


def rod(middle: np.ndarray) -> RodLines:
    return RodLines(np.array([7]), middle[None], np.array([PX_PER_MM * RADIUS_MM]))


STRAIGHT = {camera: {"a": rod(line(100.0)), "b": rod(line(140.0))} for camera in ("left", "right")}
LOOKED = {camera: {"b": rod(line(140.0, -0.1))} for camera in ("left", "right")}


def status(left: np.ndarray, right: np.ndarray, looked=None) -> str:
    drawing = Drawing(7, {"left": {"wire": left}, "right": {"wire": right}})
    seen = SeenTrial(
        (SeenWhisk(WhiskTruth(0), overlay={"touch": drawing}),), wire_radius_mm=RADIUS_MM
    )
    (whisk,) = with_whose(seen, STRAIGHT, looked or LOOKED, "a").whisks
    assert whisk.contradicted == bool(whisk.status)
    return whisk.status


def test_a_wire_on_its_own_base_is_its_own():
    assert status(line(101.0, 0.02), line(100.0, -0.03)) == ""
    assert status(line(107.0), line(100.0)) == ""  # 1.75 mm: as clamps may be


def test_wires_that_cross_or_hide_each_other_in_one_camera_are_two():
    assert status(line(100.0, 0.1), line(100.0, 0.0)) == ""
    assert status(line(102.0), line(100.0), LOOKED | {"left": {"b": rod(line(101.0))}}) == ""


def test_a_wire_that_starts_at_anothers_base_in_one_camera_may_be_the_others():
    found = "its wire starts 9.8 mm beside its base, check base_mm; its wire may be that of b"
    assert status(line(139.0), line(100.0)) == found


def test_a_wire_far_off_its_base_but_at_none_is_told():
    assert (
        status(line(90.0), line(100.0)) == "its wire starts 2.5 mm beside its base, check base_mm"
    )


def test_a_wire_that_lies_on_anothers_in_all_cameras_may_be_that():
    on = {camera: {"b": rod(line(103.0))} for camera in ("left", "right")}
    assert status(line(102.0), line(101.0), on) == "its wire may be that of b"


def test_whisks_without_a_truth_stay_as_they_are():
    seen = SeenTrial((SeenWhisk(WhiskTruth(0), "no pictures"),), wire_radius_mm=RADIUS_MM)
    assert with_whose(seen, STRAIGHT, LOOKED, "a").whisks == seen.whisks


@pytest.mark.parametrize("end", [0.4, 0.6])
def test_what_lies_on_another_counts_by_length(end):
    """Within the sum of both half-widths up to a part of the length: more than half of it is the most."""
    x = np.linspace(0.0, 400.0, 41)
    apart = np.stack([x, np.where(x < 400.0 * end, 103.0, 160.0)], axis=1)
    on = {camera: {"b": rod(apart)} for camera in ("left", "right")}
    assert bool(status(line(102.0), line(102.0), on)) == (end > 0.5)
