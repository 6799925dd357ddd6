"""Signals, or pictures, that stand in another trial's folder: each trial's felt moments against the
shape seen in the other, and the slope that it shows against the one that the other states.

Compared over the session, of those whisks whose moments are not those of their own shape
(`bench.trials.agreement`). With one motor program for all trials nothing else shows it: encoder and
pictures agree whichever file they are with.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import combinations

import numpy as np

from bench.base.statuses import reason
from bench.gauges.felt import strokes_of
from bench.gauges.gauge_readings import Pairs, pairs_of
from bench.records.trial_result import TrialResult
from bench.session.signals import read_signals
from bench.trials.consistency import check_slope
from bench.trials.differences import LEAST_CHANCE
from bench.trials.felt_trial import against_shape, readout_of
from bench.trials.unit import Unit

# Trials. Where more disagree, the session's gauges are wrong and no two of its files; each pair is looked at.
_MOST_APART = 12


def exchanged_signals(units: Sequence[Unit], results: Sequence[TrialResult]) -> Iterator[str]:
    """Yield a line for each two trials whose signals fit each other's pictures, and neither its
    own.
    """
    for names in _exchanged(units, results, _is_apart, _fits):
        yield reason("signals_exchanged", names=names)


def exchanged_pictures(units: Sequence[Unit], results: Sequence[TrialResult]) -> Iterator[str]:
    """Yield a line for each two trials whose pictures show the slope that the other states, and
    neither its own.
    """
    for names in _exchanged(units, results, _has_another_slope, _shows_slope_of):
        yield reason("pictures_exchanged", names=names)


def _exchanged(
    units: Sequence[Unit],
    results: Sequence[TrialResult],
    is_apart: Callable[[TrialResult], bool],
    fits: Callable[[Unit, TrialResult, Unit], bool],
) -> Iterator[str]:
    """Yield the names of each two trials that are not of a piece, each of which fits the other.

    is_apart: whether a trial is not of a piece. fits: whether a trial, with its result, fits another one.
    """
    apart = [(unit, result) for unit, result in zip(units, results) if is_apart(result)]
    if len(apart) > _MOST_APART:
        return
    for (unit, result), (other, other_result) in combinations(apart, 2):
        if fits(unit, result, other) and fits(other, other_result, unit):
            yield f"{unit.trial.name} and {other.trial.name}"


def _has_another_slope(result: TrialResult) -> bool:
    """Return whether all whisks with a truth show another slope than trial.toml states."""
    known = [seen for seen in result.seen.whisks if seen.has_truth]
    return bool(known) and all("slope_unlike_stated" in seen.status.codes for seen in known)


def _shows_slope_of(_: Unit, result: TrialResult, other: Unit) -> bool:
    """Return whether all whisks with a truth show the slope that another trial states."""
    known = [seen for seen in result.seen.whisks if seen.has_truth]
    return not any(check_slope(seen.beta_rad, other.trial) for seen in known)


def _is_apart(result: TrialResult) -> bool:
    """Return whether all whisks disagree with their shape that could be compared with it."""
    compared = []
    for seen, felt in zip(result.seen.whisks, result.felt.whisks):
        if not seen.contradicted and np.isfinite(felt.agreement_chi2):
            compared.append(felt.apart)
    return bool(compared) and all(compared)


def _fits(unit: Unit, result: TrialResult, other: Unit) -> bool:
    """Return whether all whisks of a trial that can be compared with another's signals agree."""
    signals = read_signals(other.trial)
    readout, _ = readout_of(unit, signals.kind)
    if readout is None:
        return False
    whisker = unit.session.whisker
    theta_rad = unit.settings.theta_rad
    chances = []
    strokes = strokes_of(signals, unit.trial, unit.settings)
    for seen, stroke in zip(result.seen.whisks, strokes):
        if seen.deflection is None or seen.contradicted:
            continue
        pairs = pairs_of(unit.trial, seen, stroke, unit.drift_rate, whisker, theta_rad)
        if isinstance(pairs, Pairs):
            chances.append(against_shape(unit, readout, pairs).chance)
    return bool(chances) and min(chances) >= LEAST_CHANCE
