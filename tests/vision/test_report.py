"""What the row of a whisk says of itself."""

import numpy as np
import pytest

from bench.rig.protocol import PicturesTable
from tests.ladder.scenes import as_problem, begin, draw_scene, line_points
from vision.effort import VisionSettings
from vision.fit import solve
from vision.quantities import jacobians
from vision.report import to_whisk
from vision.uncertainty import Uncertainty


@pytest.mark.parametrize("less_sure, doubted", [(1.0, False), (1e4, True)])
def test_a_slope_that_the_cameras_do_not_tell_is_doubted(less_sure, doubted):
    scene = draw_scene(0, pictures=PicturesTable(step_deg=1.5))
    problem = as_problem(scene, scene.cameras, scene.wire, scene.bar, line_points(scene))
    state, answer = solve(problem, begin(problem), scales=(1e9,) * 6)
    frames = range(len(scene.motor_rad))
    known = Uncertainty(answer, answer * less_sure, 0.0 * answer)
    whisk = to_whisk(0, frames, frames, scene.recording.frames.time_s, scene.motor_rad, problem, state,
                     *jacobians(problem, state), known, [], 3.0, VisionSettings())
    assert (np.degrees(whisk.beta_sigma_rad) > 3.0) == doubted
    assert ("slope is known to" in whisk.status) == doubted
    assert whisk.d_x_mm == pytest.approx(scene.truth.d_x, abs=2e-3)
