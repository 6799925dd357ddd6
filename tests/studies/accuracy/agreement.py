"""Felt against seen on a recorded session, its channels spoilt in known ways: what is said of each whisk.

    python tests/studies/accuracy/agreement.py SESSION OUT

SESSION: of a rendered one a copy that says so (fixtures/say_exact.py).
OUT is where `evaluate` left what is seen of it. The gauges are fitted to the gauge trials as they are; then the
channels of each measured whisk are exchanged, reversed, weakened or turned, and the cause is asked for.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.results import read_result
from bench.base.settings import Settings
from bench.gauges.drift import drift_rate, free_slope
from bench.gauges.felt import strokes_of
from bench.gauges.fit import fit_gauges
from bench.gauges.gauge_readings import Pairs, pairs_of
from bench.gauges.matrix import to_follicle
from bench.records.plain import from_plain
from bench.records.trial_result import TrialResult
from bench.session.session import load_session
from bench.session.signals import read_signals
from bench.trials.agreement import agreement


def pairs_in(session_path: Path, out: Path) -> Iterator[tuple[str, Pairs]]:
    """(purpose, pairs) of every whisk of which both sides are known."""
    session, settings = load_session(session_path), Settings()
    strokes = {t.name: strokes_of(read_signals(t), t, settings) for t in session.trials}
    rate = drift_rate(
        [s for many in strokes.values() for one in many if (s := free_slope(one)) is not None]
    )
    for trial in session.trials:
        result = from_plain(TrialResult, read_result(out / "trials" / f"{trial.name}.json"))
        for whisk, stroke in zip(result.seen.whisks, strokes[trial.name]):
            pairs = pairs_of(trial, whisk, stroke, rate, session.whisker, settings.theta_rad)
            if pairs is not None:
                yield trial.purpose, pairs


def spoilt(matrix: np.ndarray) -> dict[str, np.ndarray]:
    """What becomes of the channels, (2, 2), by name."""
    turn = np.linalg.inv(matrix) @ to_follicle(np.radians(5.0)) @ matrix
    return {
        "sound": np.eye(2),
        "exchanged": np.eye(2)[::-1],
        "y reversed": np.diag([-1, 1]),
        "z reversed": np.diag([1, -1]),
        "y at 80 %": np.diag([0.8, 1]),
        "z at 90 %": np.diag([1, 0.9]),
        "both at 90 %": 0.9 * np.eye(2),
        "turned by +5°": turn,
    }


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("session", type=Path)
    parser.add_argument("out", type=Path)
    options = parser.parse_args()
    known = list(pairs_in(options.session, options.out))
    gauges = fit_gauges([pairs for purpose, pairs in known if purpose == "gauge"]).all
    for pairs in (pairs for purpose, pairs in known if purpose == "measure"):
        for name, change in spoilt(gauges.matrix).items():
            whole = np.kron(np.eye(len(pairs)), change)
            covariance = whole @ pairs.volts_covariance @ whole.T
            found = agreement(
                replace(pairs, volts=pairs.volts @ change.T, volts_covariance=covariance), gauges
            )
            print(f"{pairs.trial:<12}{name:<15}χ² {found.chi2:10.1f}  {found.cause}")


if __name__ == "__main__":
    main()
