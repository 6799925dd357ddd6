"""Centre, axis and encoder's zero by the swing: exact without noise, as sure as it says, alarmed where due."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tests.scenes.base_lines import STEP, some_lines
from vision.calibration.known_lengths import check_known_lengths
from vision.calibration.place import (
    Placement,
    Scale,
    by_board,
    check_swing_suffices,
    combine,
    move_rig_frame,
    rescale,
)
from vision.calibration.swing import by_strokes, by_swing
from vision.geometry.camera import N_PARAMETERS, Camera, Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rotation import exp_rotation


def test_noiseless_is_exact():
    # Differences by forward steps leave 1e-8 relative; the fan of 10 degrees multiplies by 1/sin(10°) = 6.
    np.testing.assert_allclose(by_swing(some_lines(10.0)).step, STEP, atol=1e-6)


def test_stated_sigmas_are_the_sampled_ones_and_intervals_hold():
    rng = np.random.default_rng(4)
    made = [by_swing(some_lines(8.0, across_mm=0.01, turn_rad=5e-4, rng=rng)) for _ in range(300)]
    error = np.array([m.step for m in made]) - STEP
    sigma = np.sqrt([np.diag(m.covariance) for m in made])
    # 300 draws: a standard deviation scatters by 1/√600 = 4.1 %, so 15 % is 3.7 of these; six components.
    np.testing.assert_allclose(error.std(axis=0) / sigma.mean(axis=0), 1.0, atol=0.15)
    # 1800 intervals, not independent; as if 600 were: ± 0.9 %, three of them.
    assert abs(np.mean(np.abs(error) < 1.96 * sigma) - 0.95) < 0.027


def test_narrow_swings_and_a_board_placed_by_hand_are_combined_as_sure_as_they_are():
    """Axes that noise leans by 10 degrees must not look surer than those that stand upright."""
    rng = np.random.default_rng(6)
    turn_rad = np.radians(0.2)
    board = by_board(np.eye(3, 4), 0.2, turn_rad)
    chi2 = []
    for _ in range(60):
        true = rng.standard_normal(6) * np.repeat([turn_rad, 0.2], 3)
        noise = {"across_mm": 0.003, "turn_rad": 1e-4, "frames": 4}
        strokes = [some_lines(1.6, true, rng=rng, **noise) for _ in range(3)]
        both = combine(board, by_strokes(strokes))
        error = both.step - true
        chi2.append(error @ np.linalg.solve(both.covariance, error))
    # 360 squares: their mean scatters by √(2/360) = 7.5 %, three of these. Linearised where noise leans: 4.
    assert abs(np.mean(chi2) / 6.0 - 1.0) < 0.23


def test_a_narrow_swing_fixes_the_centre_across_but_not_along():
    made = by_swing(some_lines(1.5, across_mm=0.01, turn_rad=5e-4))
    along, across, _ = np.sqrt(np.diag(made.covariance)[3:])
    assert along > 20 * across
    assert f"± {along:.4f} mm along" in made.notes[0]


def test_combined_is_never_less_sure_than_either():
    T = np.column_stack([np.eye(3), [10.0, 40.0, -45.0]])
    board, swing = by_board(T, 0.1, 0.002), by_swing(some_lines(3.0, across_mm=0.01, turn_rad=5e-4))
    both = combine(board, swing)
    for one in (board, swing):
        assert np.linalg.eigvalsh(one.covariance - both.covariance).min() > -1e-12
    assert both.alarm is None


def test_an_exact_board_stays_but_the_alarm_speaks():
    lines = some_lines(8.0, np.array([0, 0, 0, 0.0, 0.5, 0.0]), across_mm=0.01, turn_rad=5e-4)
    both = combine(by_board(np.eye(3, 4), 0.0, 0.0), by_swing(lines))
    np.testing.assert_array_equal(both.step, np.zeros(6))
    assert "across the whisker by +0.5" in both.alarm


def test_alarm_names_the_encoder():
    lines = some_lines(
        8.0, np.array([0, 0, np.radians(0.5), 0, 0, 0]), across_mm=0.01, turn_rad=2e-4
    )
    alarm = combine(by_board(np.eye(3, 4), 0.05, 1e-4), by_swing(lines)).alarm
    # The zero is known to 0.003 degrees here; four of those.
    found = float(re.search(r"encoder's zero is off by ([+-][0-9.]+)", alarm)[1])
    assert abs(found - 0.5) < 0.012


def test_a_whisker_that_turns_less_far_than_the_motor_looks_like_an_axis_that_leans():
    lines = some_lines(12.0, across_mm=0.001, turn_rad=1e-5)
    slow = replace(lines, motor_rad=lines.motor_rad / 0.98)
    both = combine(by_board(np.eye(3, 4), 0.0, 0.0), by_swing(slow))
    assert both.turn_share == pytest.approx(0.98, abs=0.005)
    off = some_lines(8.0, np.array([0, 0, 0, 0.0, 0.5, 0.0]), across_mm=0.01, turn_rad=5e-4)
    assert combine(by_board(np.eye(3, 4), 0.0, 0.0), by_swing(off)).turn_share is None


def test_a_narrow_swing_with_a_board_by_ruler_is_doubted_with_the_width_that_would_do():
    ruler = by_board(np.eye(3, 4), 3.0, 0.05)
    doubt = check_swing_suffices(
        combine(ruler, by_swing(some_lines(1.5, across_mm=0.01, turn_rad=5e-4)))
    )
    assert re.search(r"to 0\.\d{3} mm along the whisker only", doubt)
    needed = float(re.search(r"free strokes of about (\d+) degrees", doubt)[1])
    # A stroke that wide, with frames as close, does.
    wide = some_lines(needed, across_mm=0.01, turn_rad=5e-4, frames=round(30 * needed / 1.5))
    assert check_swing_suffices(combine(ruler, by_swing(wide))) == ""


def test_a_swing_that_tells_less_than_a_ruler_is_refused():
    ruler = by_board(np.eye(3, 4), 3.0, 0.05)
    with pytest.raises(
        Refused,
        match=r"along the whisker; 1 mm is needed: record free strokes of about \d+ degrees",
    ):
        check_swing_suffices(
            combine(ruler, by_swing(some_lines(0.6, across_mm=0.05, turn_rad=2e-3)))
        )


def test_too_few_frames_are_refused():
    with pytest.raises(Refused, match="needs 4 frames"):
        by_swing(some_lines(5.0, frames=3))


def test_cameras_follow_the_frame_and_trade_the_shared_error():
    T = np.column_stack([exp_rotation([2.0, 0.2, 0.1]), [-50.0, 4.0, 370.0]])
    camera = Camera("a", (1280, 720), [[2000, 0, 640], [0, 2000, 360], [0, 0, 1]], np.zeros(5), T)
    before = by_board(np.column_stack([np.eye(3), [10.0, 40.0, -45.0]]), 0.1, 0.002)
    after = Placement(STEP, before.covariance / 4)
    shared = np.zeros((15, 15))
    R = np.kron(np.eye(2), T[:, :3])
    shared[9:, 9:] = R @ before.covariance @ R.T
    moved = move_rig_frame(Cameras((camera,), shared), before, after)
    rig = np.array([[20.0, 3.0, -5.0]])
    old = rig @ exp_rotation(STEP[:3]).T + STEP[3:]
    np.testing.assert_allclose(moved["a"].project(rig), camera.project(old), atol=1e-9)
    np.testing.assert_allclose(moved.covariance, shared / 4, atol=1e-12)
    np.testing.assert_allclose(
        moved.by_placement @ moved.placement @ moved.by_placement.T, shared / 4, atol=1e-12
    )


def test_a_board_at_the_wrong_scale_is_refused_with_the_factor():
    with pytest.raises(Refused, match=r"seem to be 1\.0[34]\d+ ± 0\.00\d+ times"):
        check_known_lengths({"bar": (5.8, 0.02, 6.0, 0.01), "whisker": (96.6, 0.5, 100.0, 0.1)})
    check_known_lengths({"bar": (6.02, 0.02, 6.0, 0.01)})


def test_a_scale_that_the_swing_places_stretches_all_about_the_centre_of_rotation():
    """Where a swing counts alone, T_camera_rig's shift is too long by the share, whatever the board is."""
    board_mm = np.array([10.0, 40.0, -45.0])
    before = by_board(np.column_stack([np.eye(3), board_mm]), 1e3, 10.0, 2e-3)
    both = combine(before, Placement(np.zeros(6), 1e-6 * np.eye(6)))
    T = np.column_stack([exp_rotation([2.0, 0.2, 0.1]), [-50.0, 4.0, 370.0]])
    camera = Camera("a", (1280, 720), [[2000, 0, 640], [0, 2000, 360], [0, 0, 1]], np.zeros(5), T)
    about_board = np.zeros(N_PARAMETERS)
    about_board[-3:] = T[:, :3] @ board_mm + T[:, 3]
    calibrated = Cameras((camera,), 2e-3**2 * np.outer(about_board, about_board))
    stretched = rescale(calibrated, board_mm, both)
    wanted = both.scale.variance * np.outer(T[:, 3], T[:, 3])
    np.testing.assert_allclose(stretched.covariance[-3:, -3:], wanted, rtol=1e-4, atol=1e-6)


def test_a_square_is_as_well_known_as_stated_until_the_swing_contradicts_it():
    """Of right squares intervals of the share hold in 93 to 97 %, and of one 3 % off."""
    rng = np.random.default_rng(6)
    by_share = np.append(np.zeros(3), [-4.0, -39.0, 44.0])
    sigma = 0.0036  # of a board placed by hand

    def held(off: float) -> float:
        true = off + 1e-3 * rng.standard_normal(2000)
        shares = true + sigma * rng.standard_normal(2000)
        variances = [Scale(1e-3, by_share, share, sigma).variance for share in shares]
        return float(np.mean(np.abs(true) < 1.96 * np.sqrt(variances)))

    assert 0.93 < held(0.0) < 0.985
    assert held(0.03) > 0.93
    assert Scale(0.0, by_share, 0.03, sigma).variance == 0.0  # what is exact stays so
