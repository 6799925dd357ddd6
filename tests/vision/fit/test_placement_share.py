"""The rig frame's part of the cameras' covariance: kept, carried through files and subsets, and told in the budget."""

from dataclasses import replace

import numpy as np
import pytest

from bench.cameras.cameras_toml import write_cameras
from bench.rig.protocol_tables import PicturesTable
from tests.studies.accuracy.coverage import SCALES
from tests.studies.accuracy.scenes import (
    Sigmas,
    as_problem,
    begin,
    calibrated,
    draw_scene,
    given,
    line_points,
)
from vision.calibration.cameras_file import read_cameras
from vision.fit.converged_fit import ConvergedFit
from vision.fit.covariance import shared_covariance, variance_by_cause
from vision.fit.solve import solve
from vision.geometry.camera import Cameras


def scene_of(rig: float):
    """A scene of few frames whose rig board is known to so many mm and degrees."""
    sigmas = Sigmas(rig_mm=rig, rig_rad=np.radians(rig))
    return draw_scene(0, pictures=PicturesTable(step_deg=1.5), sigmas=sigmas)


@pytest.fixture(scope="module")
def loose() -> Cameras:
    return calibrated(scene_of(0.1), np.random.default_rng(1))


def own_covariance(cameras: Cameras) -> np.ndarray:
    return cameras.covariance - cameras.by_placement @ cameras.placement @ cameras.by_placement.T


def test_without_the_placement_the_covariance_is_that_of_an_exact_rig_board(loose):
    """Corners and lenses do not know how well the board was measured. Both adjustments stop within 1e-2 of a sigma of
    their minimum, and are linear there to as much."""
    exact = calibrated(scene_of(0.0), np.random.default_rng(1))
    scale = np.sqrt(np.diag(loose.covariance))
    assert not exact.placement.any()
    np.testing.assert_allclose(
        own_covariance(loose) / np.outer(scale, scale),
        exact.covariance / np.outer(scale, scale),
        atol=0.02,
    )


def test_files_and_subsets_keep_it(loose, tmp_path):
    write_cameras(tmp_path / "cameras.toml", loose)
    np.testing.assert_array_equal(
        read_cameras(tmp_path / "cameras.toml").placement, loose.placement
    )
    np.testing.assert_array_equal(loose.subset(loose.names[:1]).placement, loose.placement)
    write_cameras(tmp_path / "old.toml", replace(loose, placement=None))
    assert read_cameras(tmp_path / "old.toml").placement is None


def test_the_budget_tells_rig_board_from_lenses(loose):
    scene, rng = scene_of(0.1), np.random.default_rng(2)
    problem = as_problem(scene, loose, *given(scene, rng), line_points(scene, rng))
    state, _ = solve(problem, begin(problem), scales=SCALES)
    fit = ConvergedFit(problem, state)
    gradient = fit.by_parameter.whisk["d_x"]

    def budget(cameras):
        asked = ConvergedFit(replace(problem, cameras=cameras), state)
        whole = float(gradient @ asked.fit_covariance @ gradient)
        return variance_by_cause(asked, gradient), whole

    told, whole = budget(loose)
    untold, _ = budget(replace(loose, placement=None))
    without, _ = budget(Cameras(loose.cameras, own_covariance(loose)))
    assert sum(told.values()) == pytest.approx(whole, rel=1e-6)
    assert told["cameras"] == pytest.approx(without["cameras"], rel=1e-6)
    assert np.isnan(untold["placement"]) and untold["cameras"] == pytest.approx(
        told["cameras"] + told["placement"]
    )
    # all cameras moved together move bar and whisker alike: when they touch stays, to a fiftieth of the board's 0.1°
    touch = variance_by_cause(fit, fit.by_parameter.whisk["touch"])["placement"]
    assert np.sqrt(touch) < 0.02 * np.radians(0.1)
    # a board known to 0.1 mm shifts d_x by about as much, its turns on top
    assert 0.05 < np.sqrt(told["placement"]) < 0.3


def test_a_rig_frame_that_is_elsewhere_moves_the_fit_as_its_derivatives_say(loose):
    """Slip hardly moves, since all cameras move together: what cancels must be of one state. With an inverse of the
    step before, slip moved by 0.003 to 0.004 mm."""
    scene = scene_of(0.1)
    rng = np.random.default_rng(2)
    problem = as_problem(scene, loose, *given(scene, rng), line_points(scene, rng))
    fit = ConvergedFit(problem, solve(problem, begin(problem), scales=SCALES)[0])
    last = fit.last_frame
    for k in (1, 4):  # a turn, a shift
        off = np.sqrt(loose.placement[k, k]) * loose.by_placement[:, k]
        moved = replace(problem, cameras=loose.moved(off))
        again = ConvergedFit(moved, solve(moved, fit.state, scales=SCALES)[0]).measured
        step = fit.parameters_by_camera @ off
        slip = again.frame["slip"][last] - fit.measured.frame["slip"][last]
        assert fit.by_parameter.frame["slip"][last] @ step == pytest.approx(slip, abs=5e-5)
        d_x = again.whisk["d_x"] - fit.measured.whisk["d_x"]
        assert fit.by_parameter.whisk["d_x"] @ step == pytest.approx(d_x, abs=3e-4)


def test_what_whisks_share_is_diameters_light_cameras_and_placement(loose):
    """The causes of the budget add up to it, for d_x and for the contact; a rig board known to 0.1 mm shifts the
    contact by as much, which all whisks have in common."""
    scene = scene_of(0.1)
    rng = np.random.default_rng(2)
    problem = as_problem(scene, loose, *given(scene, rng), line_points(scene, rng))
    fit = ConvergedFit(problem, solve(problem, begin(problem), scales=SCALES)[0])
    by = fit.by_parameter
    shared = shared_covariance(fit)
    for name in ("d_x", "touch", "beta", "x", "y", "z"):
        gradient = by.whisk[name]
        causes = variance_by_cause(fit, gradient)
        parts = [causes[cause] for cause in ("diameters", "light", "cameras", "placement")]
        assert gradient @ shared @ gradient == pytest.approx(sum(parts), rel=1e-6)
        assert gradient @ shared @ gradient < gradient @ fit.fit_covariance @ gradient
    along_z = by.whisk["z"]
    assert 0.1 < np.sqrt(along_z @ shared @ along_z) < 0.4
