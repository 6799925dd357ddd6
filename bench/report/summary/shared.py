"""What the whisks of a session share of their error: no mean over whisks makes it less, and no scatter shows it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from bench.records.trial_result import TrialResult, whisks
from vision.geometry.reasons import Reason

# Causes of `budget` that are the same wire, bar, lamp, lenses and board in every whisk.
SHARED = ("diameters", "light", "cameras", "placement")
# Chance by which whisks of one recording would scatter so much with a sound part of their own.
_FALSE_ALARM = 1e-3
_BESIDE = (("touch", "touch_rad"), ("β", "beta_rad"))


@dataclass(frozen=True)
class SharedDistance:
    """Of d_x, mm: RMS over n whisks of the part of sigma that all share, and of each whisk's own. scatter_mm: of whisks
    of one recording about their mean, with so many degrees of freedom; NaN of none."""

    shared_mm: float
    own_mm: float
    n: int
    scatter_mm: float
    freedom: int

    @property
    def mean_sigma_mm(self) -> float:
        """Of the mean error of all whisks."""
        return float(np.hypot(self.shared_mm, self.own_mm / np.sqrt(self.n)))

    @property
    def is_too_narrow(self) -> bool:
        """Whether whisks of one recording scatter by more than their own part says."""
        most = self.own_mm**2 * chdtri(self.freedom, _FALSE_ALARM) if self.freedom else np.inf
        return self.freedom * self.scatter_mm**2 > most


def shared_distance(results: Sequence[TrialResult]) -> SharedDistance | None:
    """None where fewer than two whisks have a truth with its budget."""
    seen = [s for _, s, _ in whisks(results) if s.has_truth and s.truth.budget]
    if len(seen) < 2:
        return None
    variance = np.array([s.d_x_mm.sigma**2 for s in seen])
    share = np.array([sum(np.nan_to_num(s.truth.budget[cause]) for cause in SHARED) for s in seen])
    shared, own = (
        float(np.sqrt(np.mean(variance * part))) for part in (share, np.maximum(1.0 - share, 0.0))
    )
    return SharedDistance(shared, own, len(seen), *_scatter(results, "d_x_mm"))


def _scatter(results: Sequence[TrialResult], key: str) -> tuple[float, int]:
    """Standard deviation of whisks of one recording about their mean, pooled, and its degrees of freedom."""
    groups = [
        [getattr(s, key).value for s in result.seen.whisks if s.has_truth] for result in results
    ]
    freedom = sum(max(len(group) - 1, 0) for group in groups)
    squares = sum(len(group) * np.var(group) for group in groups if len(group) > 1)
    return (float(np.sqrt(squares / freedom)) if freedom else np.nan), freedom


def shared_lines(results: Sequence[TrialResult]) -> Iterator[str]:
    """For the summary."""
    shared = shared_distance(results)
    if shared is None:
        return
    yield (
        f"of d_x's sigma ± {shared.shared_mm:.4f} mm is one error that all {shared.n} whisks share "
        f"({', '.join(SHARED)}), ± {shared.own_mm:.4f} mm each whisk's own: their mean is known to ± "
        f"{shared.mean_sigma_mm:.4f} mm"
    )
    if shared.freedom:
        beside = (f"{name} {np.degrees(_scatter(results, key)[0]):.4f}°" for name, key in _BESIDE)
        yield (
            f"  whisks of one recording scatter about their mean by d_x {shared.scatter_mm:.4f} mm, "
            f"{', '.join(beside)} ({shared.freedom} degrees of freedom)"
        )


def shared_doubts(results: Sequence[TrialResult]) -> Iterator[Reason]:
    """A line where whisks of one recording, which share bar and light, differ by more than they may."""
    shared = shared_distance(results)
    if shared is not None and shared.is_too_narrow:
        yield Reason(
            "whisks_scatter",
            f"whisks of one recording scatter by {shared.scatter_mm:.4f} mm in d_x, {shared.own_mm:.4f} mm is stated "
            "as each whisk's own: bar or wire moves from whisk to whisk, or that part of the sigma is too narrow",
        )
