"""Friction and distance without α_est, from whisks at several slopes of one surface: tilts.csv.

A slope that was set anew stands for a base that was tilted: trials of one surface and speed at one nominal distance are
solved together for that distance and α (`estimator.two_tilts`). No picture is looked at but for the error beside it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.analyses.runs import told_of
from bench.base.tables import SPEED, SURFACE, Column, Kind, Table, alike, status, with_sigma
from bench.gauges.gauge_readings import NOMINAL_SHARE
from bench.records.trial_result import FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.session.session import Session
from bench.trials.estimate_errors import is_sound
from bench.trials.estimates import whisk_of
from estimator.two_tilts import SharedContact, shared_contact
from vision.geometry.counted import counted

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
        status("why there is none, or what is doubtful"),
    ),
)
_LEAST_TILT_DEG = 10.0  # °: nominal slopes that differ by less are one, set up again


@dataclass(frozen=True, eq=False)
class Tilted:
    """What whisks of one surface, speed and nominal distance tell together; beta_deg: ends of their nominal slopes;
    d_x_true_mm: mean of their distances as seen, NaN without pictures."""

    surface: str
    speed_deg_s: float | None
    nominal_mm: float
    trials: int
    whisks: int
    beta_deg: tuple[float, float]
    found: SharedContact
    d_x_true_mm: float


def tilted_whisks(session: Session, results: Sequence[TrialResult]) -> list[Tilted]:
    """A row for each surface, speed and nominal distance with whisks at two slopes or more."""
    groups: dict[tuple, list[tuple]] = {}
    for result, seen, felt in whisks(results):
        trial = result.trial
        known = np.isfinite([trial.d_x_nominal_mm, trial.beta_nominal_deg]).all()
        if trial.purpose == "measure" and known and felt.has_moments and is_sound(seen, felt):
            groups.setdefault((*trial.panel, trial.d_x_nominal_mm), []).append((result, seen, felt))
    return [
        _tilted(session, *key, found)
        for key, found in groups.items()
        if np.ptp(_slopes(found)) >= _LEAST_TILT_DEG
    ]


def _slopes(found: Sequence[tuple[TrialResult, SeenWhisk, FeltWhisk]]) -> list[float]:
    return [result.trial.beta_nominal_deg for result, *_ in found]


def _tilted(
    session: Session,
    surface: str,
    speed_deg_s: float | None,
    nominal_mm: float,
    found: Sequence[tuple],
) -> Tilted:
    beam, names = session.whisker.beam, [result.trial.name for result, *_ in found]
    sigma_mm = max(session.trial(name).d_x_sigma_mm for name in names) or NOMINAL_SHARE * nominal_mm
    told = shared_contact(
        [whisk_of(felt, float(np.radians(result.theta_deg)), beam) for result, _, felt in found],
        told_of(found[0][0]),
        apart_sigma_mm=sigma_mm,
        places=names,
        shared_Nmm=[felt.shared_Nmm for *_, felt in found],
    )
    slopes, true = _slopes(found), float(np.mean([seen.d_x_mm.value for _, seen, _ in found]))
    ends = min(slopes), max(slopes)
    return Tilted(surface, speed_deg_s, nominal_mm, len(set(names)), len(found), ends, told, true)


def write_tilts(out: Path, found: Sequence[Tilted]) -> None:
    """Write tilts.csv."""
    TILTS.write(out, map(_row, found))


def _row(one: Tilted) -> dict:
    """Return the row of a surface, speed and nominal distance."""
    contact = one.found
    d_x_sigma_mm, alpha_sigma_rad = np.sqrt(np.diag(contact.covariance))
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
        "d_x_sigma_mm": float(d_x_sigma_mm),
        "d_x_low_mm": contact.low_mm,
        "d_x_high_mm": contact.high_mm,
        "alpha_deg": float(np.degrees(contact.alpha_rad)),
        "alpha_sigma_deg": float(np.degrees(alpha_sigma_rad)),
        "correlation": float(contact.covariance[0, 1] / (d_x_sigma_mm * alpha_sigma_rad)),
        "error_mm": error_mm,
        "error_percent": 100.0 * error_mm / one.d_x_true_mm,
        "status": contact.status,
    }


def tilted_lines(found: Sequence[Tilted]) -> Iterator[str]:
    """A line a surface that tells something."""
    for one in found:
        told = one.found
        if not np.isfinite(told.d_x_mm):
            continue
        d_x_sigma, alpha_sigma = np.sqrt(np.diag(told.covariance))
        speed = f", {one.speed_deg_s:g}°/s" if one.speed_deg_s is not None else ""
        yield (
            f"{one.surface or 'surface not named'}{speed}: {counted(one.whisks, 'whisk')} at slopes from "
            f"{one.beta_deg[0]:g} to {one.beta_deg[1]:g}° together, without α_est: d_x {told.d_x_mm:.2f} ± "
            f"{d_x_sigma:.2f} mm, α {np.degrees(told.alpha_rad):.1f} ± {np.degrees(alpha_sigma):.1f}°"
            + (f" ({told.status})" if told.status else "")
        )
