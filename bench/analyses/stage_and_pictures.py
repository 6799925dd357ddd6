"""The stage against the pictures, whisk by whisk, where a session has both."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from bench.analyses.analysis import Analysis, EvaluatedRun, Heading
from bench.analyses.cells import value_cells
from bench.base.tables import TRIAL, WHISK, Column, Table, status, with_sigma
from bench.records.trial_result import PicturedContact, SeenWhisk, whisks
from vision import Value
from vision.geometry import counted

STAGE = Heading("stage", "The stage against pictures and what is felt (± one sigma)")
STAGE_AND_PICTURES = Table(
    "stage_and_pictures",
    "A row a whisk whose truth is a stage's and which pictures show, too.",
    (
        TRIAL,
        WHISK,
        *with_sigma("d_x_stage_mm", "distance by the stage: the truth"),
        *with_sigma("d_x_pictures_mm", "distance by the pictures"),
        *with_sigma("d_x_difference_mm", "stage less pictures"),
        Column("z", "that over its sigma"),
        *with_sigma("beta_stage_deg", "slope by the stage"),
        *with_sigma("beta_pictures_deg", "slope by the pictures"),
        status("what contradicts the truth"),
    ),
)


@dataclass(frozen=True)
class Compared:
    """A whisk with a truth by a stage, and what the pictures show of it."""

    trial: str
    seen: SeenWhisk
    pictured: PicturedContact

    @property
    def difference_mm(self) -> Value:
        """Return d_x by the stage less that by the pictures."""
        stage = self.seen.d_x_mm
        pictures = self.pictured.d_x_mm
        sigma = math.hypot(stage.sigma, pictures.sigma)
        return Value(float(stage.value - pictures.value), sigma)

    @property
    def z(self) -> float:
        """Return the difference over its sigma; NaN where both are exact."""
        sigma_mm = self.difference_mm.sigma
        return self.difference_mm.value / sigma_mm if sigma_mm else math.nan


class StageAndPictures(Analysis):
    """By how much the stage's distances differ from those seen."""

    tables = (STAGE_AND_PICTURES,)
    in_every_run = False
    heading = STAGE

    def compute(self, run: EvaluatedRun) -> list[Compared]:
        """Return every whisk that both know."""
        found = []
        for result, seen, _ in whisks(run.results):
            if seen.pictured is not None and seen.has_truth:
                found.append(Compared(result.trial.name, seen, seen.pictured))
        return found

    def row(self, one: Compared) -> dict:
        """Return the row of a whisk."""
        return {
            "trial": one.trial,
            "whisk": one.seen.whisk,
            **value_cells("d_x_stage_mm", one.seen.d_x_mm),
            **value_cells("d_x_pictures_mm", one.pictured.d_x_mm),
            **value_cells("d_x_difference_mm", one.difference_mm),
            "z": one.z,
            **value_cells("beta_stage_deg", one.seen.beta_rad),
            **value_cells("beta_pictures_deg", one.pictured.beta_rad),
            "status": one.seen.status,
        }

    def lines(self, found: Sequence[Compared]) -> Iterator[str]:
        """Yield a line on all whisks, and one on the whisk that differs most."""
        if not found:
            return
        mean_mm = sum(one.difference_mm.value for one in found) / len(found)
        yield (
            f"{counted(len(found), 'whisk')}: d_x by the stage less d_x by the pictures {mean_mm:+.3f} mm in the mean"
        )
        most = max(found, key=lambda one: abs(one.z))
        apart = most.difference_mm
        yield (
            f"  most in {most.trial}, whisk {most.seen.whisk}: {apart.value:+.3f} ± {apart.sigma:.3f} mm "
            f"(z {most.z:+.1f}; stage_and_pictures.csv)"
        )
