"""Felt less seen touch over a session's whisks: a clock and a zero told apart, chance, and what stays as it is."""

from dataclasses import replace

import numpy as np
import pytest

from bench.base.statuses import reason
from bench.gauges.felt import gauge_delay
from bench.records.trial_result import BackStroke, FeltTrial, FeltWhisk, SeenTrial
from bench.trials.clocks import shared_touch, shared_touch_warning, with_shared_touch
from tests.scenes.results import seen_whisk, trial_result
from vision.truth.records import FrameTruth
from vision.truth.value import UNKNOWN, Value

SEEN_RAD, FELT_RAD = np.radians(0.006), np.radians(0.005)


def frames(speed_rad_s):
    time_s = np.arange(6) * 0.01
    nothing = Value(np.zeros(6), np.zeros(6))
    return FrameTruth(
        index=np.arange(6),
        time_s=time_s,
        motor_rad=speed_rad_s * time_s,
        theta_rad=nothing,
        touching=np.zeros(6, dtype=bool),
        point_mm=nothing,
        arc_mm=np.zeros(6),
        status=("",) * 6,
    )


def trial(seen, felt, **halves):
    """A result of one whisk, or of none that is known."""
    whisk = FeltWhisk(touch_felt_rad=felt, theta_sigma_rad=felt.sigma, delay_s=gauge_delay(None))
    felt_half = FeltTrial((whisk,), halves.pop("felt_back", UNKNOWN))
    return trial_result(SeenTrial((seen,), **halves), felt_half)


def session(rng, speeds_deg_s, *, clock_s=0.0, zero_rad=0.0, back=False):
    """Results of a whisk each at these speeds; light moves the seen touch of all alike, and of each."""
    light, results = SEEN_RAD * rng.standard_normal(), []
    for number, speed in enumerate(np.radians(speeds_deg_s)):
        whisk, pair = 0.05 + 0.01 * number, []
        for way in (speed, -speed) if back else (speed,):
            sees = Value(whisk + light - clock_s * way - zero_rad, SEEN_RAD)
            pair.append((sees, Value(whisk + FELT_RAD * rng.standard_normal(), FELT_RAD), way))
        (sees, feels, way), *rest = pair
        halves = (
            {"back": BackStroke(rest[0][0], rest[0][2]), "felt_back": rest[0][1]} if back else {}
        )
        results.append(trial(seen_whisk(touch_rad=sees, frames=frames(way)), feels, **halves))
    return results


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def test_a_clock_at_one_speed_is_a_warning_and_in_the_sigma_of_touch(rng):
    """12 whisks at 10 deg/s, the clock 4 ms off: nine sigma each, and nothing was said."""
    results = session(rng, [10.0] * 12, clock_s=0.004)
    shared = shared_touch(results)
    assert shared.chance < 1e-6
    assert shared_touch_warning(shared).codes == ("touch_apart",)
    for before, after in zip(results, with_shared_touch(results, shared)):
        one, other = (result.seen.whisks[0].touch_rad for result in (before, after))
        assert other.value == one.value  # what is felt moves no truth
        assert other.sigma == pytest.approx(np.radians(0.04), rel=0.3)
    again = shared_touch(with_shared_touch(results, shared))
    np.testing.assert_allclose(
        again.values, shared.values, rtol=1e-9
    )  # the summary reads the widened records


@pytest.mark.parametrize(
    "how", [{"speeds_deg_s": [10.0] * 12, "back": True}, {"speeds_deg_s": [10.0, 40.0] * 6}]
)
@pytest.mark.parametrize(
    "clock_s, zero_deg, words",
    [
        (0.008, 0.0, "ms behind the signals'"),
        (-0.008, 0.0, "ms ahead of the signals'"),
        (0.0, 0.1, "no clock explains it"),
    ],
)
def test_back_strokes_and_speeds_tell_a_clock_from_a_zero(rng, how, clock_s, zero_deg, words):
    results = session(rng, **how, clock_s=clock_s, zero_rad=np.radians(zero_deg))
    shared = shared_touch(results)
    off = shared.values - [np.radians(zero_deg), clock_s]
    assert np.all(np.abs(off) < 4 * np.sqrt(np.diag(shared.covariance)))
    assert shared.covariance[1, 1] ** 0.5 < 1.5 * gauge_delay(None).value
    assert words in shared_touch_warning(shared)


def test_sound_sessions_raise_no_warning(rng):
    """One in a thousand may, by its own word; sigmas of what all whisks share are taken as shared."""
    found = [shared_touch(session(rng, [10.0] * 8, back=k % 2 == 0)) for k in range(300)]
    assert sum(one.is_error for one in found) <= 2
    results = session(rng, [10.0] * 8)
    assert list(with_shared_touch(results, shared_touch(results))) == results
    assert not shared_touch_warning(shared_touch(results))


def test_what_many_whisks_show_and_matters_to_none_is_no_error(rng):
    """4 ms at 10°/s are five sigma of one whisk; a fifth of a sigma is none's concern, however sure."""
    large = shared_touch(session(rng, [10.0] * 12, clock_s=0.004))
    assert large.share_of_sigma == pytest.approx(
        0.04 / np.degrees(np.hypot(SEEN_RAD, FELT_RAD)), rel=0.3
    )
    assert large.is_error
    small = replace(large, share_of_sigma=0.2)
    assert not small.is_error
    assert not shared_touch_warning(small)
    results = session(rng, [10.0] * 8)
    assert list(with_shared_touch(results, small)) == results


def test_no_touch_no_word():
    nothing = trial(seen_whisk(0, reason("no_pictures")), UNKNOWN)
    assert shared_touch([nothing]) is None and not shared_touch_warning(None)
    assert with_shared_touch([nothing], None) == (nothing,)


def test_one_speed_is_told_as_a_sum(rng):
    """Apart, zero and clock are known to half a degree and 45 ms there, which says nothing."""
    line = shared_touch(session(rng, [10.0] * 8)).line
    assert "by 8 whisks together" in line and line.endswith(
        "do not separate a late clock from a shifted zero"
    )
    assert "8 whisks and 8 back strokes" in shared_touch(session(rng, [10.0] * 8, back=True)).line
