"""Signals that stand in another trial's folder: each trial's felt moments against the shape seen in the other.

Made over the session, of those whisks whose moments are not those of their own shape (`bench.trials.agreement`). With
one motor program for all trials nothing else tells: encoder and pictures agree whichever file is beside them.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from bench.base.statuses import reason
from bench.gauges.felt import strokes_of
from bench.gauges.gauge_readings import pairs_of
from bench.records.trial_result import TrialResult
from bench.session.signals import read_signals
from bench.trials.agreement import LEAST_CHANCE
from bench.trials.unit import Unit, against_shape, readout_of

# Trials. Where more stand out, the session's gauges are wrong and no two of its files; each pair is looked at.
_MOST_APART = 12


def exchanged_signals(units: Sequence[Unit], results: Sequence[TrialResult]) -> Iterator[str]:
    """A line for each two trials whose signals fit each other's pictures, and neither its own. In one order."""
    apart = [(unit, result) for unit, result in zip(units, results) if _is_apart(result)]
    if len(apart) > _MOST_APART:
        return
    for one, other in combinations(apart, 2):
        if _fits(*one, other[0]) and _fits(*other, one[0]):
            names = f"{one[0].trial.name} and {other[0].trial.name}"
            yield reason("signals_exchanged", names=names)


def _is_apart(result: TrialResult) -> bool:
    """Whether all whisks whose moments could be held to their shape are not of it."""
    pairs = zip(result.seen.whisks, result.felt.whisks)
    held = [
        felt.apart
        for seen, felt in pairs
        if not seen.contradicted and np.isfinite(felt.agreement_chi2)
    ]
    return bool(held) and all(held)


def _fits(unit: Unit, result: TrialResult, other: Unit) -> bool:
    """Whether all whisks of a trial that can be held to another's signals agree with them."""
    signals = read_signals(other.trial)
    readout, _ = readout_of(unit, signals.kind)
    if readout is None:
        return False
    strokes, settings = strokes_of(signals, unit.trial, unit.settings), unit.settings
    held = [
        pairs_of(
            unit.trial, seen, stroke, unit.drift_rate, unit.session.whisker, settings.theta_rad
        )
        for seen, stroke in zip(result.seen.whisks, strokes)
        if seen.deflection is not None and not seen.contradicted
    ]
    found = [against_shape(unit, readout, pairs).chance for pairs in held if pairs is not None]
    return bool(found) and min(found) >= LEAST_CHANCE
