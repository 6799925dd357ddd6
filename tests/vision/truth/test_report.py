"""What the row of a whisk says of itself."""

import numpy as np
import pytest

from bench.rig.protocol_tables import PicturesTable
from tests.studies.accuracy.scenes import as_problem, begin, draw_scene, line_points
from vision.fit.solve import solve
from vision.geometry.rods import Rods
from vision.geometry.vision_settings import VisionSettings
from vision.truth.truth_rows import to_whisk
from vision.truth.value import propagated_sigma
from vision.truth.whisk_pictures import FittedWhisk, WhiskPictures


def row_of(noise_of):
    """The row of a scene whose parameters have this noise, and the scene."""
    scene = draw_scene(0, pictures=PicturesTable(step_deg=1.5))
    problem = as_problem(scene, scene.cameras, scene.wire, scene.bar, line_points(scene))
    state, _ = solve(problem, begin(problem), scales=(1e9,) * 6)
    frames = range(len(scene.motor_rad))

    class Noisy(FittedWhisk):
        @property
        def noise_covariance(self):
            return noise_of(self.inverse_normal)

    fitted = Noisy(problem, state, list(frames))
    rods, no_bar = Rods(scene.wire, scene.bar), None
    return scene, to_whisk(
        WhiskPictures(
            0,
            frames,
            scene.recording.frames.time_s,
            scene.motor_rad,
            (),
            scene.cameras,
            rods,
            no_bar,
            VisionSettings(),
        ),
        fitted,
    )


def tilted(by_deg: float):
    """The noise of a bar whose two tilts are known to so much, and all else as it is."""
    tilts = np.array([2, 3])

    def noise(answer):
        more = answer.copy()
        more[tilts, tilts] += np.radians(by_deg) ** 2
        return more

    return noise


@pytest.mark.parametrize(("by_deg", "doubted"), [(0.0, False), (5.0, True)])
def test_a_slope_that_the_cameras_do_not_tell_is_doubted(by_deg, doubted):
    scene, whisk = row_of(tilted(by_deg))
    assert (np.degrees(whisk.beta_rad.sigma) > 3.0) == doubted
    assert ("slope_vague" in whisk.status.codes) == doubted
    assert whisk.d_x_mm.value == pytest.approx(scene.truth.d_x, abs=2e-3)


@pytest.mark.parametrize(
    ("noise_of", "code"),
    [(tilted(30.0), "slope_vague"), (lambda answer: 1e5 * answer, "slip_vague")],
)
def test_where_nothing_is_linear_there_is_no_truth(noise_of, code):
    _, whisk = row_of(noise_of)
    assert np.isnan(whisk.d_x_mm.value) and code in whisk.status.codes
    assert np.isnan(whisk.at(np.radians(3.0)).slip_mm.value)


def test_where_the_wire_is_held_is_known_without_the_slope():
    """A bar tilted by 30 degrees more or less moves the contact along the wire by half a per cent of its distance at
    most, and the wire across itself hardly at all."""
    _, whisk = row_of(tilted(30.0))
    smooth = whisk.smooth
    along_mm = propagated_sigma(smooth.jacobians["along"], smooth.covariance)
    across_mm = propagated_sigma(smooth.jacobians["across_y"], smooth.covariance)
    assert np.all(along_mm < 0.005 * smooth.d_x_mm) and np.all(across_mm < 0.1)
