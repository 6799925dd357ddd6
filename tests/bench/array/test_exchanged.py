"""Whiskers that are exchanged feel their touches when each other's are seen."""

from dataclasses import replace

import numpy as np

from bench.array.exchanged_whiskers import exchanged
from bench.records.trial_result import (
    FeltWhisk,
    TrialResult,
)
from tests.scenes.results import seen_whisk, trial_result
from vision.truth.value import NAN, Value

SIGMA = 1e-4


def result(seen_rad: float, felt_rad: float, shared_rad: float = 0.0) -> TrialResult:
    touch = Value(seen_rad, float(np.hypot(SIGMA, shared_rad)))
    seen = replace(seen_whisk(touch_rad=touch), touch_shared_rad=shared_rad)
    felt = FeltWhisk(touch_felt_rad=Value(felt_rad, SIGMA))
    return trial_result((seen,), (felt,))


def lines(a: TrialResult, b: TrialResult) -> list[str]:
    return list(exchanged({"a": [a], "b": [b]}))


def test_touches_that_are_each_others_are_told():
    """Also where what felt touches are off by together was added to the sigma of those seen, as `finished` does."""
    for shared in (0.0, 0.05):
        (line,) = lines(result(0.02, 0.07, shared), result(0.07, 0.02, shared))
        assert line.startswith(
            "a and b look exchanged: each touches, as felt, when the other does, as seen"
        )


def test_touches_of_their_own_are_not():
    assert not lines(result(0.02, 0.0201), result(0.07, 0.0699))
    assert not lines(result(0.02, 0.0201), result(0.02, 0.0199))


def test_two_wrong_touches_are_no_exchange():
    assert not lines(result(0.02, 0.07), result(0.07, 0.05))


def test_whisks_without_a_touch_tell_nothing():
    assert not lines(result(NAN, 0.07), result(0.07, 0.02))
