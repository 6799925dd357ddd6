"""The error that the whisks of a session share: no mean over whisks makes it less, and no scatter shows it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from bench.records.trial_result import TrialResult, whisks
from vision.geometry import Reason

# Causes of `budget` that are the same wire, bar, lamp, lenses and board in every whisk.
SHARED = ("diameters", "light", "cameras", "placement")
# Chance by which whisks of one recording would scatter so much with a sound part of their own.
_FALSE_ALARM = 1e-3
# Angles whose scatter stands with that of the distance, by their names.
_ANGLES = {"touch": "touch_rad", "β": "beta_rad"}


@dataclass(frozen=True)
class SharedDistance:
    """The part of d_x's error that all n whisks share, and each whisk's own, RMS of sigmas in mm.

    scatter_mm: of whisks of one recording about their mean, with so many degrees of freedom; NaN of
    none.
    """

    shared_mm: float
    own_mm: float
    n: int
    scatter_mm: float
    freedom: int

    @property
    def mean_sigma_mm(self) -> float:
        """Return the standard deviation of the mean error of all whisks."""
        return float(np.hypot(self.shared_mm, self.own_mm / np.sqrt(self.n)))

    @property
    def is_too_narrow(self) -> bool:
        """Return whether whisks of one recording scatter by more than their own part allows."""
        if not self.freedom:
            return False
        most = self.own_mm**2 * chdtri(self.freedom, _FALSE_ALARM)
        return self.freedom * self.scatter_mm**2 > most


def shared_distance(results: Sequence[TrialResult]) -> SharedDistance | None:
    """Return shared and own error; None where fewer than two whisks have a truth with its budget."""
    variances = []
    shares = []
    for _, seen, _ in whisks(results):
        if seen.has_truth and seen.truth.budget:
            variances.append(seen.d_x_mm.sigma**2)
            shares.append(sum(np.nan_to_num(seen.truth.budget[cause]) for cause in SHARED))
    if len(variances) < 2:
        return None
    variance = np.array(variances)
    share = np.array(shares)
    shared_mm = float(np.sqrt(np.mean(variance * share)))
    own_mm = float(np.sqrt(np.mean(variance * np.maximum(1.0 - share, 0.0))))
    return SharedDistance(shared_mm, own_mm, len(variances), *_scatter(results, "d_x_mm"))


def _scatter(results: Sequence[TrialResult], name: str) -> tuple[float, int]:
    """Return the standard deviation of whisks of one recording about their mean, pooled.

    With its degrees of freedom; name: of a `Value` of SeenWhisk.
    """
    freedom = 0
    squares = 0.0
    for result in results:
        values = [getattr(seen, name).value for seen in result.seen.whisks if seen.has_truth]
        if len(values) > 1:
            freedom += len(values) - 1
            squares += len(values) * np.var(values)
    return (float(np.sqrt(squares / freedom)) if freedom else np.nan), freedom


def shared_lines(results: Sequence[TrialResult]) -> Iterator[str]:
    """Yield the lines of the summary on what whisks share."""
    shared = shared_distance(results)
    if shared is None:
        return
    yield (
        f"of d_x's sigma ± {shared.shared_mm:.4f} mm is one error that all {shared.n} whisks share "
        f"({', '.join(SHARED)}), ± {shared.own_mm:.4f} mm each whisk's own: their mean is known to ± "
        f"{shared.mean_sigma_mm:.4f} mm"
    )
    if shared.freedom:
        angles = []
        for name, field in _ANGLES.items():
            scatter_rad, _ = _scatter(results, field)
            angles.append(f"{name} {np.degrees(scatter_rad):.4f}°")
        yield (
            f"  whisks of one recording scatter about their mean by d_x {shared.scatter_mm:.4f} mm, "
            f"{', '.join(angles)} ({shared.freedom} degrees of freedom)"
        )


def scatter_warnings(results: Sequence[TrialResult]) -> Iterator[Reason]:
    """Yield a warning where whisks of one recording, which share bar and light, differ too much."""
    shared = shared_distance(results)
    if shared is not None and shared.is_too_narrow:
        yield Reason(
            "whisks_scatter",
            f"whisks of one recording scatter by {shared.scatter_mm:.4f} mm in d_x, {shared.own_mm:.4f} mm is stated "
            "as each whisk's own: bar or wire moves from whisk to whisk, or that part of the sigma is too narrow",
        )
