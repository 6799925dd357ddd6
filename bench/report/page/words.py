"""How the page names whisks and writes numbers."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from bench.records.trial_result import FeltWhisk, SeenWhisk, TrialResult, whisks
from vision.truth.value import Value

MISSING = "–"
_SIGMA_DIGITS = 2


@dataclass(frozen=True, eq=False)
class Row:
    """One whisk of the page: key, unique in it, and the result, seen and felt."""

    key: str
    result: TrialResult
    seen: SeenWhisk
    felt: FeltWhisk

    @property
    def trial(self) -> str:
        """Name of its trial."""
        return self.result.trial.name

    @property
    def name(self) -> str:
        """Trial, and the whisk's number where it is not the first."""
        return self.trial + (f", whisk {self.seen.whisk}" if self.seen.whisk else "")


def rows_of(results: Iterable[TrialResult]) -> list[Row]:
    """All whisks in their order."""
    return [Row(f"w{n}", *whisk) for n, whisk in enumerate(whisks(results))]


def number(value: float | None, digits: int = 2) -> str:
    """With so many digits after the point; a dash for what is missing."""
    return (
        MISSING
        if value is None or not math.isfinite(value)
        else f"{value:.{digits}f}".replace("-", "−")
    )


def with_sigma(value: float, sigma: float, *, sign: bool = False) -> str:
    """Value ± sigma, to two digits of the sigma.

    >>> with_sigma(55.25149, 0.01234)
    '55.251 ± 0.012'
    >>> with_sigma(204.31, 14.2, sign=True)
    '+204 ± 14'
    >>> with_sigma(float("nan"), 0.1)
    '–'
    """
    if not math.isfinite(value):
        return MISSING
    plus = "+" if sign and value > 0 else ""
    if not (math.isfinite(sigma) and sigma > 0):
        return plus + f"{value:.4g}".replace("-", "−")
    digits = max(0, _SIGMA_DIGITS - 1 - math.floor(math.log10(sigma)))
    return plus + f"{value:.{digits}f}".replace("-", "−") + f" ± {sigma:.{digits}f}"


def told(value: Value, *, degrees: bool = False) -> str:
    """A value with its sigma; an angle in degrees."""
    scale = math.degrees(1.0) if degrees else 1.0
    return with_sigma(scale * float(value.value), scale * float(value.sigma))
