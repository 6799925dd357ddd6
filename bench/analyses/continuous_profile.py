"""Continuous profile, a rival of one push with (10): profile.csv.

Of a session with a load cell, at each pushing angle, where the contact is (`estimator.profile`). Over a sweep
these contacts are a profile of the object.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import degrees
from typing import TYPE_CHECKING

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun, Heading, Scored, TrueRun
from bench.analyses.cells import value_cells, whisk_cells
from bench.analyses.pooling import column, grouped, rms, sound_measured_whisks
from bench.base.drawing import blank
from bench.base.tables import TRIAL, WHISK, Table, alike, status, with_sigma
from bench.records.trial_result import FeltAt, FeltWhisk, SeenWhisk, TrialResult
from estimator.beam import Beam
from estimator.profile import contact
from vision import Value
from vision.geometry import counted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# [whisks] Whose names fit below the figure, in two columns. A layout.
_MOST_NAMED = 12
_CONTACT = "contact of the whisker's middle, rig frame"
PROFILE = Table(
    "profile",
    "A row a pushing angle of each measured whisk with a load cell.",
    (
        TRIAL,
        WHISK,
        *alike(("theta_deg", "motor_deg"), "pushing angle, motor angle"),
        *with_sigma("x_est_mm", _CONTACT),
        *with_sigma("y_est_mm", _CONTACT),
        *with_sigma("z_est_mm", _CONTACT),
        *alike(("error_x_mm", "error_y_mm", "error_z_mm"), "these less the pictures'"),
        status("why there is no contact"),
    ),
)


@dataclass(frozen=True, eq=False)
class ProfilePoint:
    """One point of a profile: a row of PROFILE.

    point_mm: the contact (3,) in the rig frame, with its sigmas. error_mm (3,): NaN without pictures.
    """

    result: TrialResult
    whisk: int
    theta_rad: float
    motor_rad: float
    point_mm: Value
    error_mm: np.ndarray
    status: str


class ContinuousProfile(Analysis):
    """Where the contact is throughout each sweep."""

    tables = (PROFILE,)
    in_every_run = False
    heading = Heading("profile", "Continuous profile (profile.csv)")
    figure_name = "profile"
    figure_title = "Profiles by force and moment"
    figure_caption = "Contacts through each sweep, from above, with one sigma along x."
    needs_session = True

    def compute(self, run: EvaluatedRun) -> list[ProfilePoint]:
        """Return all points of all profiles."""
        found: list[ProfilePoint] = []
        for result, seen, felt in sound_measured_whisks(run.results):
            found += _points(run.session.whisker.beam, result, seen, felt)
        return found

    def row(self, one: ProfilePoint) -> dict:
        """Return the row of a point."""
        cells = {
            **whisk_cells(one.result, one.whisk),
            "theta_deg": degrees(one.theta_rad),
            "motor_deg": degrees(one.motor_rad),
            "status": one.status,
        }
        for axis, name in enumerate("xyz"):
            cells |= value_cells(f"{name}_est_mm", one.point_mm.at(axis))
            cells[f"error_{name}_mm"] = float(one.error_mm[axis])
        return cells

    def lines(self, found: Sequence[ProfilePoint]) -> Iterator[str]:
        """Yield a line a whisk."""
        for (trial, whisk), mine in _by_whisk(found).items():
            last_deg = degrees(mine[-1].theta_rad)
            sigma_mm = rms(column(mine, "point_mm.sigma")[:, 0])
            errors = column(mine, "error_mm")
            errors = errors[np.isfinite(errors).all(axis=1)]
            off = ""
            if len(errors):
                x, y, z = np.sqrt(np.mean(errors**2, axis=0))
                off = f"; off by {x:.2g}, {y:.2g} and {z:.2g} mm RMS"
            yield (
                f"{trial}, whisk {whisk}: {counted(len(mine), 'contact')} up to {last_deg:g}°, "
                f"x ± {sigma_mm:.2g} mm RMS{off}"
            )

    def figure(self, found: Sequence[ProfilePoint]) -> "Figure | None":
        """Draw the contacts of each whisk from above."""
        of_whisks = _by_whisk(found)
        if not of_whisks:
            return None
        drawing = blank(6.0, 4.6)
        axes = drawing.subplots()
        for (trial, _), mine in of_whisks.items():
            x, y, _ = column(mine, "point_mm.value").T
            sigma = column(mine, "point_mm.sigma")[:, 0]
            axes.errorbar(x, y, xerr=sigma, fmt="o-", ms=3, lw=0.8, label=trial)
        axes.set(xlabel="x  [mm]", ylabel="y  [mm]")
        if len(of_whisks) <= _MOST_NAMED:
            drawing.legend(loc="outside lower center", ncols=2)
        return drawing

    def scored(self, run: TrueRun) -> Iterator[Scored]:
        """Yield the contacts, by coordinate, of trials with one whisk."""
        pairs: dict[str, list] = {"x_est_mm": [], "y_est_mm": [], "z_est_mm": []}
        for trial, mine in grouped(run.rows(PROFILE), lambda row: row["trial"]).items():
            motor_deg, points_mm = run.contacts(trial)
            if not len(motor_deg) or np.any(np.diff(motor_deg) < 0):
                continue
            for row in mine:
                true_mm = interpolated_mm(float(row["motor_deg"]), motor_deg, points_mm)
                for name, true in zip(pairs, true_mm.tolist()):
                    pairs[name].append((row, true))
        for name, mine in pairs.items():
            yield Scored(name, mine, f"{name}, profile")


def _by_whisk(found: Sequence[ProfilePoint]) -> dict[tuple[str, int], list[ProfilePoint]]:
    """Return the points of known contacts by trial and whisk."""
    known = [one for one in found if not one.status]
    return grouped(known, lambda one: (one.result.trial.name, one.whisk))


def _points(
    beam: Beam, result: TrialResult, seen: SeenWhisk, felt: FeltWhisk
) -> Iterator[ProfilePoint]:
    """Yield the points of a whisk; none without a load cell."""
    for at in felt.by_theta:
        if at.force_N is None:
            continue
        motor_rad = felt.touch_felt_rad.value + at.theta_rad
        point_mm, why_none = _contact(at, motor_rad, beam)
        error_mm = point_mm.value - _seen_mm(seen, motor_rad)
        yield ProfilePoint(
            result, felt.whisk, at.theta_rad, motor_rad, point_mm, error_mm, why_none
        )


def _contact(at: FeltAt, motor_rad: float, beam: Beam) -> tuple[Value, str]:
    """Return the contact (3,) in the rig frame, and why there is none, else ""."""
    moments_Nmm = np.array([at.m_y_Nmm.value, at.m_z_Nmm.value])
    point, covariance, why_none = contact(
        moments_Nmm, at.covariance_at, at.force_N, at.force_covariance, beam
    )
    cos = np.cos(motor_rad)
    sin = np.sin(motor_rad)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    sigma = np.sqrt(np.diag(turn @ covariance @ turn.T))
    return Value(turn @ point, sigma), why_none


def _seen_mm(seen: SeenWhisk, motor_rad: float) -> np.ndarray:
    """Return the contact (3,) in the rig frame that pictures show at a motor angle; NaN beyond them."""
    frames = seen.frames
    if frames is None or not np.any(frames.touching):
        return np.full(3, np.nan)
    touching = frames.touching
    return interpolated_mm(motor_rad, frames.motor_rad[touching], frames.point_mm.value[touching])


def interpolated_mm(at_rad: float, motor_rad: np.ndarray, points_mm: np.ndarray) -> np.ndarray:
    """Interpolate contacts (n, 3) at rising motor angles (n,); NaN outside of them."""
    return np.array([np.interp(at_rad, motor_rad, own, np.nan, np.nan) for own in points_mm.T])
