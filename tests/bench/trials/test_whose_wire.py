"""A wire that may be another whisker's: by where it starts, and by where the others are."""

from dataclasses import replace

import numpy as np
import pytest

from bench.base.statuses import reason
from bench.records.trial_result import Drawing, SeenTrial
from bench.trials.whose_wire import with_whose
from tests.scenes.results import seen_whisk
from vision.pictures.others import RodLines

PX_PER_MM = 4.0
RADIUS_MM = 0.5


def line(y_px: float, slope: float = 0.0) -> np.ndarray:
    x = np.linspace(0.0, 400.0, 41)
    return np.stack([x, y_px + slope * x], axis=1)


def rod(middle: np.ndarray) -> RodLines:
    return RodLines(np.array([7]), middle[None], np.array([PX_PER_MM * RADIUS_MM]))


STRAIGHT = {camera: {"a": rod(line(100.0)), "b": rod(line(140.0))} for camera in ("left", "right")}
LOOKED = {camera: {"b": rod(line(140.0, -0.1))} for camera in ("left", "right")}


def codes(left: np.ndarray, right: np.ndarray, looked=None) -> tuple[str, ...]:
    """Codes of the status of a whisk whose wire is seen along these lines."""
    drawing = Drawing(7, {"left": {"wire": left}, "right": {"wire": right}})
    seen = SeenTrial((replace(seen_whisk(), overlay={"touch": drawing}),), wire_radius_mm=RADIUS_MM)
    (whisk,) = with_whose(seen, STRAIGHT, looked or LOOKED, "a").whisks
    assert whisk.contradicted == bool(whisk.status)
    return whisk.status.codes


def test_a_wire_on_its_own_base_is_its_own():
    assert not codes(line(101.0, 0.02), line(100.0, -0.03))
    assert not codes(line(107.0), line(100.0))  # 1.75 mm: as clamps may be


def test_wires_that_cross_or_hide_each_other_in_one_camera_are_two():
    assert not codes(line(100.0, 0.1), line(100.0, 0.0))
    assert not codes(line(102.0), line(100.0), LOOKED | {"left": {"b": rod(line(101.0))}})


def test_a_wire_that_starts_at_anothers_base_in_one_camera_may_be_the_others():
    assert codes(line(139.0), line(100.0)) == ("wire_off_its_base", "wire_of_another")


def test_a_wire_far_off_its_base_but_at_none_is_told():
    assert codes(line(90.0), line(100.0)) == ("wire_off_its_base",)


def test_a_wire_that_lies_on_anothers_in_all_cameras_may_be_that():
    on = {camera: {"b": rod(line(103.0))} for camera in ("left", "right")}
    assert codes(line(102.0), line(101.0), on) == ("wire_of_another",)


def test_whisks_without_a_truth_stay_as_they_are():
    seen = SeenTrial((seen_whisk(0, reason("no_pictures")),), wire_radius_mm=RADIUS_MM)
    assert with_whose(seen, STRAIGHT, LOOKED, "a").whisks == seen.whisks


@pytest.mark.parametrize("end", [0.4, 0.6])
def test_what_lies_on_another_counts_by_length(end):
    """Within the sum of both half-widths up to a part of the length: more than half of it is the most."""
    x = np.linspace(0.0, 400.0, 41)
    apart = np.stack([x, np.where(x < 400.0 * end, 103.0, 160.0)], axis=1)
    on = {camera: {"b": rod(apart)} for camera in ("left", "right")}
    assert bool(codes(line(102.0), line(102.0), on)) == (end > 0.5)
