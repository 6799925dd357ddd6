"""The truth of each whisk, where its variance comes from, by a spline in place of a beam, and the frames' clocks."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from bench.gauges.felt import gauge_delay, lateness
from bench.records.trial_result import TrialResult, whisks
from bench.report.whisk_rows import BEAM_UNITS, beam_rows, budget_rows
from bench.trials.clocks import shared_touch
from vision import CAUSES, Value

_LEAST_SHOWN_PERCENT = 0.5  # rounds to 0 %


def truth_lines(results: Iterable[TrialResult]) -> Iterator[str]:
    """Yield a head and a line a whisk with truth."""
    known = [whisk for whisk in whisks(results) if whisk[1].has_truth]
    if known:
        yield (
            f"{'trial':<18}{'whisk':>5}  {'β':>16}  {'d_x':>17}  {'slip at θ':>17}  {'touch seen':>17}  "
            f"{'felt − seen':>17}"
        )
    for result, seen, felt in known:
        late = lateness(seen, felt).in_degrees()
        late_deg = "- "
        if late.is_known:
            late_deg = f"{late.value:+.3f} ± {late.sigma:.3f}°"
        yield (
            f"{result.trial.name:<18}{seen.whisk:>5}  {_with_sigma(seen.beta_rad.in_degrees(), 2):>15}°  "
            f"{_with_sigma(seen.d_x_mm, 3):>14} mm  {_with_sigma(seen.at.slip_mm, 3):>14} mm  "
            f"{_with_sigma(seen.touch_rad.in_degrees(), 3):>16}°  {late_deg:>17}"
        )


def clock_lines(results: Sequence[TrialResult]) -> Iterator[str]:
    """Yield a line for each way that ties frames to signals, and by how much the felt touch is late."""
    clocks = [result.seen.clock for result in results if result.seen.clock]
    for clock, number_of in Counter(clocks).items():
        count = f"{number_of} of {len(clocks)} trials"
        sigma_ms = 1e3 * clock.sigma_s
        known = f"taken as known to {sigma_ms:.3g} ms, which is in the sigma of touch seen"
        if clock.recorded:
            if not clock.sigma_s:
                known = "taken as that of the signals"
            yield f"frame times as recorded ({clock.source}), {count}; their clock is {known}"
        else:
            yield (
                f"frame times by {clock.source}, {count}: no recorded edge ties them to the signals, and forward "
                f"strokes do not separate a late clock from a shifted zero of the encoder; {known}"
            )
    yield from _delay_lines(results)
    shared = shared_touch(results) if clocks else None
    if shared:
        yield shared.line


def _delay_lines(results: Iterable[TrialResult]) -> Iterator[str]:
    """Yield a line for each delay by the gauges' filter that was taken out of the felt touches."""
    delays = {}
    for result in results:
        for felt in result.felt.whisks:
            delays[felt.delay_s.value, felt.delay_s.sigma] = None
    assumed = gauge_delay(None)
    for delay_s, sigma_s in delays:
        if not np.isfinite(delay_s):
            continue
        known = f"± {1e3 * sigma_s:.2f} ms, by gauge_filter_Hz"
        if (delay_s, sigma_s) == (assumed.value, assumed.sigma):
            known = f"± {1e3 * sigma_s:.2f} ms, as in the paper: the trial has no gauge_filter_Hz"
        yield f"touch felt: {1e3 * delay_s:.2f} ms of delay by the gauges' filter are taken out ({known})"


def budget_lines(results: Iterable[TrialResult]) -> Iterator[str]:
    """Yield where the variance of d_x comes from, in the mean over the whisks."""
    rows = list(budget_rows(results))
    if not rows:
        return
    columns = []
    for cause in CAUSES:
        columns.append([row[f"{cause}_percent"] for row in rows])
    table = np.array(columns).T  # (rows, causes)
    means = np.nan_to_num(table).mean(axis=0)
    parts = []
    for k in np.argsort(-means, kind="stable"):
        if means[k] >= _LEAST_SHOWN_PERCENT:
            parts.append(f"{CAUSES[k]} {means[k]:.0f} %")
    yield f"variance of d_x by cause, mean over the whisks: {', '.join(parts)} (docs/truth.md, budget.csv)"
    if np.isnan(table).any():
        yield "  cameras.npz does not separate the rig board's part from the lenses': `cameras` is both"


def beam_lines(results: Iterable[TrialResult]) -> Iterator[str]:
    """Yield by how much the truth would differ if the wire's curve were a spline, at most."""
    rows = list(beam_rows(results))
    if not rows:
        return
    parts = []
    for name, unit in BEAM_UNITS.items():
        changes = []
        for row in rows:
            changes.append(row[f"{name}_spline_{unit}"] - row[f"{name}_beam_{unit}"])
        largest = int(np.argmax(np.abs(changes)))
        row = rows[largest]
        sigma = row[f"{name}_difference_sigma_{unit}"]
        parts.append(f"{name} {changes[largest]:+.4f} ± {sigma:.4f} {unit} ({row['trial']})")
    yield f"a spline for the wire, in place of a beam with a point load, changes at most: {', '.join(parts)} (beam.csv)"


def _with_sigma(value: Value, digits: int) -> str:
    """Return a value with its standard deviation; a dash where it is not known."""
    if not value.is_known:
        return "-"
    return f"{value.value:.{digits}f} ± {value.sigma:.{digits}f}"
