"""The truth of each whisk, where its variance comes from, what a spline would make of it, and the frames' clocks."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from bench.gauges.felt import lateness
from bench.records.trial_result import TrialResult, whisks
from bench.report.assembly import beam_rows, budget_rows
from bench.trials.clocks import shared_touch
from vision.fit.covariance import CAUSES
from vision.truth.value import Value

_LEAST_SHOWN_PERCENT = 0.5  # rounds to 0 %


def truth_lines(results: Iterable[TrialResult]) -> Iterator[str]:
    """A line a whisk with truth."""
    rows = [(r, s, f) for r, s, f in whisks(results) if s.has_truth]
    if rows:
        yield (
            f"{'trial':<18}{'whisk':>5}  {'β seen':>16}  {'d_x':>17}  {'slip at θ':>17}  {'touch seen':>17}  "
            f"{'felt − seen':>17}"
        )
    for result, s, felt in rows:
        late = lateness(s, felt)
        yield (
            f"{result.trial.name:<18}{s.whisk:>5}  {_degrees(s.beta_rad, 2):>15}°  "
            f"{_shown(s.d_x_mm, 3):>14} mm  {_shown(s.at.slip_mm, 3):>14} mm  {_degrees(s.touch_rad, 3):>16}°  "
            f"{f'{np.degrees(late.value):+.3f} ± {np.degrees(late.sigma):.3f}':>16}°"
        )


def clock_lines(results: Sequence[TrialResult]) -> Iterator[str]:
    """What ties the frames to the signals, a line for each way, and what the felt touch is late by."""
    clocks = [result.seen.clock for result in results if result.seen.clock]
    ways = Counter(clocks)
    for clock, number_of in ways.items():
        count = f"{number_of} of {len(clocks)} trials"
        known = (
            f"taken as known to {1e3 * clock.sigma_s:.3g} ms, which is in the sigma of touch seen"
        )
        if clock.recorded:
            yield f"frame times as recorded ({clock.source}), {count}; their clock is " + (
                known if clock.sigma_s else "taken as that of the signals"
            )
        else:
            yield (
                f"frame times by {clock.source}, {count}: no recorded edge ties them to the signals, and forward "
                f"strokes do not tell the clock from the encoder's zero; {known}"
            )
    yield from _delay_lines(results)
    if ways:
        shared = shared_touch(results)
        yield from [shared.line] if shared else []


def _delay_lines(results: Iterable[TrialResult]) -> Iterator[str]:
    """A line for each delay by the gauges' filter that was taken out of the felt touches."""
    delays = dict.fromkeys(
        (f.delay_s.value, f.delay_s.sigma) for r in results for f in r.felt.whisks
    )
    for delay_s, sigma_s in delays:
        if np.isfinite(delay_s):
            unnamed = f"± {1e3 * sigma_s:.2f} ms, as in the paper: the trial has no gauge_filter_Hz"
            known = unnamed if sigma_s else "by gauge_filter_Hz, taken as exact"
            yield f"touch felt: {1e3 * delay_s:.2f} ms of delay by the gauges' filter are taken out ({known})"


def budget_lines(results: Iterable[TrialResult]) -> Iterator[str]:
    """Where the variance of d_x comes from, in the mean over the whisks."""
    rows = list(budget_rows(results))
    if rows:
        table = np.array([[row[f"{cause}_percent"] for cause in CAUSES] for row in rows])
        shares = dict(zip(CAUSES, np.nan_to_num(table).mean(axis=0)))
        largest = sorted(shares.items(), key=lambda item: -item[1])
        parts = (
            f"{cause} {share:.0f} %" for cause, share in largest if share >= _LEAST_SHOWN_PERCENT
        )
        yield f"variance of d_x by cause, mean over the whisks: {', '.join(parts)} (docs/truth.md, budget.csv)"
        if np.isnan(table).any():
            yield "  cameras.npz does not tell the rig board's part from the lenses': `cameras` is both"


def beam_lines(results: Iterable[TrialResult]) -> Iterator[str]:
    """How far the truth would move if the wire's curve were a spline: the largest of each quantity."""
    rows = list(beam_rows(results))
    parts = []
    for name, unit in (("d_x", "mm"), ("touch", "deg"), ("slip", "mm")) if rows else ():
        moved = [(row[f"{name}_spline_{unit}"] - row[f"{name}_beam_{unit}"]) for row in rows]
        k = int(np.argmax(np.abs(moved)))
        sigma = rows[k][f"{name}_difference_sigma_{unit}"]
        parts.append(f"{name} {moved[k]:+.4f} ± {sigma:.4f} {unit} ({rows[k]['trial']})")
    if parts:
        yield f"by a spline instead of a beam with a point load, at most: {', '.join(parts)} (beam.csv)"


def _shown(value: Value, digits: int) -> str:
    return (
        f"{value.value:.{digits}f} ± {value.sigma:.{digits}f}" if np.isfinite(value.value) else "-"
    )


def _degrees(angle: Value, digits: int) -> str:
    return _shown(Value(np.degrees(angle.value), np.degrees(angle.sigma)), digits)
