"""The encoder and the frames' times against the pictures, and the bar against its diameter: each fault by its cause."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import chdtri

from bench.gauges.matrix import GaugeMatrix
from bench.records.trial_result import FeltWhisk
from bench.session.session import load_session
from bench.session.whisker import Whisker
from bench.trials.consistency import (
    check_bar_width,
    check_camera_delays,
    check_friction_cone,
    check_length,
    check_slope,
    check_turns,
    check_wire_width,
    nominal_slope,
    rate_or_encoder,
)
from bench.trials.felt_trial import _against_pictures
from bench.trials.placing import _misplaced
from bench.trials.readout import Readout
from tests.scenes.model_scenes import begun, scene, with_points
from tests.scenes.results import seen_whisk
from vision.boards.charuco import CharucoBoard
from vision.calibration.place import FALSE_ALARM, Placement, by_board, combine
from vision.fit.converged_fit import ConvergedFit
from vision.fit.scatter import inflated_by_residuals
from vision.fit.solve import solve
from vision.fit.turns import frame_turns
from vision.truth.value import UNKNOWN, Value

SPEED = np.radians(18.0)  # rad/s: 0.9° a frame, 20 frames a second
FRAMES = 9


def warning(rng, spoil=None, kept=None) -> str:
    """What is said of a whisk whose motor angles are not those at which its pictures (noise 0.05 px) were taken.

    spoil: of the true motor angles (f,) those recorded; kept: by frame, which picture it shows.
    """
    problem, truth = scene(frames=FRAMES)
    true = problem.motor_rad
    problem = with_points(problem, truth, rng)
    if kept is not None:
        shown = {f: [one for one in problem.seen if one.frame == f] for f in range(FRAMES)}
        wire = [replace(one, frame=f) for f in range(FRAMES) for one in shown[kept[f]]]
        problem = replace(problem, seen=[*wire, *(one for one in problem.seen if one.frame < 0)])
    problem = replace(problem, motor_rad=true if spoil is None else spoil(true))
    state, _ = solve(problem, begun(problem, truth))
    problem = inflated_by_residuals(problem, state)
    state, _ = solve(problem, state)
    return check_turns(frame_turns(ConvergedFit(problem, state), np.arange(FRAMES)), SPEED)


@pytest.mark.parametrize("draw", range(4))
def test_a_sound_whisk_is_without_a_warning(draw):
    assert warning(np.random.default_rng(draw)) == ""


def test_a_clamp_at_another_angle_is_no_fault(rng):
    assert warning(rng, lambda motor: motor + np.radians(0.8)) == ""


@pytest.mark.parametrize("factor", [1.1, 0.9, 1.03])
def test_encoder_scale_or_frame_rate(rng, factor):
    said = warning(rng, lambda motor: factor * motor)
    found = float(said.split("it turns ")[1].split(" times")[0])
    assert found == pytest.approx(1.0 / factor, abs=0.01)


@pytest.mark.parametrize(
    ("share", "speed", "said"),
    [
        (0.99, 10.0, "so the rate of the frames' times looks to need that factor"),
        (0.99, 10.1, "so motor_deg looks to need that factor"),
        (1.02, 9.804, "so motor_deg looks to need that factor"),
        (0.99, 10.05, "one of them looks to need that factor"),
        (0.99, None, "one of them looks to need that factor"),
    ],
)
def test_the_speed_of_the_motor_tells_frame_rate_and_encoder(share, speed, said):
    """The signals' own speed is that of an encoder's scale, whatever the frames' times are."""
    stated = None if speed is None else np.radians(10.0)
    measured = np.radians(10.0 if speed is None else speed)
    assert rate_or_encoder(share, measured, stated).endswith(said)


@pytest.mark.parametrize("before", [1, 3, 6])
def test_an_encoder_jump(rng, before):
    said = warning(rng, lambda motor: motor + np.radians(0.4) * (np.arange(FRAMES) >= before))
    size = float(said.split("motor_deg jumps by ")[1].split("°")[0])
    assert size == pytest.approx(0.4, abs=0.06)


def test_a_frame_that_shows_the_one_before_it(rng):
    assert "frame 5 looks the same as the one before it" in warning(
        rng, kept=[0, 1, 2, 3, 4, 4, 6, 7, 8]
    )


def test_a_frame_lost_whose_time_stayed(rng):
    def recorded(motor):
        """Pictures 4 and later are the next ones: their true angle is a frame's more than what is recorded."""
        return motor - 0.9 * np.radians(np.arange(FRAMES) >= 4)

    assert "a frame before frame 4 looks lost" in warning(rng, recorded)


def test_a_frame_at_another_time(rng):
    said = warning(rng, lambda motor: motor - np.radians(0.36) * (np.arange(FRAMES) == 3))
    late_ms = float(said.split("frame 3 looks taken ")[1].split(" ms")[0])
    assert late_ms == pytest.approx(20.0, abs=4.0)  # 0.36° at 18°/s


@pytest.fixture
def trial(small_session):
    return load_session(small_session).trial("b60_4")


BOARD = CharucoBoard((8, 6), 15.0, 11.0, "DICT_5X5_100")


def test_a_bar_as_thick_as_said_is_without_a_warning(trial):
    assert check_bar_width({"low": Value(0.97, 0.03), "high": Value(1.0, 0.02)}, trial, BOARD) == ""
    assert check_bar_width({}, trial, BOARD) == ""


def test_a_bar_that_looks_thicker_names_both_lengths_with_what_they_would_need(trial):
    said = check_bar_width({"low": Value(1.45, 0.04), "high": Value(1.52, 0.04)}, trial, BOARD)
    assert said.startswith("the bar looks 1.49 ± 0.05 times as thick as stated")
    assert "diameter_mm would have to be some 8.92 for 6, or square_mm some 10.1 for 15" in said


def test_cameras_that_see_different_widths_do_not_see_the_bar_alone(trial):
    said = check_bar_width({"low": Value(0.98, 0.022), "high": Value(1.21, 0.042)}, trial, BOARD)
    assert said.startswith("the bar looks 0.98 to 1.21 times as thick as stated")
    assert (
        check_bar_width({"low": Value(0.98, 0.03), "high": Value(1.08, 0.042)}, trial, BOARD) == ""
    )


def test_a_diameter_known_badly_is_not_contradicted(trial):
    assert (
        check_bar_width({"low": Value(1.2, 0.02)}, replace(trial, bar_diameter_sigma_mm=0.5), BOARD)
        == ""
    )


@pytest.mark.parametrize(
    ("ends_mm", "length_mm", "said"),
    [
        (
            (100.0, 100.0),
            90.0,
            "the whisker is seen to end 100 ± 2 mm from its base, length_mm says 90",
        ),
        ((100.0, 101.0), 150.0, "length_mm says 150"),
        ((100.0, 102.0), 97.0, ""),
        ((80.0, 100.0), 150.0, ""),  # dark before something dark in one of them
        ((100.0,), 150.0, ""),
    ],
)
def test_a_whisker_of_another_length_is_told_by_two_cameras(ends_mm, length_mm, said):
    whisker = Whisker(
        shape="cylinder", length_mm=length_mm, diameter_mm=1.0, youngs_modulus_GPa=200.0
    )
    found = check_length({str(k): Value(end, 2.0) for k, end in enumerate(ends_mm)}, whisker)
    assert found.endswith(said) and bool(found) == bool(said)


@pytest.mark.parametrize(
    ("looks", "sigma_mm", "said"),
    [
        # what the small session's two cameras say where 1.5 mm are stated for 1
        (
            (Value(0.69, 0.063), Value(0.83, 0.07)),
            0.0,
            "0.76 ± 0.05 times as thick as stated: its diameter_mm would",
        ),
        ((Value(0.69, 0.063), Value(0.83, 0.07)), 0.4, ""),
        ((Value(1.4, 0.05), Value(1.0, 0.05)), 0.0, ""),  # a shadow beside the wire in one of them
        ((Value(1.4, 0.08), Value(1.4, 0.08)), 0.0, ""),  # bloom in both
        ((Value(1.0, 0.14), Value(0.87, 0.1)), 0.0, ""),
        # the only one that tells on b60_4; of 50 views of 27 path-traced scenes none is more than 2.5 sigma too thin
        ((Value(0.69, 0.063),), 0.0, "0.69 ± 0.06 times as thick as stated"),
        ((Value(0.64, 0.14),), 0.0, ""),
        ((), 0.0, ""),
    ],
)
def test_a_whisker_of_another_diameter_is_told_by_cameras_that_do_not_contradict_each_other(
    looks, sigma_mm, said
):
    whisker = Whisker(
        shape="cylinder",
        length_mm=100.0,
        diameter_mm=1.5,
        youngs_modulus_GPa=60.0,
        diameter_sigma_mm=sigma_mm,
    )
    found = check_wire_width({str(k): one for k, one in enumerate(looks)}, whisker)
    assert said in found and bool(found) == bool(said)


def test_a_contradicted_whisk_is_apart_and_names_no_gauge(exact_record, trial):
    seen = exact_record(trial)
    assert not seen.contradicted
    felt = _against_pictures(
        FeltWhisk(status=""), None, None, None, replace(seen, contradicted=True)
    )
    assert felt.apart
    assert felt.status == ""


SIGMA = np.array([0.005, 0.1, 0.005, 0.8, 0.14, 0.12])  # rad and mm, of two strokes of 1.5°
# The covariance of free strokes of 1.5° of one trial.
ONE_TRIAL = np.diag(np.array([0.02, 0.1, 0.0043, 0.13, 0.18, 0.18]) ** 2)


def strokes(session, factor, rng, turned=0.0) -> Placement:
    """What free strokes say where all lengths are taken `factor` times too long, and the axis leans besides."""
    step = np.append([turned, 0.0, 0.0], (1.0 - factor) * session.T_rig_board[:, 3])
    return Placement(step + SIGMA * rng.standard_normal(6), np.diag(SIGMA**2))


@pytest.mark.parametrize("factor", [1.1, 0.9, 1.05])
def test_a_board_at_another_scale_is_told_by_where_the_whisker_turns(small_session, rng, factor):
    session = load_session(small_session)
    exact = by_board(session.T_rig_board, 0.0, 0.0)
    placed = combine(exact, strokes(session, factor, rng))
    said = _misplaced(placed, session, [])
    found = float(str(said).split("; a square_mm of ")[1].split(" for 15 ")[0])
    assert found == pytest.approx(15.0 / factor, abs=0.1)  # 59 mm to the board, known to 0.15


def test_a_board_two_percent_too_large_is_told_though_it_was_placed_by_hand(small_session):
    """The default sigmas of T_rig_board leave χ² of six numbers where chance does; one number tells it.

    What the strokes are off by is left out: 1.02 is 4.4 sigma from 1 here, and 3 are asked for.
    """
    session = load_session(small_session)
    by_hand = by_board(session.T_rig_board, 0.2, np.radians(0.2))
    moved = Placement(-0.02 * np.append(np.zeros(3), session.T_rig_board[:, 3]), ONE_TRIAL)
    placed = combine(by_hand, moved)
    difference = moved.step
    chi2 = difference @ np.linalg.solve(ONE_TRIAL + by_hand.covariance, difference)
    assert chi2 < chdtri(6, FALSE_ALARM)
    assert placed.alarm and placed.scale.is_why and placed.scale.share == pytest.approx(0.02)


def test_sound_boards_are_rarely_taken_for_another_scale(small_session, rng):
    """One in 370: of 1000 draws more than nine are by chance with a probability of 5e-4."""
    session = load_session(small_session)
    by_hand = by_board(session.T_rig_board, 0.2, np.radians(0.2))
    root = np.linalg.cholesky(ONE_TRIAL + by_hand.covariance)
    alarms = 0
    for draw in rng.standard_normal((1000, 6)):
        placed = combine(by_hand, Placement(root @ draw, ONE_TRIAL))
        alarms += placed.scale.is_why
    assert alarms <= 9


def test_a_leaning_axis_is_no_scale(small_session, rng):
    session = load_session(small_session)
    exact = by_board(session.T_rig_board, 0.0, 0.0)
    assert not combine(exact, strokes(session, 1.1, rng, turned=0.1)).scale.is_why


@pytest.mark.parametrize(
    ("beta_deg", "sigma_deg", "nominal", "said"),
    [
        (26.0, 0.8, 0.0, "seen as 26.0 ± 0.8°, beta_deg says 0: check it"),
        (-31.0, 0.2, 30.0, "its sign looks turned"),
        (33.0, 0.2, 30.0, None),  # as a protractor is read
        (26.0, 9.0, 0.0, None),  # a slope that is hardly known
        (26.0, 0.8, None, None),
    ],
)
def test_a_slope_is_held_to_its_nominal_one(beta_deg, sigma_deg, nominal, said, trial):
    beta = Value(np.radians(beta_deg), np.radians(sigma_deg))
    trial = replace(trial, beta_deg=nominal)
    found = check_slope(beta, trial)
    assert said in found if said else found == ""
    assert check_slope(UNKNOWN, trial) == ""


def degrees(value, sigma) -> Value:
    return Value(float(np.radians(value)), float(np.radians(sigma)))


@pytest.mark.parametrize(
    ("phi_deg", "beta_deg", "said"),
    [
        (50.0, 60.0, ""),
        (0.0, 40.0, ""),  # a bar of rubber
        (-50.0, 60.0, "y reversed would be within"),
        (130.0, 60.0, "z reversed would be within"),
        (-130.0, 60.0, "; y and z reversed would be within"),
        (-60.0, 0.0, ""),  # 15° beyond, with a sigma of 5°
        (np.nan, 60.0, ""),
    ],
)
def test_a_whisker_leans_within_frictions_cone(phi_deg, beta_deg, said):
    found = check_friction_cone(degrees(phi_deg, 4.0), degrees(beta_deg, 3.0), "felt")
    assert found.endswith(said) and bool(found) == bool(said)


def test_reversed_gauges_are_told_without_a_picture(trial):
    """By the slope that trial.toml states; what it does not state tells nothing."""
    felt = FeltWhisk(phi_felt_rad=degrees(-50.0, 0.5))
    for beta_deg, apart in ((60.0, True), (-60.0, False), (None, False)):
        unit = SimpleNamespace(trial=replace(trial, beta_deg=beta_deg))
        gauged = Readout(GaugeMatrix(np.eye(2)), is_gauged=True)
        found = _against_pictures(felt, unit, None, gauged, seen_whisk())
        assert found.apart == apart and ("force_reversed" in found.status.codes) == apart
    assert nominal_slope(trial).sigma == pytest.approx(np.radians(3.0))


@pytest.mark.parametrize(
    ("delays", "said"),
    [
        ({"a": Value(0.1, 0.05), "b": Value(-0.1, 0.05)}, ""),
        ({"a": Value(0.6, 0.5), "b": Value(-0.6, 0.5)}, ""),
        (
            {"a": Value(-0.2, 0.03), "b": Value(0.5, 0.03), "c": Value(-0.3, 0.05)},
            "camera b looks 1 frame later than the others",
        ),
        (
            {"a": Value(-0.9, 0.1), "b": Value(0.7, 0.2)},
            "camera a looks 1 frame earlier than camera b",
        ),
        ({"a": Value(0.0, 0.1)}, ""),
    ],
)
def test_a_camera_late_by_a_frame_is_named(delays, said):
    found = check_camera_delays([delays])
    assert found.startswith(said) and bool(found) == bool(said)


@pytest.mark.parametrize(
    ("of_whisks", "is_late"),
    [
        # Of 640 simulated whisks the two with the largest delays, and the others of their trials.
        ([0.31, 0.86, 0.75, 1.04, 0.55, 0.35, 0.98, 1.11, 0.94, 0.27], False),
        # The same trials with that camera late by a frame: 4.8 sigma in two of ten whisks.
        ([1.14, 1.39, 1.05, 1.04, 1.48, 1.73, 0.85, 0.50, 1.11, 1.01], True),
        # A frame lost half-way.
        ([0.1, 0.2, 0.0, 0.1, 0.3, 1.8, 1.7, 1.6, 1.8, 1.9], True),
        ([], False),
    ],
)
def test_the_whisks_of_a_trial_are_tested_together(of_whisks, is_late):
    sigmas = [0.25, 0.43, 0.25, 0.37, 0.28, 0.35, 0.35, 0.276, 0.38, 0.25]
    delays = [
        {"high": Value(-0.1, 0.15), "low": Value(value, sigma)}
        for value, sigma in zip(of_whisks, sigmas)
    ]
    assert bool(check_camera_delays([{}, *delays])) == is_late
