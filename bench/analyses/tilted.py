"""Friction and distance without α_est, from whisks at several slopes of one surface: tilts.csv.

A slope that was set anew stands for a base that was tilted: trials of one surface and speed at one nominal distance are
solved together for that distance and α (`estimator.two_tilts`). No picture is used but for the error of the result.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import degrees
from pathlib import Path

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun, PageTable, read_rows
from bench.analyses.cells import cell_with_sigma, panel_cell, panel_title
from bench.analyses.estimates_again import settings_without_alpha
from bench.analyses.friction_tables import FRICTION_ANGLE
from bench.analyses.pooling import sound_measured_whisks
from bench.base.numbers import MISSING, number, number_range
from bench.base.tables import SPEED, SURFACE, Column, Kind, Table, alike, status, with_sigma
from bench.gauges.gauge_readings import NOMINAL_SHARE
from bench.records.trial_result import FeltWhisk, SeenWhisk, TrialResult
from bench.session.session import Session
from bench.trials.estimates import whisk_of
from estimator.two_tilts import SharedContact, shared_contact
from vision.geometry import counted

TILTS = Table(
    "tilts",
    "A row a surface, speed and nominal distance with whisks at several nominal slopes: distance "
    "and friction angle solved together, without α_est and without pictures "
    "([designing.md](designing.md)).",
    (
        SURFACE,
        SPEED,
        Column("nominal_mm", "nominal distance"),
        Column("trials", "how many trials served"),
        Column("whisks", "how many whisks served", Kind.WHOLE),
        *alike(("beta_from_deg", "beta_to_deg"), "range of their nominal slopes"),
        *with_sigma(
            "d_x_mm",
            "distance; each trial may be off by `d_x_sigma_mm` of trial.toml, else by 1 %",
        ),
        *alike(("d_x_low_mm", "d_x_high_mm"), "its 95 % interval"),
        *with_sigma("alpha_deg", "friction angle"),
        Column("correlation", "of distance and friction angle"),
        Column("error_mm", "estimate less the mean of the distances seen"),
        Column("error_percent", "that error, % of that mean"),
        status("why there is none, or its warnings"),
    ),
)
# [°] Nominal slopes that differ by less are one, set up again.
_LEAST_TILT_DEG = 10.0


@dataclass(frozen=True, eq=False)
class Tilted:
    """Whisks of one surface, speed and nominal distance, solved together.

    beta_deg: ends of their nominal slopes. contact: distance and friction angle found. d_x_true_mm:
    mean of their distances as seen, NaN without pictures.
    """

    surface: str
    speed_deg_s: float | None
    nominal_mm: float
    trials: int
    whisks: int
    beta_deg: tuple[float, float]
    contact: SharedContact
    d_x_true_mm: float

    @property
    def d_x_sigma_mm(self) -> float:
        """Return the standard deviation of the distance found."""
        return float(np.sqrt(self.contact.covariance[0, 0]))

    @property
    def alpha_sigma_rad(self) -> float:
        """Return the standard deviation of the friction angle found."""
        return float(np.sqrt(self.contact.covariance[1, 1]))


class Tilts(Analysis):
    """Distance and friction angle of a surface by whisks at several slopes."""

    tables = (TILTS,)
    heading = FRICTION_ANGLE
    needs_session = True

    def compute(self, run: EvaluatedRun) -> list[Tilted]:
        """Return each surface, speed and nominal distance with whisks at two slopes or more."""
        return tilted_whisks(run.session, run.results)

    def row(self, one: Tilted) -> dict:
        """Return the row of a surface, speed and nominal distance."""
        contact = one.contact
        d_x_sigma_mm = one.d_x_sigma_mm
        alpha_sigma_rad = one.alpha_sigma_rad
        error_mm = contact.d_x_mm - one.d_x_true_mm
        return {
            "surface": one.surface,
            "speed_deg_s": one.speed_deg_s,
            "nominal_mm": one.nominal_mm,
            "trials": one.trials,
            "whisks": one.whisks,
            "beta_from_deg": one.beta_deg[0],
            "beta_to_deg": one.beta_deg[1],
            "d_x_mm": contact.d_x_mm,
            "d_x_sigma_mm": d_x_sigma_mm,
            "d_x_low_mm": contact.low_mm,
            "d_x_high_mm": contact.high_mm,
            "alpha_deg": degrees(contact.alpha_rad),
            "alpha_sigma_deg": degrees(alpha_sigma_rad),
            "correlation": float(contact.covariance[0, 1] / (d_x_sigma_mm * alpha_sigma_rad)),
            "error_mm": error_mm,
            "error_percent": 100.0 * error_mm / one.d_x_true_mm,
            "status": contact.status,
        }

    def lines(self, found: Sequence[Tilted]) -> Iterator[str]:
        """Yield a line a surface that has a result."""
        for one in found:
            contact = one.contact
            if not np.isfinite(contact.d_x_mm):
                continue
            low_deg, high_deg = one.beta_deg
            alpha_deg = degrees(contact.alpha_rad)
            status = f" ({contact.status})" if contact.status else ""
            yield (
                f"{panel_title(one.surface, one.speed_deg_s)}: {counted(one.whisks, 'whisk')} at slopes "
                f"from {low_deg:g} to {high_deg:g}° together, without α_est: d_x {contact.d_x_mm:.2f} ± "
                f"{one.d_x_sigma_mm:.2f} mm, α {alpha_deg:.1f} ± {degrees(one.alpha_sigma_rad):.1f}°{status}"
            )

    def page_table(self, out: Path) -> PageTable:
        """Return a row a surface, speed and nominal distance."""
        head = ("surface", "whisks", "slopes set [°]", "d_x [mm]", "95 % [mm]", "α [°]")
        head += ("error [%]", "status")
        rows = []
        for row in read_rows(out, TILTS):
            cells = (
                panel_cell(row),
                str(row["whisks"]),
                number_range(row["beta_from_deg"], row["beta_to_deg"], 0),
                cell_with_sigma(row, "d_x", "mm"),
                number_range(row["d_x_low_mm"], row["d_x_high_mm"], 2),
                cell_with_sigma(row, "alpha", "deg"),
                number(row["error_percent"]),
                row["status"] or MISSING,
            )
            rows.append(cells)
        title = "d_x and α from whisks at several slopes, without α_est"
        return PageTable(title, TILTS.file, head, tuple(rows))


def tilted_whisks(session: Session, results: Sequence[TrialResult]) -> list[Tilted]:
    """Solve each surface, speed and nominal distance with whisks at two slopes or more."""
    groups: dict[tuple, list[tuple[TrialResult, SeenWhisk, FeltWhisk]]] = {}
    for result, seen, felt in sound_measured_whisks(results):
        trial = result.trial
        is_known = np.isfinite([trial.d_x_nominal_mm, trial.beta_nominal_deg]).all()
        if is_known and felt.has_moments:
            place = (*trial.panel, trial.d_x_nominal_mm)
            groups.setdefault(place, []).append((result, seen, felt))
    found = []
    for place, of_group in groups.items():
        slopes_deg = [result.trial.beta_nominal_deg for result, _, _ in of_group]
        if np.ptp(slopes_deg) >= _LEAST_TILT_DEG:
            beta_deg = (min(slopes_deg), max(slopes_deg))
            found.append(_tilted(session, *place, beta_deg, of_group))
    return found


def _tilted(
    session: Session,
    surface: str,
    speed_deg_s: float | None,
    nominal_mm: float,
    beta_deg: tuple[float, float],
    of_group: Sequence[tuple[TrialResult, SeenWhisk, FeltWhisk]],
) -> Tilted:
    """Return the distance and the friction angle of whisks at one place."""
    return Tilted(
        surface,
        speed_deg_s,
        nominal_mm,
        trials=len({result.trial.name for result, _, _ in of_group}),
        whisks=len(of_group),
        beta_deg=beta_deg,
        contact=_solve(session, nominal_mm, of_group),
        d_x_true_mm=float(np.mean([seen.d_x_mm.value for _, seen, _ in of_group])),
    )


def _solve(session: Session, nominal_mm: float, of_group: Sequence[tuple]) -> SharedContact:
    """Solve whisks at one nominal distance for that distance and the friction angle."""
    names = [result.trial.name for result, _, _ in of_group]
    stated_mm = max(session.trial(name).d_x_sigma_mm for name in names)
    pushes = []
    shared_Nmm = []
    for result, _, felt in of_group:
        theta_rad = result.theta_rad
        pushes.append(whisk_of(felt, theta_rad, session.whisker.beam))
        shared_Nmm.append(felt.shared_Nmm)
    return shared_contact(
        pushes,
        settings_without_alpha(of_group[0][0]),
        apart_sigma_mm=stated_mm or NOMINAL_SHARE * nominal_mm,
        places=names,
        shared_Nmm=shared_Nmm,
    )
