"""What a robot would have answered, and when."""

import math

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.workflows import robot_answers, robot_points, robot_trade
from bench.workflows.expected_error import ExpectedRms
from bench.workflows.robot_answers import Answer, Converter
from bench.workflows.robot_points import front, pool_answers, trade_lines

RATE_HZ = 2000.0


def test_a_filter_makes_a_ramp_late_by_its_delay():
    """After ten time constants a ramp comes out as it was, by the delay before."""
    time_s = np.arange(4000) / RATE_HZ
    ramp = np.stack([time_s, 3.0 * time_s], axis=1)
    converter = Converter(cutoff_Hz=20.0)
    late = converter.convert(ramp, RATE_HZ, np.ones(2))
    np.testing.assert_allclose(
        late[-1], ramp[-1] - np.array([1.0, 3.0]) * converter.delay_s, rtol=1e-3
    )
    still = converter.convert(np.full((50, 2), 0.7), RATE_HZ, np.ones(2))
    np.testing.assert_allclose(still, 0.7)  # it has been settled before


def test_bits_round_to_their_step_of_the_range():
    rng = np.random.default_rng(1)
    own = rng.uniform(-1, 1, (500, 2))
    rounded = Converter(bits=6).convert(own, RATE_HZ, np.array([2.0, 4.0]))
    assert np.abs(rounded - own).max(axis=0) == pytest.approx([1 / 64, 2 / 64], rel=0.02)
    assert len(np.unique(rounded[:, 0])) <= 65


def test_a_cut_off_beyond_half_the_rate_is_none():
    assert not Converter(cutoff_Hz=1000.0).can_filter(RATE_HZ) and Converter(
        cutoff_Hz=400.0
    ).can_filter(RATE_HZ)


@pytest.mark.parametrize(
    "push_deg, speed_deg_s", [(0.5, 10.0), (1.0, 10.0), (3.0, 10.0), (5.0, 200.0), (1.0, 200.0)]
)
def test_the_window_ends_where_the_push_does(push_deg, speed_deg_s):
    """θ and half its window, as `estimator.signal.moment_at` takes it, are the push."""
    push, speed = np.radians([push_deg, speed_deg_s])
    theta = robot_answers._theta_rad(push, speed)
    half = min(
        max(robot_answers.HALF_WINDOW_RAD, speed * robot_answers.HUM_PERIOD_S / 2), 0.9 * theta
    )
    assert theta + half == pytest.approx(push)


def answer(error: float, time_s: float, estimator: str = "with_friction", **other) -> Answer:
    about = {"converter": Converter(), "speed_deg_s": 10.0, "rate_Hz": RATE_HZ, "push_deg": 3.0}
    given = {"expected_percent": 1.0, "noise_percent": 0.75, "truth_source": "pictures"}
    given |= about | other
    return Answer(estimator=estimator, error_percent=error, time_s=time_s, **given)


def test_bias_and_scatter_over_the_whisks():
    """Errors of 1 and 3 %: mean 2, scatter 1, RMS √5; expected 1 and 1 with a noise of 0.75: RMS 1.25."""
    nothing = answer(math.nan, 0.3, noise_percent=math.nan)
    (point,) = pool_answers([answer(1.0, 0.3), answer(3.0, 0.3), nothing])
    assert (point.whisks, point.none, point.time_ms) == (2, 1, 300.0)
    measured = point.error_mean_percent, point.error_sd_percent, point.error_rms_percent
    assert measured == pytest.approx((2.0, 1.0, math.sqrt(5.0)))
    assert (point.expected_sd_percent, point.expected_rms_percent) == pytest.approx((0.75, 1.25))


def test_the_front_is_what_errs_less_than_all_that_is_faster():
    """By what is expected: measured is the same everywhere. 3 % less is no gain."""
    pushed = {1.0: (0.1, 4.0), 2.0: (0.2, 2.0), 3.0: (0.3, 3.0), 4.0: (0.4, 1.0), 5.0: (0.5, 0.97)}
    answers = []
    for push, (time_s, expected) in pushed.items():
        given = {"push_deg": push, "expected_percent": expected, "noise_percent": 0.0}
        answers.append(answer(0.5, time_s, **given))
    points = pool_answers(answers)
    assert front(points).tolist() == [True, True, False, True, False]
    *_, closing = trade_lines(points)
    assert len(list(trade_lines(points))) == 5 and "of 5 choices" in closing


def test_a_distance_for_few_whisks_is_on_no_front():
    """One of four whisks is another question."""
    few = pool_answers(
        [
            *(answer(2.0, 0.3) for _ in range(4)),
            answer(0.1, 0.1, push_deg=1.0, noise_percent=0.1),
            *(answer(math.nan, 0.1, push_deg=1.0) for _ in range(3)),
        ]
    )
    assert front(few).tolist() == [True, False]


def test_the_luckiest_of_many_is_not_on_the_front():
    """100 converters that change nothing, each measured on two whisks: the first is as good as any."""
    rng = np.random.default_rng(3)
    answers = []
    for cutoff in range(100):
        converter = Converter(cutoff_Hz=100.0 + cutoff) if cutoff else Converter()
        for _ in range(2):
            error = 1.0 + 0.75 * rng.standard_normal()
            answers.append(answer(error, 0.3, converter=converter))
    points = pool_answers(answers)
    measured = [point.error_rms_percent for point in points]
    assert min(measured) < 0.3  # what was said of the robot before
    assert np.flatnonzero(front(points)).tolist() == [0]
    assert points[0].expected_rms_percent == pytest.approx(1.25)


def test_an_expectation_that_does_not_hold_is_not_ranked_by():
    """A filter that takes 0.1 s for a push of 0.05 s: the noise is small and the error large."""
    filtered = answer(40.0, 0.1, converter=Converter(cutoff_Hz=5.0), noise_percent=0.1)
    points = pool_answers([filtered, answer(2.0, 0.3)])
    assert points[0].ranked_percent == 40.0 and front(points).tolist() == [True, True]


def test_the_range_holds_95_percent_of_the_rms_errors():
    """Of three whisks, two of them with a bias. 4000 draws: 95 ± 1 % at 3 standard errors, 1 % more for the
    approximation, and as many are below the range as above it within 2 %."""
    biases = np.array([1.0, -2.0, 0.0])
    sigmas = np.array([1.0, 0.5, 2.0])
    expected = ExpectedRms.of_errors(biases, sigmas)
    drawn = biases + sigmas * np.random.default_rng(5).standard_normal((4000, 3))
    rms = np.sqrt(np.mean(drawn**2, axis=1))
    assert np.sqrt(np.mean(rms**2)) == pytest.approx(expected.rms, rel=0.02)
    held = np.mean((rms >= expected.low) & (rms <= expected.high))
    assert held == pytest.approx(0.95, abs=0.02)
    assert ExpectedRms.of_errors(biases, np.zeros(3)).low == pytest.approx(5.0**0.5 / 3.0**0.5)


def test_a_recorded_session(steel_signals, exact_vision, monkeypatch, tmp_path):
    """b60_4: pushed further, (10) errs by less; its filter's delay is in the time; a coarse rate finds no touch."""
    monkeypatch.setattr(robot_answers, "PUSHES_DEG", (1.0, 3.0, 30.0))
    monkeypatch.setattr(
        robot_trade, "CONVERTERS", (Converter(), Converter(cutoff_Hz=20.0), Converter(every=100))
    )
    robot_trade.robot_trade(
        steel_signals, tmp_path, Settings(trials="b60_4", alpha_est_deg=10.5), workers=0
    )
    table = robot_points.ROBOT_TRADE.read(tmp_path)
    ten = table[table["estimator"] == "with_friction"]
    near, far = (
        ten[np.isnan(ten["cutoff_Hz"]) & (ten["rate_Hz"] == RATE_HZ) & (ten["push_deg"] == d)]
        for d in (1, 3)
    )
    assert near["time_ms"][0] == pytest.approx(100.5, rel=0.01) and far["time_ms"][
        0
    ] == pytest.approx(300.5, rel=0.01)
    assert (
        abs(far["error_mean_percent"][0]) < 4.0
    )  # the tolerance of test_10_with_the_right_friction_angle
    assert (
        abs(far["error_mean_percent"] - far["expected_mean_percent"])[0]
        < 3 * far["expected_rms_percent"][0]
    )
    filtered = ten[(ten["cutoff_Hz"] == 20.0) & (ten["push_deg"] == 3)]
    delay_ms = 1e3 * Converter(cutoff_Hz=20.0).delay_s
    assert filtered["time_ms"][0] - far["time_ms"][0] == pytest.approx(delay_ms, rel=0.01)
    assert set(table["push_deg"].tolist()) == {1.0, 3.0}  # no stroke goes on to 30°
    assert not ten[ten["rate_Hz"] == RATE_HZ / 100]["whisks"].any()
    assert (tmp_path / "robot_trade.png").is_file()


def test_nothing_to_judge_is_one_line(steel_signals, exact_vision, tmp_path):
    with pytest.raises(BadInput, match="no whisk has both"):
        robot_trade.robot_trade(steel_signals, tmp_path, Settings(trials="gauge_roll0"), workers=0)


def test_no_trial_of_that_name_is_said_before_anything_is_seen(steel_signals, tmp_path):
    with pytest.raises(BadInput, match=r"--trials zz\*: no trial has such a name; there are "):
        robot_trade.robot_trade(steel_signals, tmp_path, Settings(trials="zz*"), workers=0)
    assert not any(tmp_path.iterdir())
