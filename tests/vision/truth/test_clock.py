"""A camera clock that is off: what it does to a whisk of one direction, and that the stated sigma holds it."""

from dataclasses import replace

import numpy as np
import pytest

from bench.rig.protocol_tables import PicturesTable
from tests.studies.accuracy.coverage import SCALES
from tests.studies.accuracy.scenes import as_problem, begin, draw_scene, line_points
from vision.fit.solve import linearise, solve
from vision.geometry.rods import Rods
from vision.geometry.vision_settings import VisionSettings
from vision.truth.truth_rows import to_whisk
from vision.truth.whisk_pictures import FittedWhisk, WhiskPictures

OFF_S = 0.025


def test_a_clock_that_is_off_is_an_encoder_that_is_off():
    """Frames taken 25 ms later than stated, the motor at a steady speed: touch moves by speed times 25 ms, d_x and
    slope stay, and the lines fit as well: no picture of a forward stroke tells. The rest shape's wide priors pull: a
    turn of 0.4 mm at the tip, believed to 8 mm, costs 0.0025 of a chi², against lines that tell it to under 0.05 mm."""
    scene = draw_scene(0, pictures=PicturesTable(step_deg=1.5))
    exact = as_problem(scene, scene.cameras, scene.wire, scene.bar, line_points(scene))
    time_s = scene.recording.frames.time_s
    speed = float(np.median(np.diff(scene.motor_rad) / np.diff(time_s)))
    late = replace(exact, motor_rad=exact.motor_rad - speed * OFF_S)
    fits = [
        (problem, solve(problem, begin(problem), scales=SCALES)[0]) for problem in (exact, late)
    ]
    whisks = [_whisk(scene, *fit, sigma) for fit, sigma in zip(fits, (0.0, OFF_S))]
    moved = whisks[1].touch_rad.value - whisks[0].touch_rad.value
    assert moved == pytest.approx(-speed * OFF_S, rel=2e-3)
    misfits = [np.sum(linearise(problem, state)[0].residual ** 2) for problem, state in fits]
    assert misfits[1] - misfits[0] < 0.1  # in a chi²: nothing that lines could tell
    assert whisks[1].d_x_mm.value == pytest.approx(
        whisks[0].d_x_mm.value, abs=0.1 * whisks[0].d_x_mm.sigma
    )
    assert whisks[1].beta_rad.value == pytest.approx(
        whisks[0].beta_rad.value, abs=whisks[0].beta_rad.sigma
    )
    # without the clock's sigma the error of touch would be beyond two of its own; with it, it is one
    assert abs(moved) > 2 * whisks[0].touch_rad.sigma
    assert whisks[1].touch_rad.sigma == pytest.approx(
        np.hypot(whisks[0].touch_rad.sigma, speed * OFF_S), rel=0.05
    )


def _whisk(scene, problem, state, clock_sigma_s):
    state, _ = solve(problem, state, scales=(4.0,))
    frames = range(len(problem.motor_rad))
    pictures = WhiskPictures(
        0,
        frames,
        scene.recording.frames.time_s,
        problem.motor_rad,
        (),
        scene.cameras,
        Rods(scene.wire, scene.bar),
        None,
        VisionSettings(clock_sigma_s=clock_sigma_s),
    )
    return to_whisk(pictures, FittedWhisk(problem, state, list(frames)))
