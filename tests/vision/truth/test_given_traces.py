"""The wire's lines by another program: beside the wire, in the fit, and where they are of another thing."""

from dataclasses import replace

import numpy as np
import pytest

from tests.scenes.model_scenes import CAMERAS, WIRE
from tests.scenes.traced_example import Example
from vision.geometry.centreline import REST_POWERS, unbent_curves
from vision.truth.trace_points import Trace, averaged, beside_wire, lines_along_wire, points_of_wire

CAMERA = CAMERAS.cameras[0]
CURVES = unbent_curves(np.zeros((2, REST_POWERS)), {3: 0.05, 4: 0.1}, WIRE)


def trace_beside(offset_px, line=0, frame=3):
    """A line parallel to the wire's picture, to the right of it as one looks from base to tip."""
    curve_px = CAMERA.project(CURVES[frame].points_mm)
    along = np.gradient(curve_px, axis=0)
    right = np.stack([-along[:, 1], along[:, 0]], axis=1)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    n = len(curve_px)
    of_line = np.full(n, line)
    return Trace(np.full(n, frame), curve_px + offset_px * right, of_line, np.full(n, np.nan))


def test_offsets_are_signed_across_the_wire_and_places_along_it():
    beside = beside_wire(trace_beside(1.5), CAMERA, CURVES)
    np.testing.assert_allclose(beside.offset_px, 1.5, atol=0.01)
    arc_mm = CURVES[3].arc_mm
    inner = arc_mm[(arc_mm > 1.0) & (arc_mm < arc_mm[-1] - 1.0)]
    found = beside.place_mm[(beside.place_mm > 0.9) & (beside.place_mm < arc_mm[-1] - 0.9)]
    np.testing.assert_allclose(found[: len(inner)], inner, atol=0.05)


def test_the_nearest_line_is_the_wires():
    lines = Trace.join(
        [trace_beside(9.0, line=1), trace_beside(2.0, line=5), trace_beside(4.0, 2, 4)]
    )
    beside = beside_wire(lines, CAMERA, CURVES)
    assert lines_along_wire(beside) == {3: 5, 4: 2}
    near = points_of_wire(beside)
    np.testing.assert_allclose(np.unique(near.offset_px.round(1)), [2.0, 4.0])


def test_points_are_averaged_over_segments_with_the_sigma_of_their_mean():
    trace = trace_beside(0.5)
    stated = replace(trace, sigma_px=np.full(len(trace.frame), 0.4))
    beside = beside_wire(stated, CAMERA, {3: CURVES[3]})
    segments = averaged(beside, 20.0)
    count = np.bincount(np.floor(beside.along_px / 20.0).astype(int))
    np.testing.assert_allclose(segments.sigma_px, 0.4 / np.sqrt(count[count > 0]))
    np.testing.assert_allclose(segments.offset_px, 0.5, atol=0.01)


@pytest.fixture(scope="module")
def example():
    return Example()


@pytest.fixture(scope="module")
def seen(example):
    return example.see(example.traces)


def test_traces_of_a_third_of_a_pixel_give_the_distance(example, seen):
    """At 2.5 px a millimetre 0.3 px are 0.12 mm; over the wire and its frames they average out."""
    assert abs(seen.d_x_mm.value - example.truth["d_x_mm"]) < 0.05
    for name, scale in (
        ("d_x_mm", 1.0),
        ("touch_rad", np.degrees(1.0)),
        ("beta_rad", np.degrees(1.0)),
    ):
        value = getattr(seen, name)
        error = scale * value.value - example.truth[name.replace("_rad", "_deg")]
        assert abs(error) < 3.0 * scale * value.sigma
    assert seen.d_x_mm.sigma < 0.05


def test_the_sigma_of_the_points_is_learnt_from_them(example, seen):
    """Of `high`: six points of 0.2 px in a segment of 14 px, 0.2 px over 60 px and 0.1 px that last."""
    assert 0.15 < seen.lines["high"].wire_px < 1.0
    stated = {
        name: replace(one, sigma_px=np.full(len(one.frame), 2.0))
        for name, one in example.traces.items()
    }
    assert example.see(stated).d_x_mm.sigma > 1.2 * seen.d_x_mm.sigma


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda px: px * [-1, 1] + [639.0, 0], "mirrored left to right it is"),
        (lambda px: px * [1, -1] + [0, 359.0], "mirrored top to bottom it is"),
        (lambda px: px[:, ::-1], "with u and v exchanged it is"),
        (lambda px: px + np.array([0, 40.0]), "is it of another trial or another camera?"),
    ],
)
def test_a_trace_of_another_thing_is_named(example, change, said):
    changed = {name: replace(one, px=change(one.px)) for name, one in example.traces.items()}
    seen = example.see(changed)
    assert seen.status.codes == ("trace_elsewhere",)
    assert said in seen.status
    assert np.isnan(seen.d_x_mm.value)


def test_a_mirrored_trace_that_crosses_the_wire_is_named(example):
    """The wire is near the middle of `low`: mirrored it is 2.7 px away, and gave d_x 2.9 sigma off."""
    low = example.traces["low"]
    mirrored = replace(low, px=low.px * [-1, 1] + [640.0, 0])
    seen = example.see({**example.traces, "low": mirrored})
    assert seen.status.codes == ("trace_elsewhere",)
    assert seen.status.startswith("camera low: the trace is 2.7 px from the wire in the pictures")
    assert "; mirrored left to right it is" in seen.status


def test_a_camera_whose_tracker_lost_all_frames_gives_no_line(example):
    """One line does not determine the wire in space: its slip is vague, and there is no distance."""
    lost = example.traces["low"].select(slice(0, 0))
    seen = example.see({"high": example.traces["high"], "low": lost})
    assert np.isnan(seen.lines["low"].wire_px) and np.isfinite(seen.lines["high"].wire_px)
    assert np.isnan(seen.d_x_mm.value)
    assert "slip_vague" in seen.status.codes
