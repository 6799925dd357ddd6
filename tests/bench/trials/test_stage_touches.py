"""Touch felt against touch by a stage's place: a whisk that the others contradict is named, and no other."""

from dataclasses import replace

import numpy as np
import pytest

from bench.records.trial_result import FeltWhisk, StageTouch
from bench.trials.stage_touches import with_stage_touches
from tests.scenes.results import seen_whisk, trial_result
from vision import Value

OWN_DEG = 0.03
# By the whisker's set, which all share, of whisks at several distances.
SHARED_DEG = np.array([0.2, 0.3, 0.4, 0.35])
FELT_DEG = 0.01


def results(apart_deg):
    """A trial a whisk, felt − stage as given."""
    found = []
    for k, (apart, shared) in enumerate(zip(np.radians(apart_deg), np.radians(SHARED_DEG))):
        touch = StageTouch(0.05, np.radians(OWN_DEG), np.array([shared]))
        seen = replace(seen_whisk(), stage_touch=touch)
        felt_sigma = np.radians(FELT_DEG)
        felt = FeltWhisk(
            0,
            touch_felt_rad=Value(0.05 + apart, felt_sigma),
            theta_sigma_rad=felt_sigma,
            delay_s=Value(0.0, 1e-5),
        )
        found.append(trial_result([seen], [felt], name=f"t{k}"))
    return found


@pytest.mark.parametrize(
    ("apart_deg", "named"),
    [
        ([0.0, 0.0, 0.0, 0.0], []),
        ([1.5, 1.5, 1.5, 1.5], []),  # the motor's zero
        (list(-2.0 * SHARED_DEG), []),  # a whisker that is set
        ([0.0, 0.3, 0.0, 0.0], ["t1"]),
        ([0.02, 0.0, -0.02, 0.6], ["t3"]),
        ([0.0, 1.0], ["t0", "t1"]),  # of two none is the better one
        ([0.7], []),
    ],
)
def test_the_whisk_that_the_others_contradict_is_named(apart_deg, named):
    found = with_stage_touches(results(apart_deg))
    assert [one.trial.name for one in found if one.seen.whisks[0].contradicted] == named
    for one in found:
        is_named = one.trial.name in named
        assert ("stage_unlike_felt" in one.seen.whisks[0].status.codes) == is_named
