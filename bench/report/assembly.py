"""All trials' results to tables: whisks.csv, estimates.csv, track/<trial>.csv. Missing is an empty cell."""

import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from bench.base.doubts import in_one_status
from bench.base.tables import sigma_name
from bench.records.trial_result import EstimateRow, FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.report.whisk_tables import BEAM, BUDGET, ESTIMATES, PLACE, TRACK, WHISKS
from estimator.distance import cartesian, contact_point
from vision.fit.covariance import CAUSES
from vision.geometry.reasons import Reason
from vision.truth.value import NAN, UNKNOWN, Value

# Column and field of the value; in the table each is followed by its sigma.
_SEEN = (
    ("touch_deg", "touch_rad"),
    ("d_x_mm", "d_x_mm"),
    ("beta_deg", "beta_rad"),
    ("psi_deg", "psi_rad"),
)
_AT_ANGLE = (
    ("slip_mm", "slip_mm"),
    ("longitudinal_slip_mm", "longitudinal_slip_mm"),
    ("d_y_mm", "d_y_mm"),
    ("d_z_mm", "d_z_mm"),
    ("phi_seen_deg", "phi_rad"),
    ("alpha_seen_deg", "alpha_rad"),
)
_FELT = (
    ("touch_felt_deg", "touch_felt_rad"),
    ("m_y_Nmm", "m_y_Nmm"),
    ("m_z_Nmm", "m_z_Nmm"),
    ("phi_felt_deg", "phi_felt_rad"),
)
_AT_CONTACT = ("d_y", "d_z", "slip")
# A robot takes its whiskers to turn in the plane in which they were mounted. Off it is what sag and set of a wire make:
# 0.1 mm, and as much again by its clamp, of the paper's wire at 60 mm.
Z_C_MM = Value(0.0, 0.2)


_BEAM = (
    ("d_x_mm", "d_x"),
    ("touch_deg", "touch"),
    ("slip_mm", "slip"),
)  # column and field of the whisk's `beam`


def write_tables(out: Path, results: Sequence[TrialResult]) -> None:
    """Write whisks.csv, estimates.csv, budget.csv, beam.csv, and a track a trial."""
    WHISKS.write(out, whisk_rows(results))
    ESTIMATES.write(out, estimate_rows(results))
    BUDGET.write(out, budget_rows(results))
    BEAM.write(out, beam_rows(results))
    for result in results:
        TRACK.write_file(out / "track" / f"{result.trial.name}.csv", track_rows(result))


def whisk_rows(results: Iterable[TrialResult]) -> Iterator[dict]:
    """A row a whisk, by column."""
    for result, seen, felt in whisks(results):
        trial, row = result.trial, {"theta_deg": result.theta_deg, "status": status_of(seen, felt)}
        row |= {
            name: getattr(trial, name) for name in ("surface", "speed_deg_s", "beta_nominal_deg")
        }
        for source, names in ((seen, _SEEN), (felt, _FELT), (seen.at, _AT_ANGLE)):
            for column, key in names:
                row |= _cells(column, key, getattr(source, key, UNKNOWN))
        row |= _place(seen.point_mm.value, seen.point_mm.sigma)
        row |= {name: getattr(seen.truth, name) for name in ("cameras", "frames_used")}
        row["looked"] = seen.looked
        yield row | _whisk_of(result, seen)


def budget_rows(results: Iterable[TrialResult]) -> Iterator[dict]:
    """A row a whisk with truth: what part of d_x's variance each cause has."""
    for result, seen, _ in whisks(results):
        if seen.has_truth and seen.truth.budget:
            shares = {
                f"{cause}_percent": 100.0 * seen.truth.budget.get(cause, NAN) for cause in CAUSES
            }
            yield _whisk_of(result, seen) | {"d_x_sigma_mm": seen.d_x_mm.sigma} | shares


def beam_rows(results: Iterable[TrialResult]) -> Iterator[dict]:
    """A row a whisk with truth: d_x, touch, and slip at the largest pushing angle, by a beam and by a spline."""
    for result, seen, _ in whisks(results):
        if not (seen.has_truth and seen.truth.beam):
            continue
        row = _whisk_of(result, seen) | {
            "chance": seen.truth.beam.chance,
            "theta_deg": math.degrees(seen.truth.beam.theta_rad),
        }
        for name, key in _BEAM:
            (stem, unit), compared = name.rsplit("_", 1), getattr(seen.truth.beam, key)
            for what in ("beam", "spline", "difference_sigma"):
                value = getattr(compared, what)
                row[f"{stem}_{what}_{unit}"] = math.degrees(value) if unit == "deg" else value
        yield row


def status_of(seen: SeenWhisk, felt: FeltWhisk) -> Reason:
    """What is doubtful of a whisk, seen and felt, each thing once."""
    return in_one_status(seen.status, felt.status)


def _whisk_of(result: TrialResult, seen: SeenWhisk) -> dict:
    return {"trial": result.trial.name, "whisk": seen.whisk}


def _cells(column: str, key: str, value: Value) -> dict[str, float]:
    """A value and its sigma in the unit of the column."""
    numbers = (value.value, value.sigma)
    return dict(
        zip(
            (column, sigma_name(column)),
            map(math.degrees, numbers) if key.endswith("_rad") else numbers,
        )
    )


def _place(point, sigma) -> dict[str, float]:
    """x, y, z with their sigmas of a point (3,); empty where there is none."""
    return dict(zip(PLACE, point.tolist())) | dict(zip(map(sigma_name, PLACE), sigma.tolist()))


def estimate_rows(results: Iterable[TrialResult]) -> Iterator[dict]:
    """A row a whisk and estimator, by column; errors are empty where there is no truth."""
    for result, seen, felt in whisks(results):
        truth = seen.d_x_mm.value
        for answer in (*felt.estimates, *felt.sensors):
            error = answer.d_x_est_mm.value - truth
            yield (
                _whisk_of(result, seen)
                | {
                    "estimator": answer.estimator,
                    "alpha_est_deg": math.degrees(answer.alpha_est_rad),
                    "d_x_est_mm": answer.d_x_est_mm.value,
                    "d_x_est_sigma_mm": answer.d_x_est_mm.sigma,
                    "d_x_est_sigma_alpha_exact_mm": answer.d_x_est_sigma_alpha_exact_mm,
                    "d_x_est_low_mm": answer.d_x_est_low_mm,
                    "d_x_est_high_mm": answer.d_x_est_high_mm,
                    "beta_est_deg": math.degrees(answer.beta_est_rad),
                    "error_mm": error,
                    "error_percent": 100.0 * error / truth,
                    "status": answer.status,
                }
                | _contact_cells(seen, felt, answer)
            )


def _contact_cells(seen: SeenWhisk, felt: FeltWhisk, answer: EstimateRow) -> dict[str, float]:
    """The contact (r_c, θ_c, z_c) felt, its distance from the one seen, deflection and slip there with their errors."""
    touch, r_c = felt.touch_felt_rad, answer.d_x_est_mm
    cells = _cells("theta_c_deg", "touch_rad", touch) | _cells("z_c_mm", "z_c_mm", Z_C_MM)
    cells["r_theta_correlation"] = answer.touch_covariance_mm_rad / (r_c.sigma * touch.sigma)
    cells["point_error_mm"] = point_error_mm(seen, felt, answer)
    for name in _AT_CONTACT:
        found, truth = getattr(answer, f"{name}_est_mm"), getattr(seen.at, f"{name}_mm", UNKNOWN)
        cells |= _cells(f"{name}_est_mm", f"{name}_mm", found) | {
            f"{name}_error_mm": found.value - truth.value
        }
    return cells


def point_error_mm(seen: SeenWhisk, felt: FeltWhisk, answer: EstimateRow) -> float:
    """How far the contact felt lies from where it was seen at first touch; NaN without one of them."""
    point = contact_point(answer.d_x_est_mm.value, felt.touch_felt_rad.value, Z_C_MM.value)
    return float(np.linalg.norm(np.array(cartesian(*point)) - seen.point_mm.value))


def track_rows(result: TrialResult) -> Iterator[dict]:
    """A row a frame, by column."""
    for seen in result.seen.whisks:
        frames = seen.frames
        for k in range(len(frames.index) if frames is not None else 0):
            yield {
                "frame": int(frames.index[k]),
                "whisk": seen.whisk,
                "time_s": float(frames.time_s[k]),
                "motor_deg": math.degrees(frames.motor_rad[k]),
                "theta_deg": math.degrees(frames.theta_rad.value[k]),
                "touching": int(frames.touching[k]),
                "slip_mm": float(frames.slip_mm.value[k]),
                "slip_sigma_mm": float(frames.slip_mm.sigma[k]),
                "d_y_mm": float(frames.d_y_mm.value[k]),
                "d_z_mm": float(frames.d_z_mm.value[k]),
                "phi_seen_deg": math.degrees(frames.phi_rad.value[k]),
                "status": frames.status[k],
            } | _place(frames.point_mm.value[k], frames.point_mm.sigma[k])
