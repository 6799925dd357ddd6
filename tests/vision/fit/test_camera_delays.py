"""A camera whose pictures stand in the places of the next is told by the others, whatever the clock says."""

from dataclasses import replace

import numpy as np
import pytest

from tests.scenes.model_scenes import CAMERAS, begun, camera, scene, with_points
from vision.fit.camera_delays import camera_delays
from vision.fit.converged_fit import ConvergedFit
from vision.fit.scatter import inflated_by_residuals
from vision.fit.solve import solve
from vision.geometry.camera import Cameras

THREE = Cameras((*CAMERAS.cameras, camera("three", (-80, -250, 200))))


def delays(rng, cameras, late=(), picture_of=None, hidden=()):
    """Delays by a fit to pictures of which those of the cameras `late` show the frame before.

    Those of the cameras `hidden` show no wire.
    """
    problem, true = scene(frames=9)
    problem = replace(problem, cameras=cameras)
    vector = np.zeros(problem.size)
    count = 2 * int(problem.bent.sum())
    vector[:12] = true.vector[:12]
    vector[-count:] = true.vector[-count:]
    problem = with_points(problem, replace(true, vector=vector), rng)
    seen = {(one.camera, one.frame): one for one in problem.seen if one.frame >= 0}
    shown = []
    for one in problem.seen:
        if cameras.names[one.camera] in hidden:
            continue
        if one.frame >= 1 and cameras.names[one.camera] in late:
            one = replace(one, points=seen[one.camera, one.frame - 1].points)
        shown.append(one)
    problem = replace(problem, seen=shown)
    state, _ = solve(problem, begun(problem, replace(true, vector=vector)))
    problem = inflated_by_residuals(problem, state)
    state, _ = solve(problem, state)
    return camera_delays(ConvergedFit(problem, state), picture_of)


@pytest.mark.parametrize("late", THREE.names)
def test_of_three_cameras_the_late_one_is_told(rng, late):
    """By a third of a frame at least: the rest of it passes for an offset of the camera's lines."""
    found = delays(rng, THREE, (late,))
    worst = max(found, key=lambda name: abs(found[name][0]) / found[name][1])
    delay, sigma = found[worst]
    assert worst == late and delay == pytest.approx(0.65, abs=0.4) and delay > 5.0 * sigma


@pytest.mark.parametrize("seed", range(3))
def test_cameras_that_agree_have_no_delay(seed):
    for delay, sigma in delays(np.random.default_rng(seed), THREE).values():
        assert abs(delay) <= 4.0 * sigma


def test_a_camera_that_shows_no_wire_has_no_delay(rng):
    assert set(delays(rng, THREE, hidden=("three",))) == set(CAMERAS.names)


def test_two_cameras_hardly_tell(rng):
    """What two views a frame apart show is nearly a whisker that stands off its plane."""
    (_, two), (_, three) = (delays(rng, cameras)["two"] for cameras in (CAMERAS, THREE))
    assert two > 1.5 * three


def test_parts_of_one_picture_have_one_delay(rng):
    """Two parts of a picture late by a frame: the picture is, whichever part is looked at."""
    one, two, three = THREE.names
    found = delays(rng, THREE, (one, two), {one: "split", two: "split"})
    assert list(found) == ["split", three]
    delay, sigma = found["split"]
    assert delay == pytest.approx(0.65, abs=0.4) and delay > 5.0 * sigma
    assert found[three][0] == pytest.approx(-delay, abs=3.0 * np.hypot(sigma, found[three][1]))


def test_a_camera_and_its_mirror_have_none(rng):
    assert delays(rng, CAMERAS, picture_of={CAMERAS.names[1]: CAMERAS.names[0]}) == {}
