"""How good each estimator is, and how sure the truth: the numbers that verdict, methods.md and comparison share."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from bench.base.drawing import label_of
from bench.records.trial_result import TrialResult, whisks
from bench.trials.estimate_errors import Judged, judge


@dataclass(frozen=True)
class Standing:
    """One estimator over the measured whisks. asked: whisks with a truth; n: those with an error that nothing speaks
    against, of which all else is; bias, RMS and worst error, per cent of d_x; where the worst is; held: of `stated`
    95 % intervals, how many hold the truth; doubtful: whisks with an error that are left out, for what was seen or felt
    of them is in doubt."""

    estimator: str
    asked: int
    n: int
    bias_percent: float
    rms_percent: float
    worst_percent: float
    worst_at: tuple[str, int]
    held: int
    stated: int
    doubtful: int

    @property
    def label(self) -> str:
        """As the legend has it."""
        return label_of(self.estimator)


def standings(results: Iterable[TrialResult]) -> list[Standing]:
    """A Standing of each estimator, in the order in which they come."""
    results = list(results)
    asked = [
        j
        for j in judge(results)
        if j.purpose == "measure" and not j.one_factor and math.isfinite(j.d_x_mm)
    ]
    intervals = dict(_intervals(results))
    names = dict.fromkeys(j.estimator for j in asked)
    return [_standing(name, [j for j in asked if j.estimator == name], intervals) for name in names]


def _intervals(
    results: Iterable[TrialResult],
) -> Iterator[tuple[tuple[str, int, str], tuple[float, float]]]:
    """The 95 % interval of each whisk and estimator, mm, ends of no number left out."""
    for result, seen, felt in whisks(results):
        for answer in felt.estimates:
            low, high = answer.d_x_est_low_mm, answer.d_x_est_high_mm
            if math.isfinite(low) and math.isfinite(high):
                yield (result.trial.name, seen.whisk, answer.estimator), (low, high)


def _standing(name: str, asked: list[Judged], intervals: dict) -> Standing:
    known = [j for j in asked if math.isfinite(j.error_percent) and not j.doubtful]
    doubtful = sum(j.doubtful and math.isfinite(j.error_percent) for j in asked)
    stated = [
        (j, intervals[key])
        for j in asked
        if (key := (j.trial, j.whisk, name)) in intervals and not j.doubtful
    ]
    held = sum(low <= j.d_x_mm <= high for j, (low, high) in stated)
    if not known:
        return Standing(
            name, len(asked), 0, math.nan, math.nan, math.nan, ("", 0), held, len(stated), doubtful
        )
    errors = np.array([j.error_percent for j in known])
    worst = known[int(np.argmax(np.abs(errors)))]
    numbers = float(errors.mean()), float(np.sqrt(np.mean(errors**2))), worst.error_percent
    return Standing(
        name,
        len(asked),
        len(known),
        *numbers,
        (worst.trial, worst.whisk),
        held,
        len(stated),
        doubtful,
    )


@dataclass(frozen=True)
class Sureness:
    """Median sigma of the truth over the measured whisks that have one: known of measured, and each quantity."""

    known: int
    measured: int
    d_x_mm: float
    touch_deg: float
    beta_deg: float
    slip_mm: float


def sureness(results: Iterable[TrialResult]) -> Sureness:
    """How sure the truth is; NaN where no whisk has one."""
    seen = [s for result, s, _ in whisks(results) if result.trial.purpose == "measure"]
    known = [s for s in seen if s.has_truth]
    angles = (
        np.degrees(_median([getattr(s, name).sigma for s in known]))
        for name in ("touch_rad", "beta_rad")
    )
    slip = _median([s.at.slip_mm.sigma for s in known if s.at is not None])
    return Sureness(
        len(known), len(seen), _median([s.d_x_mm.sigma for s in known]), *map(float, angles), slip
    )


def _median(values: list[float]) -> float:
    known = [v for v in values if math.isfinite(v)]
    return float(np.median(known)) if known else math.nan
