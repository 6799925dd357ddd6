"""Ways back as forward strokes are judged, and each with its way there: both_ways.csv, and lines of the summary.

Only where a trial asks for it (both_ways in trial.toml).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.base.doubts import in_one_status
from bench.base.drawing import label_of
from bench.base.tables import SURFACE, TRIAL, Column, Kind, Table, alike, status, with_sigma
from bench.records.trial_result import EstimateRow, FeltWhisk, SeenWhisk, TrialResult
from vision.geometry.counted import counted
from vision.truth.records import WhiskTruth
from vision.truth.value import UNKNOWN, Value

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
        status("what is doubtful of way back and estimate"),
    ),
)


@dataclass(frozen=True, eq=False)
class WayBack:
    """What one estimator says of one way back, or why none does; there: the way there, as felt; d_x_mm: the contact's,
    as seen on the way back, else on the way there."""

    result: TrialResult
    seen: SeenWhisk
    d_x_mm: Value
    felt: FeltWhisk
    there: FeltWhisk
    answer: EstimateRow

    @property
    def error_mm(self) -> float:
        """Estimate less truth."""
        return self.answer.d_x_est_mm.value - float(self.d_x_mm.value)

    @property
    def inside(self) -> bool | None:
        """Whether the 95 % interval holds the truth; None where either is not known."""
        return self.answer.holds(self.d_x_mm.value)


def ways_back(results: Sequence[TrialResult]) -> list[WayBack]:
    """Every estimate of every way back; one without any where it was not felt."""
    found = []
    for result in results:
        seen = result.seen.ways_back or tuple(
            SeenWhisk(WhiskTruth(f.whisk)) for f in result.felt.ways_back
        )
        for one, forth, felt, there in zip(
            seen, result.seen.whisks, result.felt.ways_back, result.felt.whisks
        ):
            d_x = one.d_x_mm if one.has_truth else forth.d_x_mm
            found += [
                WayBack(result, one, d_x, felt, there, a)
                for a in felt.estimates or (EstimateRow("", UNKNOWN),)
            ]
    return found


def write_both_ways(out: Path, found: Sequence[WayBack]) -> None:
    """both_ways.csv; nothing where no way back was asked for."""
    if found:
        BOTH_WAYS.write(out, map(_row, found))


def _row(one: WayBack) -> dict:
    """Return the row of a way back and estimator."""
    seen = one.seen
    felt = one.felt
    answer = one.answer
    phi_seen_rad = np.nan if seen.at is None else seen.at.phi_rad.value
    return {
        "trial": one.result.trial.name,
        "whisk": seen.whisk,
        "surface": one.result.trial.surface,
        "touch_deg": float(np.degrees(seen.touch_rad.value)),
        "touch_sigma_deg": float(np.degrees(seen.touch_rad.sigma)),
        "touch_felt_deg": float(np.degrees(felt.touch_felt_rad.value)),
        "touch_felt_sigma_deg": float(np.degrees(felt.touch_felt_rad.sigma)),
        "d_x_mm": float(one.d_x_mm.value),
        "d_x_sigma_mm": float(one.d_x_mm.sigma),
        "beta_deg": float(np.degrees(seen.beta_rad.value)),
        "beta_sigma_deg": float(np.degrees(seen.beta_rad.sigma)),
        "phi_seen_deg": float(np.degrees(phi_seen_rad)),
        "phi_felt_deg": float(np.degrees(felt.phi_felt_rad.value)),
        "phi_there_deg": float(np.degrees(one.there.phi_felt_rad.value)),
        "m_y_Nmm": felt.m_y_Nmm.value,
        "m_z_Nmm": felt.m_z_Nmm.value,
        "estimator": answer.estimator,
        "d_x_est_mm": answer.d_x_est_mm.value,
        "d_x_est_sigma_mm": answer.d_x_est_mm.sigma,
        "d_x_est_low_mm": answer.d_x_est_low_mm,
        "d_x_est_high_mm": answer.d_x_est_high_mm,
        "beta_est_deg": float(np.degrees(answer.beta_est_rad)),
        "alpha_est_deg": float(np.degrees(answer.alpha_est_rad)),
        "error_mm": one.error_mm,
        "error_percent": 100.0 * one.error_mm / float(one.d_x_mm.value),
        "inside": None if one.inside is None else int(one.inside),
        "status": in_one_status(seen.status, felt.status, answer.status),
    }


def both_ways_lines(found: Sequence[WayBack]) -> Iterator[str]:
    """For the summary: a line an estimator, over the ways back whose truth is known."""
    judged = [one for one in found if np.isfinite(one.error_mm)]
    for name in dict.fromkeys(one.answer.estimator for one in judged):
        mine = [one for one in judged if one.answer.estimator == name]
        percent = [100.0 * one.error_mm / float(one.d_x_mm.value) for one in mine]
        held = sum(bool(one.inside) for one in mine)
        yield (
            f"{label_of(name)}: error of d_x {np.sqrt(np.mean(np.square(percent))):.2g} % RMS; its 95 % interval holds "
            f"{held} of {counted(len(mine), 'way')} back"
        )
