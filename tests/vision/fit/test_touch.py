"""Which frames touch, from coarse bends and by a fit."""

from dataclasses import replace

import numpy as np
import pytest

from tests.scenes.model_scenes import scene, with_points
from vision.fit.problem import State
from vision.fit.solve import solve
from vision.fit.touch import bends_divide_better, frames_that_touch, unbent_frames
from vision.geometry.refusals import Refused
from vision.truth.strategies import TouchByClearance

MOTOR = np.radians(np.arange(0.8, 6.5, 0.7))


def bends(touch_deg: float, noise_deg: float, rng) -> np.ndarray:
    """Bends (f, 2) that grow by 1.3 degrees a degree from touch on, with noise."""
    size = 1.3 * np.maximum(MOTOR - np.radians(touch_deg), 0.0)
    return size[:, None] * [-0.8, 0.6] + np.radians(noise_deg) * rng.standard_normal(
        (len(MOTOR), 2)
    )


def test_noise_in_the_first_frames_is_no_touch():
    """Bends of 0.3 degrees that are none: beyond the least that counts as seen, and two in a row. A frame to either
    side of touch may be undecided, so that a hinge half a frame off puts none on the wrong side."""
    for seed in range(50):
        touching, free = frames_that_touch(MOTOR, bends(2.4, 0.3, np.random.default_rng(seed)))
        assert not np.any(touching[np.radians(2.4) > MOTOR])
        assert not np.any(free[np.radians(2.4) < MOTOR])
        assert np.all(touching[np.radians(4.6) < MOTOR]) and np.all(free[:2])


def test_without_a_bend_none_touches():
    touching, free = frames_that_touch(MOTOR, bends(9.0, 0.05, np.random.default_rng(0)))
    assert not np.any(touching) and np.all(free)


def test_bends_divide_better_than_a_touch_known_to_no_frame():
    """Frames 0.7 degrees apart: three sigma are a frame at 0.23 degrees. However near each other frames are, a bend is
    sure but a quarter of a degree after touch."""
    assert bends_divide_better(MOTOR, np.radians(0.24)) and not bends_divide_better(
        MOTOR, np.radians(0.23)
    )
    assert not bends_divide_better(MOTOR / 100.0, np.radians(0.08)) and bends_divide_better(
        MOTOR / 100.0, np.radians(0.09)
    )


def fitted(touch_deg, free, rng):
    """Fit a whisk that touches at an angle, its first frames (free,) taken as free and the others as touching."""
    drawn, truth = scene(touch_deg=touch_deg)
    drawn = with_points(drawn, truth, rng)
    touching = np.arange(len(drawn.motor_rad)) >= free
    problem = replace(drawn, touching=touching, bent=touching)
    begin = np.append(truth.vector[: drawn.first_bend], np.zeros(2 * np.sum(touching)))
    return problem, *solve(problem, State(begin, truth.arcs_mm))


def test_a_frame_that_bends_is_not_free(rng):
    """Touch at 2.3 degrees: the third frame, at 2.5, bends by a quarter of a degree."""
    for taken, kept in ((2, 2), (3, 2)):
        problem, state, _ = fitted(2.3, taken, rng)
        free = unbent_frames(problem, state, ~problem.bent)
        assert np.flatnonzero(free).tolist() == list(range(kept))


def test_frames_that_touch_from_the_start_are_no_free_stroke(rng):
    """Frames at 0.7 and 1.6 degrees touch at 0.6. As a rest shape they put touch after both of them."""
    problem, state, covariance = fitted(0.6, 2, rng)
    with pytest.raises(Refused) as refused:
        TouchByClearance().split_by_fit(problem, state, covariance)
    assert refused.value.code == "starts_touching"


def test_a_last_frame_that_bends_is_decided_by_the_fit():
    """It bends by 0.65 degrees, and no other does: by the hinge it may still come within a frame of touch."""
    motor = np.append(MOTOR[:-1], MOTOR[-1] - np.radians(0.01))
    touching, free = TouchByClearance().split_by_bends(
        motor, bends(5.9, 0.0, np.random.default_rng(0))
    )
    assert not np.any(touching) and not free[-1]
    with pytest.raises(Refused):
        TouchByClearance().split_by_bends(motor, bends(9.0, 0.02, np.random.default_rng(0)))


def test_surely_bent_frames_touch_where_the_clearance_decides_on_none(rng):
    """The bar's line says nothing here: touch is known to degrees, and bends to hundredths of them."""
    problem, state, covariance = fitted(2.3, 2, rng)
    vague = covariance.copy()
    vague[:4, :4] += np.eye(4) * 9.0
    still = replace(problem, touching=np.zeros(len(problem.bent), dtype=bool))
    touching, free = TouchByClearance().split_by_fit(still, state, vague)
    assert np.all(touching == problem.bent) and np.all(free == ~problem.bent)
