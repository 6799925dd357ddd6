"""Pictures that stand in another trial's folder are named with both trials."""

from types import SimpleNamespace

import numpy as np
import pytest

from bench.session.session import load_session
from bench.trials.consistency import check_slope
from bench.trials.exchanged_signals import exchanged_pictures
from tests.scenes.results import seen_whisk, trial_result
from vision.truth.value import Value


@pytest.mark.parametrize(
    ("seen_deg", "said"),
    [
        ({"b30_3": 60.3, "b60_4": 30.1}, ["b30_3 and b60_4"]),
        ({"b30_3": 30.1, "b60_4": 60.3}, []),
        ({"b30_3": 60.3, "b60_4": 10.0}, []),
        ({"b30_3": 60.3, "b60_4": 60.0}, []),
    ],
)
def test_pictures_of_two_trials_exchanged_are_named(small_session, seen_deg, said):
    session = load_session(small_session)
    units, results = [], []
    for name, beta_deg in seen_deg.items():
        trial = session.trial(name)
        beta = Value(np.radians(beta_deg), np.radians(0.2))
        whisk = seen_whisk(0, check_slope(beta, trial), d_x_mm=Value(60.0, 0.01), beta_rad=beta)
        units.append(SimpleNamespace(trial=trial))
        results.append(trial_result([whisk], name=name))
    found = list(exchanged_pictures(units, results))
    assert [line.split("trials ")[1].split(" look")[0] for line in found] == said
