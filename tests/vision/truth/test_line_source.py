"""Where line points come from: the fit does not know it, and refuses where there are none."""

from dataclasses import replace

import numpy as np
import pytest

from tests.scenes.planned import LINES, cameras_of, protocol_of, staged_of
from vision.geometry.refusals import Refused
from vision.geometry.vision_settings import VisionSettings
from vision.truth.line_source import StrokeBends
from vision.truth.predicted_lines import PredictedLines
from vision.truth.sight import blank_view, find_sight
from vision.truth.strategies import TouchByClearance
from vision.truth.whisk_fit import ExpectedWhisk, fit_lines

SETTINGS = VisionSettings()


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    protocol = protocol_of(tmp_path_factory.mktemp("bench"))
    return staged_of(protocol), cameras_of(protocol)


def predicted_lines(known, cameras, noise=LINES):
    sights = {camera.name: find_sight(known, camera, SETTINGS) for camera in cameras}
    return PredictedLines(known, cameras, sights, dict.fromkeys(cameras.names, noise))


def test_a_fit_to_predicted_lines_comes_back_to_the_whisk(bench):
    """Its pictures are empty: all that it fits is what the source says. It begins a tenth of a millimetre and of each
    bend beside the whisk, and ends within a hundredth of its sigmas, but for what the beam of the fit lacks."""
    staged, cameras = bench
    known = staged.known
    frames = known.frames_to_fit
    whisk = known.pictured([blank_view(c, frames) for c in cameras], cameras, SETTINGS)
    touch = TouchByClearance()
    touching, free = touch.split_by_bends(whisk.angles_rad, known.bend_rad[frames])
    expected = ExpectedWhisk(
        known.place,
        known.rest_mm + 0.1,
        0.9 * known.bend_rad[frames],
        known.arc_mm[frames],
        touching,
        free,
    )
    fitted = fit_lines(whisk, predicted_lines(known, cameras), expected, touch)
    for name, value in (
        ("d_x", staged.mechanics.touch.d_x_mm),
        ("touch", known.touch_rad),
        ("beta", staged.mechanics.bar.slope(known.touch_rad, known.contact_mm)[0]),
    ):
        found = fitted.of_whisk(name)
        assert abs(found.value - value) < 0.01 * found.sigma


def test_lines_without_wire_or_bar_are_refused(bench):
    staged, cameras = bench
    known = staged.known
    for noise in (replace(LINES, wire_px=np.nan), replace(LINES, bar_px=np.zeros((0, 3)))):
        with pytest.raises(Refused, match="no camera shows enough of the"):
            predicted_lines(known, cameras, noise).all_points(known.place, last=True)


def test_bends_are_those_of_a_like_stroke_at_the_same_angles_and_no_others():
    """The bend grows by 2 rad a rad from an angle of 0.1 on, its other part by half of that."""
    motor_rad = np.array([0.0, 0.1, 0.2, 0.3])
    grown = np.clip(motor_rad - 0.1, 0.0, None)
    stroke = StrokeBends([3, 4, 5, 6], motor_rad, np.column_stack([2.0 * grown, grown]))
    frames = [10, 11, 12]
    asked_rad = np.array([-0.5, 0.25, 0.39])
    assert stroke.at(frames, asked_rad) == pytest.approx(
        np.array([[0, 0], [0.3, 0.15], [0.58, 0.29]])
    )
    assert stroke.at(frames, asked_rad + 0.02) is None
    assert stroke.at(frames[::-1], asked_rad) is None
