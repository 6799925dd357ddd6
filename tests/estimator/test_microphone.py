"""First touch by sound: its sigma over draws, false alarms, gaps, and silence."""

import numpy as np
import pytest

from estimator.microphone import NOTHING_HEARD, heard_touch

TIMES_S = np.arange(1000) / 2000.0


def sound(rng, touch_s, louder):
    """White noise that is so much louder from a touch on."""
    pressure = rng.standard_normal(len(TIMES_S))
    pressure[touch_s <= TIMES_S] *= louder
    return pressure


@pytest.mark.parametrize("louder", [3.0, 10.0])
def test_intervals_hold_the_touch(louder):
    """Of 800 in 95 %, to two binomial sigmas."""
    rng = np.random.default_rng(1)
    held = 0
    for touch_s in rng.uniform(0.15, 0.4, 800):
        heard = heard_touch(TIMES_S, sound(rng, touch_s, louder))
        held += abs(heard.time_s - touch_s) < 1.96 * heard.sigma_s
    assert 748 <= held <= 772


def test_noise_alone_is_no_touch():
    """One of a thousand strokes is expected to; of 2000 more than 7 are, by Poisson's law, one case in a thousand."""
    rng = np.random.default_rng(2)
    heard = [heard_touch(TIMES_S, rng.standard_normal(1000)) for _ in range(2000)]
    assert sum(not one.status for one in heard) <= 7


def test_a_louder_touch_is_known_better_and_gaps_do_no_harm():
    rng = np.random.default_rng(3)
    touch_s = TIMES_S[500] - 1e-4
    soft = heard_touch(TIMES_S, sound(rng, touch_s, 4.0))
    pressure = sound(rng, touch_s, 100.0)
    pressure[[10, 300, 700]] = np.nan
    loud = heard_touch(TIMES_S, pressure)
    assert loud.sigma_s < soft.sigma_s and loud.signal_to_noise > soft.signal_to_noise
    assert loud.time_s == pytest.approx(touch_s, abs=4 * loud.sigma_s)


@pytest.mark.parametrize("pressure", [np.zeros(1000), np.full(1000, np.nan), np.ones(20)])
def test_what_is_no_sound_has_no_touch(pressure):
    heard = heard_touch(TIMES_S[: len(pressure)], pressure)
    assert heard.status is NOTHING_HEARD and np.isnan([heard.time_s, heard.sigma_s]).all()
