"""Numbers of many whisks combined: the one place where a mean gets its sigma, and many tests their level.

Whisks of one setting (a bar set up once, one recording) share what is wrong with that setting; all whisks share gauges,
cameras, the rig's placement and the model. A hundred whisks of one setting are therefore no hundred measurements of it:

    value = true + own + of its setting + common · causes

Own errors average over whisks. Errors of settings average over settings, and their size is what the settings' means
scatter by, where that is more than is stated. Common causes do not average at all.
"""

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.special import ndtri, stdtr, stdtrit

# [1] Quantile at which an interval of 95 % ends to either side. Stated.
_TWO_SIDED_95 = 0.975
# [1] Beyond so many degrees of freedom Student's t is the normal distribution to a float's last digits.
_NORMAL_FREEDOM = 1e6
# [1] Smaller eigenvalues of an information, over the largest, are rounding.
_SINGULAR = 1e-12


@dataclass(frozen=True)
class Combined:
    """A number that rests on many whisks.

    standard_error: root of its variance. freedom: degrees of freedom of that, infinite where it is stated
    and not estimated from a scatter. settings: how many settings it rests on.
    """

    value: float
    standard_error: float
    freedom: float
    settings: int

    @property
    def sigma(self) -> float:
        """Return half the 95 % interval by Student's t over 1.96: what a value's `± sigma` states."""
        return self.standard_error * student_factor(self.freedom)

    @property
    def chance(self) -> float:
        """Return the chance of a value as far from 0 where it is 0, to either side."""
        if self.standard_error == 0:
            return float(self.value == 0)
        return float(2 * stdtr(self.freedom, -abs(self.value) / self.standard_error))


# What is known where there is no whisk.
NOTHING = Combined(np.nan, np.nan, np.inf, 0)


@dataclass(frozen=True)
class Measurement:
    """A value of one whisk with its error in parts, one sigma each.

    own: of this whisk. of_setting: of all whisks of its setting, where it is stated. common (k,): change of
    the value by each cause that all whisks share, with its sign, in one order for all.
    """

    value: float
    own: float
    of_setting: float = 0.0
    common: tuple[float, ...] = ()

    @property
    def sigma(self) -> float:
        """Return the standard deviation of the value."""
        return float(np.linalg.norm([self.own, self.of_setting, *self.common]))

    @property
    def is_known(self) -> bool:
        """Return whether value and sigma are numbers."""
        return bool(np.isfinite([self.value, self.sigma]).all())


@dataclass(frozen=True, eq=False)
class Measurements:
    """One quantity, measured by n whisks.

    values (n,). own (n,): sigma of what each whisk has of its own. settings (n,): name of each whisk's
    setting. of_setting (n,): stated sigma of what the whisks of a setting share; 0 where nobody states
    it. common (n, k): change of each value at one sigma of each cause that all whisks share.
    """

    values: np.ndarray
    own: np.ndarray
    settings: Sequence[Hashable]
    of_setting: np.ndarray
    common: np.ndarray

    @classmethod
    def of(cls, measured: Iterable[tuple[Hashable, Measurement]]) -> Self:
        """Collect measurements, each with the name of its setting; those that are not known are left out.

        One with fewer common causes has none of the others.
        """
        known = [(setting, one) for setting, one in measured if one.is_known]
        most = max((len(one.common) for _, one in known), default=0)
        common = np.zeros((len(known), most))
        for row, (_, one) in zip(common, known):
            row[: len(one.common)] = one.common
        return cls(
            np.array([one.value for _, one in known]),
            np.array([one.own for _, one in known]),
            [setting for setting, _ in known],
            np.array([one.of_setting for _, one in known]),
            common,
        )

    def by_setting(self) -> dict[Hashable, Combined]:
        """Return the mean of each setting, without the common causes.

        Where whisks of a setting scatter by more than their own sigmas, the excess counts, with the
        degrees of freedom of that scatter.
        """
        found = {}
        for name in dict.fromkeys(self.settings):
            chosen = self._of(name)
            mean = _mean(self.values[chosen], self.own[chosen] ** 2)
            of_setting = float(mean.weights @ self.of_setting[chosen])
            own = _larger(Variance(mean.stated, np.inf), Variance(mean.scatter, mean.count - 1))
            total = add_variances((own.variance, own.freedom), (of_setting**2, np.inf))
            found[name] = Combined(mean.value, *_root(total), settings=1)
        return found

    def mean(self) -> Combined:
        """Return the mean over settings, with what all whisks share in its standard error.

        Each setting weighs by its variance and by what settings differ by beyond that (DerSimonian and
        Laird, Controlled Clinical Trials 7, 1986). The scatter of the settings about the mean (Hartung
        and Knapp, Statistics in Medicine 20, 2001) counts where it is more than is stated. NOTHING of no
        whisks.
        """
        if not len(self.values):
            return NOTHING
        of_settings = self.by_setting()
        values = np.array([one.value for one in of_settings.values()])
        variances = np.array([one.standard_error**2 for one in of_settings.values()])
        freedoms = np.array([one.freedom for one in of_settings.values()])
        between = _between(values, variances)
        mean = _mean(values, variances + between)
        stated = mean.weights**2 * variances  # (settings,)
        own = add_variances(*zip(stated, freedoms))
        own = _larger(own, Variance(mean.scatter, mean.count - 1))
        changes = self._common_of(list(of_settings), mean.weights)
        total = add_variances(
            (own.variance, own.freedom),
            (float(changes @ changes), np.inf),
        )
        return Combined(mean.value, *_root(total), settings=len(values))

    def _of(self, name: Hashable) -> np.ndarray:
        """Return which whisks (n,) are of a setting."""
        return np.array([setting == name for setting in self.settings])

    def _common_of(self, names: Sequence[Hashable], weights: np.ndarray) -> np.ndarray:
        """Return the change (k,) of the mean over settings (weights by name) by each common cause."""
        change = np.zeros(self.common.shape[1])
        for name, weight in zip(names, weights):
            chosen = self._of(name)
            within = _mean(self.values[chosen], self.own[chosen] ** 2)
            change += weight * (within.weights @ self.common[chosen])
        return change


def independent(values: np.ndarray, sigmas: np.ndarray) -> Measurements:
    """Return measurements (n,) that share nothing, each in a setting of its own."""
    count = len(values)
    nothing = np.zeros(count)
    return Measurements(values, sigmas, range(count), nothing, np.zeros((count, 0)))


@dataclass(frozen=True)
class Variance:
    """A variance and its degrees of freedom."""

    variance: float
    freedom: float


def add_variances(*parts: tuple[float, float]) -> Variance:
    """Add variances, each given with its degrees of freedom (Welch and Satterthwaite; GUM, G.4)."""
    total = 0.0
    of_freedom = 0.0
    for variance, freedom in parts:
        total += variance
        if variance > 0:
            of_freedom += variance**2 / freedom
    freedom = total**2 / of_freedom if of_freedom > 0 else np.inf
    return Variance(float(total), float(freedom) if freedom < _NORMAL_FREEDOM else np.inf)


def add_common(sigma: float, freedom: float, changes: np.ndarray) -> Variance:
    """Add to a fit's own variance the changes (k,) of its result by causes that all whisks share.

    A change that is not known (NaN) counts as none.
    """
    known = np.nan_to_num(changes)
    return add_variances((sigma**2, freedom), (float(known @ known), np.inf))


def sigma_without(sigma: float, parts: np.ndarray) -> float:
    """Return a standard deviation without some independent parts (k,) of it; NaN of one that is NaN."""
    return float(np.sqrt(np.maximum(sigma**2 - parts @ parts, 0.0)))


def student_factor(freedom: float) -> float:
    """Return half the 95 % interval of Student's t over that of the normal distribution."""
    if not np.isfinite(freedom):
        return 1.0
    return float(stdtrit(freedom, _TWO_SIDED_95) / ndtri(_TWO_SIDED_95))


def between_settings(
    values: np.ndarray, covariance: np.ndarray, design: np.ndarray, settings: Sequence[Hashable]
) -> np.ndarray:
    """Return the covariance (n, n) by which settings differ beyond what is stated of their whisks.

    values (n,) of stated covariance (n, n), fitted by design (n, p). One variance for all settings, by the
    moments of the residuals' squares (DerSimonian and Laird); 0 where they scatter by no more than is
    stated.
    """
    weight = np.linalg.inv(covariance)
    pull = weight @ design
    # Columns that the settings do not separate count as one.
    normal_inverse = np.linalg.pinv(design.T @ pull, rcond=_SINGULAR, hermitian=True)
    residual_weight = weight - pull @ normal_inverse @ pull.T
    names = np.array(settings)
    alike = (names[:, None] == names).astype(float)  # (n, n): 1 of whisks of one setting
    stated = np.trace(residual_weight @ covariance)
    excess = values @ residual_weight @ values - stated
    per_variance = np.trace(residual_weight @ alike)
    if per_variance <= 1e-9 * np.trace(weight @ alike):  # one setting, or as many as parameters
        return np.zeros_like(covariance)
    return max(excess, 0.0) / per_variance * alike


def holm(chances: Sequence[float], level: float) -> np.ndarray:
    """Return which (n,) of many tests stand, so that none stands by chance but with probability `level`.

    chances (n,): of as much where there is nothing; NaN of a test that could not be made, which does not
    count. Holm, Scandinavian Journal of Statistics 6, 1979: the smallest of n is compared with level/n,
    the next with level/(n − 1), and so on up to the first that fails.
    """
    chances = np.asarray(chances, dtype=float)
    stands = np.zeros(len(chances), dtype=bool)
    made = np.flatnonzero(np.isfinite(chances))
    for rank, index in enumerate(made[np.argsort(chances[made])]):
        if chances[index] > level / (len(made) - rank):
            break
        stands[index] = True
    return stands


def harmonic_mean_chance(chances: Sequence[float]) -> float:
    """Return the chance of n tests of one thing together, however much their errors are alike.

    chances (n,): of each. Tests that all have the same chance have it together; a single small one counts
    n times. Wilson, PNAS 116, 2019: below 0.001 it is right to a few per cent.
    """
    above_zero = np.maximum(chances, np.finfo(float).tiny)
    return 1.0 / float(np.mean(1.0 / above_zero))


@dataclass(frozen=True, eq=False)
class _Mean:
    """A weighted mean: weights (n,), and its variance as stated and by the scatter about it (n > 1)."""

    value: float
    weights: np.ndarray
    stated: float
    scatter: float

    @property
    def count(self) -> int:
        """Return how many values it is of."""
        return len(self.weights)


def _mean(values: np.ndarray, variances: np.ndarray) -> _Mean:
    """Return the mean of values (n,), weighted by their variances (n,); alike where one of these is 0."""
    weights = np.ones(len(values))
    if np.all(variances > 0):
        weights = 1.0 / variances
    weights = weights / np.sum(weights)
    value = float(weights @ values)
    scatter = 0.0
    if len(values) > 1:
        scatter = float(weights @ (values - value) ** 2) / (len(values) - 1)
    return _Mean(value, weights, float(weights**2 @ variances), scatter)


def _larger(stated: Variance, scatter: Variance) -> Variance:
    """Return a stated variance, or a scatter's where that is more."""
    return scatter if scatter.variance > stated.variance else stated


def _between(values: np.ndarray, variances: np.ndarray) -> float:
    """Return the variance by which settings (n,) differ beyond their own variances (n,)."""
    if len(values) < 2:
        return 0.0
    if not np.all(variances > 0):
        return float(np.var(values, ddof=1))
    weights = 1.0 / variances
    total = np.sum(weights)
    mean = weights @ values / total
    excess = weights @ (values - mean) ** 2 - (len(values) - 1)
    compared = total - weights @ weights / total  # 0 where one of them has all the weight
    return float(max(excess, 0.0) / compared) if compared > 0.0 else 0.0


def _root(total: Variance) -> tuple[float, float]:
    """Return standard error and degrees of freedom of a variance."""
    return float(np.sqrt(total.variance)), total.freedom
