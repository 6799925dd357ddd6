"""Active reorientation, the rival of one push with (10): reorientation.csv.

Trials that name one `contact` in trial.toml are rotations against it, the plane of rotation turned between
them. After each of them the distance is that of (2) by the last rotation (`estimator.reorientation`).
"""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import degrees

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun, Heading
from bench.analyses.cells import as_cell, value_cells
from bench.analyses.compared_estimate import ComparedEstimate
from bench.analyses.pooling import column, coverage, grouped, rms, sound_measured_whisks
from bench.base.settings import Settings
from bench.base.tables import SURFACE, TRIAL, Column, Kind, Table, alike, status, with_sigma
from bench.records.trial_result import WITH_FRICTION, FeltWhisk, SeenWhisk, TrialResult
from bench.session.session import Session
from bench.trials.estimates import assumed_settings, run_estimator, whisk_of
from estimator.reorientation import next_turn_rad, reoriented, slip_angle
from vision import Value
from vision.geometry import counted

REORIENTATION = Table(
    "reorientation",
    "A row a rotation of each contact that trials name (`contact`): the distance known after it, by (2), "
    "and by (10) of the same push.",
    (
        Column("contact", "as trials name it", Kind.TEXT),
        TRIAL,
        SURFACE,
        Column(
            "rotation", "its number at this contact, in the order of the trials' names", Kind.WHOLE
        ),
        Column("plane_turn_deg", "how far the plane of rotation was turned, by trial.toml"),
        *with_sigma(
            "phi_felt_deg", "direction of the deflection against the turned plane, as felt"
        ),
        Column(
            "next_turn_deg",
            "how far to turn the plane before the next; 0 where the slip left is within the sigma",
        ),
        *with_sigma("d_x_est_mm", "distance by (2); its sigma holds the slip that is left"),
        *alike(("d_x_est_low_mm", "d_x_est_high_mm"), "its 95 % interval"),
        *with_sigma("d_x_mm", "the truth"),
        Column("error_mm", "d_x_est_mm less d_x_mm"),
        Column("error_percent", "that error, % of d_x_mm"),
        Column("inside", "1 where the 95 % interval holds d_x_mm, else 0"),
        Column("error_with_friction_mm", "the same of (10) by this push"),
        Column("inside_with_friction", "1 where the interval of (10) holds d_x_mm, else 0"),
        status("why there is no distance, or its warnings"),
    ),
)


@dataclass(frozen=True, eq=False)
class Rotation(ComparedEstimate):
    """One rotation of a contact: a row of REORIENTATION.

    Its estimate is by (2). phi_felt_rad: against the turned plane. next_turn_rad: 0 where what slip is left does not
    matter. one_push: by (10).
    """

    contact: str
    result: TrialResult
    rotation: int
    plane_turn_deg: float
    phi_felt_rad: Value
    next_turn_rad: float
    one_push: ComparedEstimate


class Reorientation(Analysis):
    """What is known of a contact after each rotation, its plane turned so that it slips less."""

    tables = (REORIENTATION,)
    in_every_run = False
    heading = Heading("reorientation", "Active reorientation (reorientation.csv)")
    needs_session = True

    def compute(self, run: EvaluatedRun) -> list[Rotation]:
        """Return each rotation of each contact."""
        return rotations_of(run.session, run.results, run.settings)

    def row(self, one: Rotation) -> dict:
        """Return the row of a rotation."""
        return {
            "trial": one.result.trial.name,
            "surface": one.result.trial.surface,
            **one.cells,
            "contact": one.contact,
            "rotation": one.rotation,
            "plane_turn_deg": one.plane_turn_deg,
            **value_cells("phi_felt_deg", one.phi_felt_rad),
            "next_turn_deg": degrees(one.next_turn_rad),
            "error_with_friction_mm": one.one_push.error_mm,
            "inside_with_friction": as_cell(one.one_push.inside),
            "status": one.estimate.status,
        }

    def lines(self, found: Sequence[Rotation]) -> Iterator[str]:
        """Yield a line a number of rotations, over the contacts whose distance is known."""
        known = [one for one in found if np.isfinite(one.error_percent)]
        for rotation, mine in sorted(grouped(known, lambda one: one.rotation).items()):
            by_2 = rms(column(mine, "error_percent"))
            by_10 = rms(column(mine, "one_push.error_percent"))
            settled = sum(one.next_turn_rad == 0.0 for one in mine)
            yield (
                f"after {counted(rotation, 'rotation')}: (2) is off by {by_2:.2g} % RMS, "
                f"{coverage(mine, 'contact')}, {settled} need no further turn; "
                f"(10) by the same push is off by {by_10:.2g} %"
            )


def rotations_of(
    session: Session, results: Sequence[TrialResult], settings: Settings
) -> list[Rotation]:
    """Return each rotation against each contact that trials name."""
    count: Counter[str] = Counter()
    found = []
    for result, seen, felt in sound_measured_whisks(results):
        contact = session.trial(result.trial.name).contact
        if contact and felt.has_moments:
            count[contact] += 1
            found.append(_rotation(session, settings, count[contact], result, seen, felt))
    return sorted(found, key=lambda one: (one.contact, one.rotation))


def _rotation(
    session: Session,
    settings: Settings,
    number: int,
    result: TrialResult,
    seen: SeenWhisk,
    felt: FeltWhisk,
) -> Rotation:
    """Return one whisk as a rotation of its contact."""
    trial = session.trial(result.trial.name)
    whisk = whisk_of(felt, result.theta_rad, session.whisker.beam)
    alpha_sigma_rad = math.radians(settings.first_alpha_est_sigma_deg)
    alpha_rad = settings.alpha_est_rad
    assumed = assumed_settings(alpha_rad, alpha_sigma_rad)
    by_2 = run_estimator("reoriented", reoriented, whisk, alpha_rad, alpha_sigma_rad)
    return Rotation(
        by_2,
        seen.d_x_mm,
        trial.contact,
        result,
        number,
        plane_turn_deg=trial.plane_turn_deg,
        phi_felt_rad=Value(*slip_angle(whisk)),
        next_turn_rad=next_turn_rad(whisk, assumed),
        one_push=ComparedEstimate(felt.estimate(WITH_FRICTION), seen.d_x_mm),
    )
