"""How the page names whisks and writes values."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from bench.base.numbers import MISSING, number, with_sigma
from bench.records.trial_result import FeltWhisk, SeenWhisk, TrialResult, whisks
from vision.truth.value import Value

__all__ = ["MISSING", "Row", "number", "rows_of", "told", "with_sigma"]


@dataclass(frozen=True, eq=False)
class Row:
    """One whisk of the page: its key, unique in the page, and its result, seen and felt."""

    key: str
    result: TrialResult
    seen: SeenWhisk
    felt: FeltWhisk

    @property
    def trial(self) -> str:
        """Return the name of its trial."""
        return self.result.trial.name

    @property
    def name(self) -> str:
        """Return the trial, and the whisk's number where it is not the first."""
        return self.trial + (f", whisk {self.seen.whisk}" if self.seen.whisk else "")


def rows_of(results: Iterable[TrialResult]) -> list[Row]:
    """Return all whisks in their order."""
    return [Row(f"w{n}", *whisk) for n, whisk in enumerate(whisks(results))]


def told(value: Value, *, degrees: bool = False) -> str:
    """Return a value with its sigma; an angle in degrees."""
    scale = math.degrees(1.0) if degrees else 1.0
    return with_sigma(scale * float(value.value), scale * float(value.sigma))
