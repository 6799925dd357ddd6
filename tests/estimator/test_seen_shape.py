"""Contact, force and give from a shape that one camera sees: against the exact rod, and what it does not tell."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.seen_shape import FEW, NO_END, NOT_PUSHED, SeenShape, contact_of_shape
from estimator.shape_fit import bend
from tests.scenes.seen_shapes import shown

TOLD = {"reach_mm": 3.5, "tilt_sigma_rad": np.radians(5.0)}
MOST_SIGMAS = 3.5  # of four numbers a shape, seeded: one of 2000 sound ones would be beyond


def answer(one, **changed):
    return contact_of_shape(one.seen, one.theta_rad, one.beam, **TOLD | changed)


@pytest.mark.parametrize(
    "scene",
    [
        {"shape": "cone", "beta_deg": 30.0},
        {"shape": "tapered", "d_x_mm": 35.0},
        {"stiffness_N_mm": 0.1},
    ],
    ids=["cone on a slope", "tapered", "soft"],
)
def test_touch_distance_force_and_way_are_within_their_sigmas(scene):
    one = shown(np.random.default_rng(1), off_mm=0.01, **scene)
    said = answer(one)
    assert said.status == ""
    assert (
        abs(said.touch_rad - one.touch_rad) < MOST_SIGMAS * said.touch_sigma_rad < np.radians(0.05)
    )
    assert abs(said.d_x_mm - one.d_x_mm) < MOST_SIGMAS * said.d_x_sigma_mm < 0.03 * one.d_x_mm
    assert abs(said.force_N - one.force_N) < MOST_SIGMAS * said.force_sigma_N < 0.1 * one.force_N
    assert abs(said.moved_mm - one.moved_mm) < MOST_SIGMAS * said.moved_sigma_mm < 0.5


def test_an_object_that_gives_way_has_a_stiffness_and_a_rigid_one_a_least():
    soft, rigid = (shown(np.random.default_rng(2), stiffness_N_mm=k) for k in (0.1, np.inf))
    told = answer(soft)
    assert told.stiffness_N_mm == pytest.approx(0.1, abs=MOST_SIGMAS * told.stiffness_sigma_N_mm)
    assert told.stiffness_sigma_N_mm < 0.01
    held = answer(rigid)
    assert np.isnan(held.stiffness_N_mm)
    assert held.stiffness_low_N_mm > 10 * told.stiffness_low_N_mm


def test_the_rigidity_enters_the_force_alone():
    one = shown(np.random.default_rng(3))
    exact, doubted = answer(one), answer(one, rigidity_share=0.05)
    assert doubted.force_sigma_N == pytest.approx(
        np.hypot(exact.force_sigma_N, 0.05 * exact.force_N)
    )
    assert doubted.d_x_sigma_mm == exact.d_x_sigma_mm


def test_bend_of_a_taper_goes_over_into_that_of_a_cylinder():
    arc, contact = np.array([10.0, 50.0, 90.0]), np.full(3, 60.0)
    assert bend(arc, contact, 0.0) == pytest.approx([550.0, 1750.0, 1800.0])
    assert bend(arc, contact, 1e-9) == pytest.approx([550.0, 1750.0, 1800.0], rel=1e-6)
    steps = (np.arange(40000) + 0.5) * 60.0 / 40000
    whole = np.sum((60.0 - steps) / (1 - 0.008 * steps) ** 4) * 60.0 / 40000
    assert bend(contact[:1], contact[:1], 0.008)[0] == pytest.approx(whole, rel=1e-6)


def test_what_is_not_seen_is_not_told():
    one = shown(np.random.default_rng(4))
    seen = one.seen
    assert contact_of_shape(seen.until(seen.motor_rad[2]), one.theta_rad, one.beam).status == FEW
    assert (
        contact_of_shape(seen.until(one.touch_rad + 0.02), one.theta_rad, one.beam).status
        == NOT_PUSHED
    )
    free = contact_of_shape(seen.until(one.touch_rad - 0.005), 0.01, one.beam)
    assert free.status in (NO_END, NOT_PUSHED)
    assert np.isnan(free.d_x_mm)


def test_impossible_sights_are_refused():
    seen = shown(np.random.default_rng(5)).seen
    with pytest.raises(ValueError, match="sigma_rad must be positive"):
        replace(seen, sigma_rad=0 * seen.sigma_rad)
    with pytest.raises(ValueError, match=r"sight and across \(n, 3\)"):
        SeenShape(
            seen.motor_rad,
            seen.frame,
            np.zeros(2),
            seen.sight,
            seen.across,
            seen.sigma_rad,
            seen.shared_rad,
        )
