"""The stage against what is felt, whisk by whisk, and the least error of a place that this would show."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from bench.analyses.analysis import Analysis, EvaluatedRun
from bench.analyses.cells import value_cells
from bench.analyses.stage_and_pictures import STAGE
from bench.base.tables import TRIAL, WHISK, Column, Table, with_sigma
from bench.trials.stage_against_felt import Comparison, compare
from bench.trials.stage_contact import X, Y, Z
from vision import Value

STAGE_AND_FELT = Table(
    "stage_and_felt",
    "A row a whisk whose truth is a stage's.",
    (
        TRIAL,
        WHISK,
        *with_sigma("touch_apart_deg", "touch felt less by the place, as the other whisks have it"),
        *with_sigma("d_x_apart_mm", "d_x by moments and stated slope, (6), less stated; likewise"),
        Column("least_along_mm", "least error of its place along x that is noticed"),
        Column("least_upward_mm", "and along z"),
    ),
)


@dataclass(frozen=True)
class HeldAgainst:
    """A whisk's contact as it is felt less as it is stated, as the other whisks have it."""

    trial: str
    whisk: int
    touch_rad: Value
    d_x_mm: Value
    least_along_mm: float
    least_upward_mm: float


@dataclass(frozen=True)
class StageHeld:
    """All whisks, and the least errors of the stage's origin along x, y and z that would be noticed, mm."""

    whisks: tuple[HeldAgainst, ...]
    least_origin_mm: tuple[float, float, float]


class StageAndFelt(Analysis):
    """How far a stage's contacts are from those that are felt."""

    tables = (STAGE_AND_FELT,)
    in_every_run = False
    heading = STAGE

    def compute(self, run: EvaluatedRun) -> StageHeld:
        """Return every whisk that is both stated and felt."""
        comparison = compare(run.results, run.whisker)
        if not comparison.held:
            return StageHeld((), (math.inf, math.inf, math.inf))
        held = [_held_against(comparison, k) for k in range(len(comparison.held))]
        origin = [comparison.least_noticed(axis) for axis in (X, Y, Z)]
        return StageHeld(tuple(held), tuple(origin))

    def rows(self, found: StageHeld) -> dict[Table, list[dict]]:
        """Return a row a whisk."""
        return {STAGE_AND_FELT: [_row(one) for one in found.whisks]}

    def lines(self, found: StageHeld) -> Iterator[str]:
        """Yield what touch and moments would show of a wrong place, and what they would not."""
        if not found.whisks:
            return
        least = [one.least_along_mm for one in found.whisks]
        low, high = _mm(min(least)), _mm(max(least))
        along = low if low == high else f"{low} to {high}"
        x, y, z = map(_mm, found.least_origin_mm)
        yield (
            f"touch and moments show a place along x that is off by {along} (stage_and_felt.csv), "
            f"and an origin off by {x} along x, {y} along y, {z} along z; smaller errors go unnoticed"
        )


def _held_against(comparison: Comparison, number: int) -> HeldAgainst:
    """Return a whisk of the comparison."""
    one = comparison.held[number]
    touch_rad, d_x_mm = comparison.apart_from_others(number)
    return HeldAgainst(
        *one.key,
        touch_rad,
        d_x_mm,
        comparison.least_noticed(X, number),
        comparison.least_noticed(Z, number),
    )


def _row(one: HeldAgainst) -> dict:
    """Return the row of a whisk; a cell is empty where no error would be noticed."""
    return {
        "trial": one.trial,
        "whisk": one.whisk,
        **value_cells("touch_apart_deg", one.touch_rad),
        **value_cells("d_x_apart_mm", one.d_x_mm),
        "least_along_mm": one.least_along_mm,
        "least_upward_mm": one.least_upward_mm,
    }


def _mm(least_mm: float) -> str:
    """Return the least error that would be noticed, in words."""
    return f"{least_mm:.2g} mm" if math.isfinite(least_mm) else "any size (never noticed)"
