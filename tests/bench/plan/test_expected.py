"""What a bench would give: sigmas as the fit has them, and why there is no truth."""

from dataclasses import replace

import numpy as np
import pytest

from bench.plan.changes import aim_camera
from bench.plan.outlook import QUANTITIES, outlook
from bench.plan.painter import Clamp
from tests.scenes.planned import LINES, cameras_of, protocol_of, staged_of
from vision.geometry.camera import Cameras
from vision.geometry.vision_settings import VisionSettings
from vision.truth.predicted_truth import predict_truth
from vision.truth.sight import find_sight

THETA_RAD = np.radians(3.0)


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    protocol = protocol_of(tmp_path_factory.mktemp("bench"))
    return staged_of(protocol), cameras_of(protocol)


def of(staged, cameras, noise=LINES):
    lines = dict.fromkeys(cameras.names, noise)
    found = predict_truth(staged.known, cameras, lines, Clamp.of(staged))
    return found, outlook(found, lines, THETA_RAD)


def moved(camera, staged, place_mm):
    return aim_camera(camera, camera.name, np.array(place_mm, dtype=float), staged.known.contact_mm)


def test_values_are_those_staged(bench):
    staged, cameras = bench
    found, row = of(staged, cameras)
    mechanics = staged.mechanics
    touch = mechanics.touch
    assert found.truth.d_x_mm.value == pytest.approx(touch.d_x_mm, abs=1e-6)
    assert found.truth.touch_rad.value == pytest.approx(touch.motor_rad, abs=1e-7)
    assert found.truth.beta_rad.value == pytest.approx(
        mechanics.bar.slope(touch.motor_rad, touch.point_mm)[0], abs=1e-9
    )
    # the beam of the fit is one of small angles: within 0.3 µm of the exact rod, and of its contact (docs/truth.md)
    slip = float(mechanics.slip_at(THETA_RAD))
    assert found.truth.at(THETA_RAD).slip_mm.value == pytest.approx(slip, abs=0.005)
    assert row.has_truth and not row.status


def test_sigmas_grow_with_the_lines(bench):
    """Lines twice as uncertain make each sigma larger, and none more than twice as large: priors stay."""
    for wider in (
        replace(LINES, wire_px=2.0 * LINES.wire_px),
        replace(LINES, bar_px=LINES.bar_px * np.array([1.0, 2.0, 2.0])),
    ):
        _, before = of(*bench)
        _, after = of(*bench, wider)
        ratios = np.array([after.sigma[name] / before.sigma[name] for name in QUANTITIES])
        assert np.all(ratios > 1.0) and np.all(ratios < 2.0)


def test_limits_name_the_largest_part(bench):
    _, row = of(*bench, replace(LINES, bar_px=LINES.bar_px * np.array([1.0, 10.0, 10.0])))
    cause, part = row.limits["d_x_mm"]
    assert cause == "bar" and 0.5 < part <= 1.0


def in_a_plane(bench, angles_deg):
    """Both cameras in one plane through the bar, at these angles to it."""
    staged, cameras = bench
    axis = staged.known.axis.direction
    aside = np.cross(axis, [1.0, 0.0, 0.0])
    places = [
        staged.known.axis.point_mm + 350.0 * (np.cos(a) * axis + np.sin(a) * aside)
        for a in np.radians(angles_deg)
    ]
    return Cameras(tuple(moved(camera, staged, place) for camera, place in zip(cameras, places)))


def test_cameras_on_one_side_of_the_bar_give_no_truth(bench):
    """In one plane through the bar they do not tell how it leans in it."""
    _, row = of(bench[0], in_a_plane(bench, [60.0, 100.0]))
    assert not row.has_truth and row.status


def test_a_camera_along_the_bar_is_said(bench):
    _, row = of(bench[0], in_a_plane(bench, [8.0, 90.0]))
    assert [
        sentence
        for sentence in row.obstacles
        if "camera high looks along the bar (8 deg" in sentence
    ]


def test_a_whisker_outside_the_picture_is_said(bench):
    staged, cameras = bench
    high = cameras["high"]
    away = replace(high, matrix=high.matrix + np.array([[0, 0, 700.0], [0, 0, 0], [0, 0, 0]]))
    _, row = of(staged, Cameras((away, cameras["low"])))
    assert any(
        "camera high" in sentence and "outside its picture" in sentence
        for sentence in row.obstacles
    )


def test_the_clamp_hides_what_it_stands_before(bench):
    """From above, along the bar, its clamp covers the contact; with the clamp gone nothing is hidden."""
    staged, cameras = bench
    place = staged.known.contact_mm + 350.0 * staged.known.axis.direction
    above = moved(cameras["high"], staged, place)
    behind = find_sight(staged.known, above, VisionSettings(), Clamp.of(staged))
    open_ = find_sight(staged.known, above, VisionSettings())
    assert behind.hidden > 0.05 and open_.hidden == 0.0
    assert len(behind.pieces) < len(open_.pieces)


def test_a_stroke_that_starts_touching_has_no_truth(bench):
    staged, cameras = bench
    known = staged.known
    late = known.motor_rad > known.touch_rad
    late_frames = replace(
        known,
        motor_rad=known.motor_rad[late],
        time_s=known.time_s[late],
        bend_rad=known.bend_rad[late],
        arc_mm=known.arc_mm[late],
    )
    _, row = of(replace(staged, known=late_frames), cameras)
    assert not row.has_truth and "starts_touching" in row.status.codes
