"""Rows of the tables on whisks, estimates and tracks from the trials' results."""

from collections.abc import Iterable, Iterator, Sequence
from math import degrees
from pathlib import Path

import numpy as np

from bench.analyses.cells import value_cells, whisk_cells
from bench.analyses.compared_estimate import ComparedEstimate
from bench.base.input_problems import in_one_status
from bench.base.tables import shared_name
from bench.records.trial_result import EstimateRow, FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.report.whisk_tables import BEAM, BUDGET, ESTIMATES, PLACE, TRACK, WHISKS
from estimator.distance import cartesian, contact_point
from vision import CAUSES, NAN, UNKNOWN, Value
from vision.geometry import Reason

# Field of the value by column; in the table each value is followed by its sigma.
_SEEN = {
    "touch_deg": "touch_rad",
    "d_x_mm": "d_x_mm",
    "beta_deg": "beta_rad",
    "psi_deg": "psi_rad",
}
_AT_ANGLE = {
    "slip_mm": "slip_mm",
    "longitudinal_slip_mm": "longitudinal_slip_mm",
    "d_y_mm": "d_y_mm",
    "d_z_mm": "d_z_mm",
    "phi_seen_deg": "phi_rad",
    "alpha_seen_deg": "alpha_rad",
}
_FELT = {
    "touch_felt_deg": "touch_felt_rad",
    "m_y_Nmm": "m_y_Nmm",
    "m_z_Nmm": "m_z_Nmm",
    "phi_felt_deg": "phi_felt_rad",
}
# Quantities of BEAM, fields of the whisk's `beam`, with the units of their columns.
BEAM_UNITS = {"d_x": "mm", "touch": "deg", "slip": "mm"}
# A robot takes its whiskers to turn in the plane in which they were mounted. Their contacts are off it
# by sag and set of the wire: 0.1 mm, and as much again by its clamp, of the paper's wire at 60 mm.
Z_C_MM = Value(0.0, 0.2)


def write_tables(out: Path, results: Sequence[TrialResult]) -> None:
    """Write whisks.csv, estimates.csv, budget.csv, beam.csv, and a track a trial."""
    WHISKS.write(out, whisk_rows(results))
    ESTIMATES.write(out, estimate_rows(results))
    BUDGET.write(out, budget_rows(results))
    BEAM.write(out, beam_rows(results))
    for result in results:
        TRACK.write_file(out / "track" / f"{result.trial.name}.csv", track_rows(result))


def whisk_rows(results: Iterable[TrialResult]) -> Iterator[dict]:
    """Yield a row a whisk, by column."""
    for result, seen, felt in whisks(results):
        row = whisk_cells(result, seen.whisk)
        row["theta_deg"] = result.theta_deg
        row["status"] = status_of(seen, felt)
        row["beta_nominal_deg"] = result.trial.beta_nominal_deg
        for source, fields in ((seen, _SEEN), (felt, _FELT), (seen.at, _AT_ANGLE)):
            for column, field in fields.items():
                row |= value_cells(column, getattr(source, field, UNKNOWN))
        row |= _point_cells(seen.point_mm) | _shared_cells(seen)
        row["cameras"] = seen.truth.cameras
        row["frames_used"] = seen.truth.frames_used
        row["looked"] = seen.looked
        row["truth_source"] = seen.truth_source
        row["angle_from"] = result.trial.angle_from
        yield row


def budget_rows(results: Iterable[TrialResult]) -> Iterator[dict]:
    """Yield a row a whisk with truth: the share of d_x's variance that each cause has."""
    for result, seen, _ in whisks(results):
        if not (seen.has_truth and seen.truth.budget):
            continue
        row = whisk_cells(result, seen.whisk)
        row["d_x_sigma_mm"] = seen.d_x_mm.sigma
        for cause in CAUSES:
            row[f"{cause}_percent"] = 100.0 * seen.truth.budget.get(cause, NAN)
        yield row


def beam_rows(results: Iterable[TrialResult]) -> Iterator[dict]:
    """Yield a row a whisk with truth: its quantities by a beam and by a spline.

    They are d_x, touch, and slip at the largest pushing angle.
    """
    for result, seen, _ in whisks(results):
        beam = seen.truth.beam
        if not (seen.has_truth and beam):
            continue
        row = whisk_cells(result, seen.whisk)
        row["chance"] = beam.chance
        row["theta_deg"] = degrees(beam.theta_rad)
        for quantity, unit in BEAM_UNITS.items():
            compared = getattr(beam, quantity)
            for part in ("beam", "spline", "difference_sigma"):
                value = getattr(compared, part)
                row[f"{quantity}_{part}_{unit}"] = degrees(value) if unit == "deg" else value
        yield row


def status_of(seen: SeenWhisk, felt: FeltWhisk) -> Reason:
    """Return all warnings of a whisk, seen and felt, each once."""
    return in_one_status(seen.status, felt.status)


def _point_cells(point_mm: Value) -> dict[str, float]:
    """Return the cells of a point (3,) and of its sigmas; empty where there is none."""
    cells = {}
    for axis, column in enumerate(PLACE):
        cells |= value_cells(column, point_mm.at(axis))
    return cells


def _shared_cells(seen: SeenWhisk) -> dict[str, float]:
    """Return the cells of what all whisks share of the sigmas; none where nothing is known of it."""
    shared = seen.truth.shared
    if shared is None:
        return {}
    cells = {}
    for column, field in _SEEN.items():
        sigma = getattr(shared, field)
        cells[shared_name(column)] = degrees(sigma) if column.endswith("_deg") else sigma
    for column, sigma in zip(PLACE, shared.point_mm):
        cells[shared_name(column)] = float(sigma)
    cells[shared_name("slip_mm")] = getattr(seen.at, "slip_shared_mm", NAN)
    return cells


def estimate_rows(results: Iterable[TrialResult]) -> Iterator[dict]:
    """Yield a row a whisk and estimator, by column; errors are empty where there is no truth."""
    for result, seen, felt in whisks(results):
        for estimate in (*felt.estimates, *felt.sensors):
            yield {
                **whisk_cells(result, seen.whisk),
                **ComparedEstimate(estimate, seen.d_x_mm).cells,
                **_contact_cells(seen, felt, estimate),
                "d_x_est_sigma_alpha_exact_mm": estimate.d_x_est_sigma_alpha_exact_mm,
                "truth_source": seen.truth_source,
                "angle_from": result.trial.angle_from,
                "status": estimate.status,
            }


def _contact_cells(seen: SeenWhisk, felt: FeltWhisk, estimate: EstimateRow) -> dict[str, float]:
    """Return the cells of the contact (r_c, θ_c, z_c) felt, and of deflection and slip there.

    They have its distance from the contact seen, and the errors of deflection and slip.
    """
    touch = felt.touch_felt_rad
    cells = value_cells("theta_c_deg", touch) | value_cells("z_c_mm", Z_C_MM)
    scale = estimate.d_x_est_mm.sigma * touch.sigma
    cells["r_theta_correlation"] = estimate.touch_covariance_mm_rad / scale
    cells["point_error_mm"] = point_error_mm(seen, felt, estimate)
    for quantity in ("d_y", "d_z", "slip"):
        found = getattr(estimate, f"{quantity}_est_mm")
        truth = getattr(seen.at, f"{quantity}_mm", UNKNOWN)
        cells |= value_cells(f"{quantity}_est_mm", found)
        cells[f"{quantity}_error_mm"] = found.value - truth.value
    return cells


def point_error_mm(seen: SeenWhisk, felt: FeltWhisk, estimate: EstimateRow) -> float:
    """Return the distance of the contact felt from that seen at first touch; NaN without one of them."""
    contact = contact_point(estimate.d_x_est_mm.value, felt.touch_felt_rad.value, Z_C_MM.value)
    return float(np.linalg.norm(np.array(cartesian(*contact)) - seen.point_mm.value))


def track_rows(result: TrialResult) -> Iterator[dict]:
    """Yield a row a frame, by column."""
    for seen in result.seen.whisks:
        frames = seen.frames
        if frames is None:
            continue
        for k in range(len(frames.index)):
            yield {
                "frame": int(frames.index[k]),
                "whisk": seen.whisk,
                "time_s": float(frames.time_s[k]),
                "motor_deg": degrees(frames.motor_rad[k]),
                "theta_deg": degrees(frames.theta_rad.value[k]),
                "touching": int(frames.touching[k]),
                **_point_cells(frames.point_mm.at(k)),
                **value_cells("slip_mm", frames.slip_mm.at(k)),
                "d_y_mm": float(frames.d_y_mm.value[k]),
                "d_z_mm": float(frames.d_z_mm.value[k]),
                "phi_seen_deg": degrees(frames.phi_rad.value[k]),
                "status": frames.status[k],
            }
