"""By one camera: from line points to sights, to the row and the summary's line; and a camera that there is not."""

from types import SimpleNamespace

import numpy as np
import pytest

from bench.analyses.single_camera import ONE_CAMERA, OneCamera, ShapeSeen
from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.records.trial_result import ByOneCamera
from bench.trials.one_camera import NOT_SHOWN, by_one_camera, require_camera
from estimator.beam import Beam
from estimator.seen_shape import PLANE_UNKNOWN
from tests.scenes.model_scenes import scene, with_points
from tests.scenes.results import seen_whisk
from vision.geometry.centreline import rotation_z
from vision.geometry.reasons import Reason
from vision.truth.records import WhiskTruth
from vision.truth.sight_lines import sights_of
from vision.truth.value import Value

WHISKER = SimpleNamespace(beam=Beam.from_modulus(60.0, 1.0, 100.0), C_sigma_Nmm2=0.0, C_Nmm2=8836.0)


@pytest.fixture(scope="module")
def problem():
    """A whisk of 12 frames at d_x = 60 mm, its line points without noise."""
    return with_points(*scene(frames=12))


def test_sights_pass_through_the_points_that_are_seen(problem):
    """Before touch the curve is the rest shape, within 0.7 mm of a straight line."""
    sights = sights_of(problem, "one")
    first = sights.frame == 0
    place = np.linspace(8.0, 95.0, 30)
    straight = place[:, None] * rotation_z(problem.motor_rad[:1])[0][:, 0]
    aside = (
        straight
        - sights.eye_mm
        - np.einsum("ni,ni->n", straight - sights.eye_mm, sights.sight[first])[:, None]
        * sights.sight[first]
    )
    assert np.linalg.norm(aside, axis=1).max() < 0.7
    assert np.abs(np.einsum("ni,ni->n", sights.across, sights.sight)).max() < 1e-6
    assert sights.sigma_rad == pytest.approx(
        0.05 / 2000.0, rel=0.1
    )  # 0.05 px at a focal length of 2000 px
    assert sights_of(problem, "three") is None


def test_one_camera_tells_the_distance_and_no_force_where_it_looks_aside(problem):
    said = by_one_camera(WhiskTruth(0, None, problem=problem), WHISKER, Settings(one_camera="one"))
    assert said.status == PLANE_UNKNOWN
    assert abs(said.d_x_mm.value - 60.0) < 2.0 * said.d_x_mm.sigma < 3.0
    rest = np.array([[0.05, 0.1, -0.2], [-0.05, 0.1, -0.3]]) @ 0.6 ** np.arange(
        3
    )  # of the scene, at 60 of 100 mm
    nearer_mm = rest[0] - rest[1] * np.tan(np.radians(40.0))
    assert abs(said.touch_rad.value - np.radians(2.3) + nearer_mm / 60.0) < np.radians(0.005)
    assert np.isnan([said.force_N.value, said.stiffness_N_mm]).all()


def test_without_being_asked_and_without_the_camera(problem):
    assert by_one_camera(WhiskTruth(0, None, problem=problem), WHISKER, Settings()) is None
    assert (
        by_one_camera(
            WhiskTruth(0, None, problem=problem), WHISKER, Settings(one_camera="x")
        ).status
        == NOT_SHOWN
    )
    lost = by_one_camera(
        WhiskTruth(0, None, status=Reason("never_touches", "it never touches")),
        WHISKER,
        Settings(one_camera="one"),
    )
    assert lost.status.codes == ("never_touches",)


def test_a_camera_that_took_no_pictures_is_refused():
    session = SimpleNamespace(trials=[SimpleNamespace(camera_sources={"high": None})])
    require_camera(session, Settings(one_camera="high"))
    with pytest.raises(BadInput, match="--one-camera low: cameras are high"):
        require_camera(session, Settings(one_camera="low"))


def test_rows_and_the_line_of_the_summary(tmp_path):
    trial = SimpleNamespace(name="b00", surface="steel", speed_deg_s=10.0)
    result = SimpleNamespace(trial=trial)
    truth = seen_whisk(d_x_mm=Value(60.0, 0.03), touch_rad=Value(0.04, 1e-4))
    found = [
        ShapeSeen(result, truth, ByOneCamera("one", d_x_mm=Value(60.0 + error, 0.4)))
        for error in (0.3, -1.2)
    ]
    OneCamera().write(tmp_path, found)
    head, *rows = (tmp_path / "one_camera.csv").read_text().splitlines()
    assert head == ",".join(ONE_CAMERA.names)
    assert [dict(zip(ONE_CAMERA.names, row.split(",")))["inside"] for row in rows] == ["1", "0"]
    (line,) = OneCamera().lines(found)
    assert line == "one: d_x off by 0.87 mm RMS (stated 0.4); its 95 % interval holds 1 of 2 whisks"
    OneCamera().write(tmp_path / "none", [])
    assert not (tmp_path / "none").exists()
