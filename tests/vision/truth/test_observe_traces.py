"""Truth by traces without a picture: what places the object, and traces that are of another thing."""

from dataclasses import replace

import numpy as np
import pytest

from tests.scenes.model_scenes import WIRE
from tests.scenes.traced_example import BAR, Example, tracked_bar, true_axis
from vision.geometry.rods import Rods
from vision.geometry.vision_settings import VisionSettings
from vision.truth.object_places import PlacedObject, TrackedObject
from vision.truth.observe_traces import TrialTraces
from vision.truth.whisk_pictures import AxisPrior


@pytest.fixture(scope="module")
def example():
    return Example()


def tracked(example, places_mm=(-15.0, 20.0), *, on_edges=False):
    return TrackedObject(tracked_bar(example, places_mm, on_edges=on_edges))


def see(example, place, traces=None):
    traces = example.traces if traces is None else traces
    recording = TrialTraces(traces, example.time_s, example.motor_rad, place)
    whole = [slice(0, len(example.motor_rad))]
    settings = VisionSettings(check_beam=False)
    (whisk,) = recording.observe(whole, example.cameras, Rods(WIRE, BAR), settings).whisks
    return whisk


def with_u_and_v_exchanged(example):
    points = dict(tracked(example).points)
    points["high"] = replace(points["high"], px=points["high"].px[:, ::-1])
    return TrackedObject(points)


def placed(example, aside_mm=0.0):
    axis = true_axis(example.truth)
    aside = replace(axis, point_mm=axis.point_mm + np.array([0.0, aside_mm, 0.0]))
    return PlacedObject(AxisPrior(aside, np.array([0.1, 0.1, 0.01, 0.01])))


@pytest.mark.parametrize(
    ("place", "most_sigma_mm"),
    [(tracked, 0.1), (lambda e: tracked(e, on_edges=True), 0.1), (placed, 0.15)],
)
def test_the_object_by_points_edges_or_its_place_gives_the_truth(example, place, most_sigma_mm):
    whisk = see(example, place(example))
    assert whisk.status == ""
    for name, scale in (("d_x_mm", 1), ("touch_rad", 180 / np.pi), ("beta_rad", 180 / np.pi)):
        value = getattr(whisk, name)
        error = scale * value.value - example.truth[name.replace("_rad", "_deg")]
        assert abs(error) < 3.0 * scale * value.sigma
    assert abs(whisk.d_x_mm.value - example.truth["d_x_mm"]) < 0.05
    assert whisk.d_x_mm.sigma < most_sigma_mm
    assert np.isfinite(whisk.at(np.radians(3.0)).slip_mm.value)


@pytest.mark.parametrize(
    ("cameras", "change", "said"),
    [
        (("high", "low"), lambda px: px * [-1, 1] + [640.0, 0], "; mirrored left to right it is"),
        (("low",), lambda px: px * [-1, 1] + [640.0, 0], "camera low: mirrored left to right"),
        (("low",), lambda px: px * [1, -1] + [0, 360.0], "camera low: mirrored top to bottom"),
        (("high", "low"), lambda px: px[:, ::-1], "with u and v exchanged it is"),
        (("high",), lambda px: 0.5 * px - 0.25, "camera high: of pictures half as large it is"),
        (
            ("high", "low"),
            lambda px: px + np.array([0, 40.0]),
            "is it of another trial or another camera?",
        ),
    ],
)
def test_traces_of_another_thing_are_named(example, cameras, change, said):
    changed = dict(example.traces)
    for name in cameras:
        changed[name] = replace(changed[name], px=change(changed[name].px))
    whisk = see(example, tracked(example), changed)
    assert whisk.status.codes == ("trace_elsewhere",)
    assert said in whisk.status


@pytest.mark.parametrize(
    ("place", "code", "said"),
    [
        (lambda e: tracked(e, (3.0, 4.0)), "object_points_elsewhere", "at one spot"),
        (
            lambda e: TrackedObject({"high": tracked(e).points["high"]}),
            "object_from_one_side",
            "two cameras or more",
        ),
        (with_u_and_v_exchanged, "object_points_elsewhere", "have the object behind it"),
        (lambda e: placed(e, aside_mm=3.0), "object_points_elsewhere", "are both of one trial?"),
    ],
)
def test_what_places_no_object_is_named(example, place, code, said):
    whisk = see(example, place(example))
    assert whisk.status.codes == (code,)
    assert said in whisk.status
