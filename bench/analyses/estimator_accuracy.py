"""How far off each estimator is over the whisks of a run, and how well their truth is known.

The verdict, the page, methods.md and the comparison of runs all take their numbers from here.
"""

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import betainc, betaincinv, chdtri

from bench.analyses.pooling import by_slope, grouped, rms, rms_of_known
from bench.base.drawing import label_of
from bench.base.statuses import TRUTH, reaching
from bench.records.trial_result import TrialResult, whisks
from bench.trials.estimate_errors import Judged, judge
from vision.geometry import NO_REASON, Reason

# [1] Intervals are stated for this share of all whisks.
INTERVAL_SHARE = 0.95
# [1] A stated uncertainty is called too small where so few intervals would hold by chance in less
# than this share of all runs. Stated.
LEAST_CHANCE = 0.05
# [sigmas] By how much the sums of squared errors of two estimators must differ to rank them. Stated.
RANKING_SIGMAS = 2.0


@dataclass(frozen=True)
class Accuracy:
    """Errors of one estimator over the measured whisks of a run.

    with_truth: number of whisks whose true distance is known.
    judged: whisks with a truth and a distance that no warning about the recording speaks against.
    left_out: whisks with a truth and a distance that such a warning speaks against.
    without_distance: whisks for which the estimator gives none.
    warned: whisks with a distance that the estimator itself warns about.
    intervals: number of judged whisks with a finite 95 % interval.
    intervals_holding: how many of these hold the true distance.
    settings: how many slopes of a surface and speed the judged whisks are at. What an estimator assumes
    is wrong alike in all whisks of a setting, so that ten of them count as one.
    """

    estimator: str
    with_truth: int
    judged: tuple[Judged, ...]
    left_out: tuple[Judged, ...]
    without_distance: tuple[Judged, ...]
    warned: tuple[Judged, ...]
    intervals: int
    intervals_holding: int
    settings: int

    @property
    def label(self) -> str:
        """Return the estimator's name as the legends have it."""
        return label_of(self.estimator)

    @property
    def errors_mm(self) -> np.ndarray:
        """Return the errors (whisks,): estimate less truth, mm."""
        return np.array([one.error_mm for one in self.judged])

    @property
    def errors_percent(self) -> np.ndarray:
        """Return the errors (whisks,): estimate less truth, per cent of the truth."""
        return np.array([one.error_percent for one in self.judged])

    @property
    def error_sigmas_mm(self) -> np.ndarray:
        """Return the standard deviations (whisks,) of the errors, of estimate and truth, mm."""
        return np.array([one.error_sigma_mm for one in self.judged])

    @property
    def bias_percent(self) -> float:
        """Return the mean error, per cent of the truth; NaN where nothing is judged."""
        return float(np.mean(self.errors_percent)) if self.judged else math.nan

    @property
    def rms_percent(self) -> float:
        """Return the RMS error, per cent of the truth; NaN where nothing is judged."""
        return rms(self.errors_percent)

    @property
    def rms_mm(self) -> float:
        """Return the RMS error, mm; NaN where nothing is judged."""
        return rms(self.errors_mm)

    @property
    def stated_percent(self) -> float:
        """Return the RMS of the stated sigmas of the estimates, per cent of the truth."""
        return _rms_share([(one.d_x_est_sigma_mm, one.d_x_mm) for one in self.judged])

    @property
    def stated_alpha_exact_percent(self) -> float:
        """Return the RMS of these sigmas as if the assumed friction angle were exact, per cent."""
        return _rms_share([(one.d_x_est_sigma_alpha_exact_mm, one.d_x_mm) for one in self.judged])

    @property
    def stated_for_friction_percent(self) -> float:
        """Return the part of `stated_percent` that is the assumed friction angle's; 0 where none is."""
        squared = self.stated_percent**2 - self.stated_alpha_exact_percent**2
        return math.sqrt(max(squared, 0.0))

    @property
    def rms_range_percent(self) -> tuple[float, float]:
        """Return the 95 % interval of the RMS error over further settings like these, per cent.

        The errors of settings are taken as normal: their sum of squares over the variance is χ² with as
        many degrees of freedom. NaN where nothing is judged.
        """
        if not self.judged:
            return math.nan, math.nan
        tail = 0.5 * (1.0 - INTERVAL_SHARE)
        low = math.sqrt(self.settings / chdtri(self.settings, tail))
        high = math.sqrt(self.settings / chdtri(self.settings, 1.0 - tail))
        return low * self.rms_percent, high * self.rms_percent

    @property
    def holding_range_percent(self) -> tuple[float, float]:
        """Return the 95 % interval of the share of intervals that hold over further settings, per cent.

        It is Clopper and Pearson's (Biometrika 26, 1934) of as many trials as there are settings. NaN
        where no interval is judged.
        """
        if not self.intervals:
            return math.nan, math.nan
        tail = 0.5 * (1.0 - INTERVAL_SHARE)
        holding, failing = self._settings_holding()
        low = betaincinv(holding, failing + 1.0, tail) if holding else 0.0
        high = betaincinv(holding + 1.0, failing, 1.0 - tail) if failing else 1.0
        return 100.0 * float(low), 100.0 * float(high)

    def _settings_holding(self) -> tuple[float, float]:
        """Return how many settings the intervals that hold amount to, and those that do not."""
        count = min(self.settings, self.intervals)
        holding = count * self.intervals_holding / self.intervals
        return holding, count - holding

    @property
    def worst(self) -> Judged | None:
        """Return the whisk with the largest error in per cent; None where nothing is judged."""
        if not self.judged:
            return None
        return self.judged[int(np.argmax(np.abs(self.errors_percent)))]

    @property
    def worst_percent(self) -> float:
        """Return the largest error with its sign, per cent of the truth; NaN where there is none."""
        return self.worst.error_percent if self.worst else math.nan

    @property
    def worst_at(self) -> tuple[str, int]:
        """Return trial and whisk of the largest error."""
        return (self.worst.trial, self.worst.whisk) if self.worst else ("", 0)

    @property
    def is_covered(self) -> bool:
        """Return whether as many 95 % intervals hold the truth as chance lets one expect.

        Where none holds they cover nothing, however few there are.
        """
        if not self.intervals_holding:
            return False
        holding, failing = self._settings_holding()
        if not failing:
            return True
        # The probability that no more than these hold: the binomial distribution's, for parts, too.
        chance = betainc(failing, holding + 1.0, 1.0 - INTERVAL_SHARE)
        return bool(chance >= LEAST_CHANCE)

    def is_worse_than(self, other: "Accuracy") -> bool:
        """Return whether the sum of squared errors is larger by more than the sigmas explain.

        The variance of a squared error e² of standard deviation s is 4 e² s² + 2 s⁴. Errors of two
        estimators on one whisk share their moments, so that the test errs towards no difference.
        """
        difference = 0.0
        variance = 0.0
        for one, sign in ((self, 1.0), (other, -1.0)):
            squared = one.errors_mm**2
            variances = one.error_sigmas_mm**2
            difference += sign * float(np.sum(squared))
            variance += float(np.sum(4.0 * squared * variances + 2.0 * variances**2))
        return difference > RANKING_SIGMAS * math.sqrt(variance)


def accuracies(results: Iterable[TrialResult]) -> list[Accuracy]:
    """Return the accuracy of each estimator, in the order in which the results name them."""
    judged = []
    for one in judge(results):
        if one.purpose == "measure" and not one.one_factor and math.isfinite(one.d_x_mm):
            judged.append(one)
    by_estimator = grouped(judged, lambda one: one.estimator)
    return [_accuracy(name, mine) for name, mine in by_estimator.items()]


def _accuracy(name: str, mine: Sequence[Judged]) -> Accuracy:
    """Return the accuracy of one estimator from its whisks with a truth."""
    judged: list[Judged] = []
    left_out: list[Judged] = []
    without_distance: list[Judged] = []
    warned: list[Judged] = []
    intervals: list[bool] = []  # whether each holds the truth
    for one in mine:
        has_distance = math.isfinite(one.error_percent)
        if not has_distance:
            without_distance.append(one)
        elif one.has_warning:
            left_out.append(one)
        else:
            judged.append(one)
        if has_distance and one.status:
            warned.append(one)
        if one.inside is not None and not one.has_warning:
            intervals.append(one.inside)
    return Accuracy(
        estimator=name,
        with_truth=len(mine),
        judged=tuple(judged),
        left_out=tuple(left_out),
        without_distance=tuple(without_distance),
        warned=tuple(warned),
        intervals=len(intervals),
        intervals_holding=sum(intervals),
        settings=_settings(judged),
    )


def _settings(judged: Iterable[Judged]) -> int:
    """Return at how many slopes of a surface and speed the whisks are."""
    panels = grouped(judged, lambda one: (one.surface, one.speed_deg_s))
    return sum(len(by_slope(of_panel, _steepness)) for of_panel in panels.values())


def _steepness(judged: Judged) -> float:
    """Return how steep the slope is, to either side."""
    return abs(judged.beta_deg)


@dataclass(frozen=True)
class TruthUncertainty:
    """Median standard deviations of the truth over the measured whisks that have one.

    known, measured: numbers of whisks with a truth and of all. d_x_own_mm, d_x_shared_mm: the parts
    of d_x's that are each whisk's own, and that all share; NaN where that is not known. questioned:
    of those with a truth, how many have a status that reaches it; contradiction: the commonest of
    what they say. source: of the truth, BY_PICTURES or BY_STAGE; "" where there is none.
    """

    known: int
    measured: int
    d_x_mm: float
    touch_deg: float
    beta_deg: float
    slip_mm: float
    d_x_own_mm: float = math.nan
    d_x_shared_mm: float = math.nan
    questioned: int = 0
    contradiction: Reason = NO_REASON
    source: str = ""

    @property
    def d_x_text(self) -> str:
        """Return how well d_x is known, in the parts that whisks have of their own and share."""
        if math.isfinite(self.d_x_own_mm) and self.known > 1:
            own = f"± {self.d_x_own_mm:.2g} mm (each whisk's own)"
            return f"{own} and ± {self.d_x_shared_mm:.2g} mm (shared by all)"
        return f"± {self.d_x_mm:.2g} mm"


def truth_uncertainty(results: Iterable[TrialResult]) -> TruthUncertainty:
    """Return how well the truth of a run is known; NaN where no whisk has one."""
    measured = [s for result, s, _ in whisks(results) if result.trial.purpose == "measure"]
    known = [seen for seen in measured if seen.has_truth]
    slips = [seen.at.slip_mm.sigma for seen in known if seen.at is not None]
    contradictions = [reaching((TRUTH,), seen.status) for seen in known]
    return TruthUncertainty(
        known=len(known),
        measured=len(measured),
        d_x_mm=_finite_median([seen.d_x_mm.sigma for seen in known]),
        touch_deg=math.degrees(_finite_median([seen.touch_rad.sigma for seen in known])),
        beta_deg=math.degrees(_finite_median([seen.beta_rad.sigma for seen in known])),
        slip_mm=_finite_median(slips),
        d_x_own_mm=_finite_median([seen.d_x_own_sigma_mm for seen in known]),
        d_x_shared_mm=_finite_median([seen.d_x_shared_sigma_mm for seen in known]),
        questioned=sum(map(bool, contradictions)),
        contradiction=_commonest(contradictions),
        source=known[0].truth_source if known else "",
    )


def _commonest(reasons: Iterable[Reason]) -> Reason:
    """Return the part of these reasons that stands in most of them; NO_REASON of none."""
    counts = Counter(part for one in reasons for part in one.parts)
    return Reason.of_parts(part for part, _ in counts.most_common(1))


@dataclass(frozen=True)
class RunAccuracy:
    """How well the truth of a run is known, and how far off each of its estimators is."""

    truth: TruthUncertainty
    estimators: tuple[Accuracy, ...]

    @classmethod
    def of_results(cls, results: Iterable[TrialResult]) -> "RunAccuracy":
        """Return the accuracy over the measured whisks of these results."""
        results = list(results)
        return cls(truth_uncertainty(results), tuple(accuracies(results)))


def _rms_share(parts: Iterable[tuple[float, float]]) -> float:
    """Return the RMS of the finite ratios of pairs (part, whole), per cent; NaN where there is none."""
    return rms_of_known(100.0 * part / whole for part, whole in parts)


def _finite_median(values: Sequence[float]) -> float:
    """Return the median of the finite values; NaN where there are none."""
    finite = [value for value in values if math.isfinite(value)]
    return float(np.median(finite)) if finite else math.nan
