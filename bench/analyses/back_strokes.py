"""Ways back, judged as forward strokes are, and each together with its way there: both_ways.csv.

Only where a trial asks for it (both_ways in trial.toml).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import degrees

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun, Heading
from bench.analyses.cells import value_cells, whisk_cells
from bench.analyses.compared_estimate import ComparedEstimate
from bench.analyses.pooling import column, coverage, grouped, rms
from bench.base.drawing import label_of
from bench.base.input_problems import in_one_status
from bench.base.tables import SURFACE, TRIAL, Column, Kind, Table, alike, status, with_sigma
from bench.records.trial_result import EstimateRow, FeltWhisk, SeenWhisk, TrialResult
from vision import UNKNOWN, WhiskTruth

BOTH_WAYS = Table(
    "both_ways",
    "A row a way back and estimator, of trials with `both_ways = true` ([moving.md](moving.md)).",
    (
        TRIAL,
        Column("whisk", "the whisk whose way back it is", Kind.WHOLE),
        SURFACE,
        *with_sigma("touch_deg", "where the whisker lets go of the bar, as seen"),
        *with_sigma("touch_felt_deg", "where the whisker lets go of the bar, as felt"),
        *with_sigma("d_x_mm", "as seen on the way back, else on the way there"),
        *with_sigma("beta_deg", "slope as seen on the way back"),
        Column("phi_seen_deg", "direction of the deflection as seen on the way back"),
        Column("phi_felt_deg", "felt at the wanted angle on the way back"),
        Column("phi_there_deg", "felt at that angle on the way there"),
        *alike(("m_y_Nmm", "m_z_Nmm"), "moments felt at that angle on the way back"),
        Column(
            "estimator",
            "both_ways: both together; the others by the way back alone, as if it were a forward "
            "stroke",
            Kind.TEXT,
        ),
        *with_sigma("d_x_est_mm", "as in estimates.csv"),
        *alike(("d_x_est_low_mm", "d_x_est_high_mm", "beta_est_deg"), "as in estimates.csv"),
        Column(
            "alpha_est_deg",
            "the friction angle that it assumed; of both_ways the one that it found",
        ),
        Column("error_mm", "d_x_est_mm less d_x_mm"),
        Column("error_percent", "that error, % of d_x_mm"),
        Column("inside", "1 where the estimate's 95 % interval holds d_x_mm, else 0"),
        status("warnings of way back and estimate"),
    ),
)


@dataclass(frozen=True, eq=False)
class WayBack(ComparedEstimate):
    """One estimate of one way back; its truth as seen on the way back, else on the way there.

    felt, felt_there: moments of the way back and of the way there.
    """

    result: TrialResult
    seen: SeenWhisk
    felt: FeltWhisk
    felt_there: FeltWhisk


class BothWays(Analysis):
    """How well ways back are estimated, alone and with their ways there."""

    tables = (BOTH_WAYS,)
    in_every_run = False
    heading = Heading("both_ways", "Ways back (both_ways.csv)")

    def compute(self, run: EvaluatedRun) -> list[WayBack]:
        """Return every estimate of every way back."""
        return ways_back(run.results)

    def row(self, one: WayBack) -> dict:
        """Return the row of a way back and estimator."""
        seen = one.seen
        felt = one.felt
        phi_seen_rad = np.nan if seen.at is None else seen.at.phi_rad.value
        return {
            **whisk_cells(one.result, seen.whisk),
            **one.cells,
            **value_cells("touch_deg", seen.touch_rad),
            **value_cells("touch_felt_deg", felt.touch_felt_rad),
            **value_cells("beta_deg", seen.beta_rad),
            "phi_seen_deg": degrees(phi_seen_rad),
            "phi_felt_deg": degrees(felt.phi_felt_rad.value),
            "phi_there_deg": degrees(one.felt_there.phi_felt_rad.value),
            "m_y_Nmm": felt.m_y_Nmm.value,
            "m_z_Nmm": felt.m_z_Nmm.value,
            "status": in_one_status(seen.status, felt.status, one.estimate.status),
        }

    def lines(self, found: Sequence[WayBack]) -> Iterator[str]:
        """Yield a line an estimator, over the ways back whose truth is known."""
        known = [one for one in found if np.isfinite(one.error_percent)]
        for name, mine in grouped(known, lambda one: one.estimate.estimator).items():
            error_percent = rms(column(mine, "error_percent"))
            held = coverage(mine, "way")
            yield f"{label_of(name)}: error of d_x {error_percent:.2g} % RMS; {held} back"


def ways_back(results: Sequence[TrialResult]) -> list[WayBack]:
    """Return every estimate of every way back; one without a distance where it was not felt."""
    found = []
    for result in results:
        felt_back = result.felt.ways_back
        seen_back = result.seen.ways_back
        if not seen_back:
            seen_back = [SeenWhisk(WhiskTruth(felt.whisk)) for felt in felt_back]
        for seen, seen_there, felt, felt_there in zip(
            seen_back, result.seen.whisks, felt_back, result.felt.whisks
        ):
            d_x_mm = seen.d_x_mm if seen.has_truth else seen_there.d_x_mm
            for estimate in felt.estimates or (EstimateRow("", UNKNOWN),):
                found.append(WayBack(estimate, d_x_mm, result, seen, felt, felt_there))
    return found
