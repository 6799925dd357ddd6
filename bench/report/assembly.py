"""All trials' results to tables: whisks.csv, estimates.csv, track/<trial>.csv. Missing is an empty cell."""

import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from bench.base.results import number
from bench.base.tables import sigma_name, write_table
from bench.trials.compare import whisks
from vision.fit.uncertainty import CAUSES

# Column and key of the value; in the table each is followed by its sigma.
_AT_TOUCH = (
    ("touch_deg", "touch_rad"),
    ("touch_felt_deg", "touch_felt_rad"),
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
_FELT = (("m_y_Nmm", "m_y_Nmm"), ("m_z_Nmm", "m_z_Nmm"), ("phi_felt_deg", "phi_felt_rad"))
_PLACE = ("x_mm", "y_mm", "z_mm")


def _with_sigmas(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(column for name in names for column in (name, sigma_name(name)))


WHISK_COLUMNS = (
    *("trial", "whisk", "surface", "speed_deg_s", "beta_nominal_deg", "theta_deg"),
    *_with_sigmas([name for name, _ in (*_AT_TOUCH, *_AT_ANGLE, *_FELT)]),
    *_with_sigmas(_PLACE),
    *("cameras", "frames_used", "status"),
)
ESTIMATE_COLUMNS = (
    "trial",
    "whisk",
    "estimator",
    "alpha_est_deg",
    "d_x_est_mm",
    "d_x_est_sigma_mm",
    "d_x_est_sigma_alpha_exact_mm",
    "d_x_est_low_mm",
    "d_x_est_high_mm",
    "beta_est_deg",
    "error_mm",
    "error_percent",
    "status",
)
TRACK_COLUMNS = (
    "frame",
    "whisk",
    "time_s",
    "motor_deg",
    "theta_deg",
    "touching",
    *_PLACE,
    "slip_mm",
    *map(sigma_name, (*_PLACE, "slip_mm")),
    "d_y_mm",
    "d_z_mm",
    "phi_seen_deg",
    "status",
)


_BEAM = (("d_x_mm", "d_x"), ("touch_deg", "touch"), ("slip_mm", "slip"))  # column and key in the whisk's `beam`
BEAM_COLUMNS = (
    *("trial", "whisk", "theta_deg"),
    *(f"{stem}_{what}_{unit}" for stem, unit in (name.rsplit("_", 1) for name, _ in _BEAM)
      for what in ("beam", "spline", "difference_sigma")),
    "chance",
)  # fmt: skip
BUDGET_COLUMNS = ("trial", "whisk", "d_x_sigma_mm", *(f"{cause}_percent" for cause in CAUSES))


def write_tables(out: Path, results: Sequence[dict]) -> None:
    """whisks.csv, estimates.csv, budget.csv, beam.csv, and a track a trial."""
    write_table(out / "whisks.csv", WHISK_COLUMNS, whisk_rows(results))
    write_table(out / "estimates.csv", ESTIMATE_COLUMNS, estimate_rows(results))
    write_table(out / "budget.csv", BUDGET_COLUMNS, budget_rows(results))
    write_table(out / "beam.csv", BEAM_COLUMNS, beam_rows(results))
    for result in results:
        write_table(out / "track" / f"{result['trial']['name']}.csv", TRACK_COLUMNS, track_rows(result))


def whisk_rows(results: Iterable[dict]) -> Iterator[dict]:
    """A row a whisk, by column."""
    for result, seen, felt in whisks(results):
        trial, at = result["trial"], seen.get("at") or {}
        row = {"trial": trial["name"], "whisk": seen["whisk"], "theta_deg": result["theta_deg"]}
        row |= {name: trial[name] for name in ("surface", "speed_deg_s", "beta_nominal_deg")}
        for source, names in ((seen | felt, _AT_TOUCH), (at, _AT_ANGLE), (felt, _FELT)):
            row |= {column: value for name, key in names for column, value in _with_sigma(name, key, source)}
        row |= _place(seen.get("point_mm"), seen.get("point_sigma_mm"))
        yield row | {"cameras": seen["cameras"], "frames_used": seen["frames_used"], "status": status_of(seen, felt)}


def budget_rows(results: Iterable[dict]) -> Iterator[dict]:
    """A row a whisk with truth: what part of d_x's variance each cause has."""
    for result, seen, _ in whisks(results):
        if seen.get("d_x_mm") is not None and seen.get("budget"):
            shares = {f"{cause}_percent": 100.0 * number(seen["budget"][cause]) for cause in CAUSES}
            row = {"trial": result["trial"]["name"], "whisk": seen["whisk"], "d_x_sigma_mm": seen["d_x_sigma_mm"]}
            yield row | shares


def beam_rows(results: Iterable[dict]) -> Iterator[dict]:
    """A row a whisk with truth: d_x, touch, and slip at the largest pushing angle, by a beam and by a spline."""
    for result, seen, _ in whisks(results):
        beam = seen.get("beam")
        if seen.get("d_x_mm") is None or not beam:
            continue
        row = {"trial": result["trial"]["name"], "whisk": seen["whisk"], "chance": beam["chance"]}
        row["theta_deg"] = _degrees(beam["theta_rad"])
        for name, key in _BEAM:
            (stem, unit), turn = name.rsplit("_", 1), _degrees if name.endswith("_deg") else _same
            row |= {f"{stem}_{w}_{unit}": turn(beam[key][w]) for w in ("beam", "spline", "difference_sigma")}
        yield row


def status_of(seen: dict, felt: dict) -> str:
    """What is doubtful of a whisk, seen and felt, each thing once."""
    return "; ".join(dict.fromkeys(filter(None, [seen["status"], felt["status"]])))


def _with_sigma(name: str, key: str, source: dict) -> Iterator[tuple[str, float | None]]:
    turn = _degrees if key.endswith("_rad") else _same
    yield name, turn(source.get(key))
    yield sigma_name(name), turn(source.get(sigma_name(key)))


def _place(point, sigma) -> dict:
    """x, y, z with their sigmas of a point (3,); empty where there is none."""
    values, sigmas = point or [None] * 3, sigma or [None] * 3
    return dict(zip(_PLACE, values)) | dict(zip(map(sigma_name, _PLACE), sigmas))


def _degrees(value):
    return None if value is None else math.degrees(value)


def _same(value):
    return value


def estimate_rows(results: Iterable[dict]) -> Iterator[dict]:
    """A row a whisk and estimator, by column; errors are empty where there is no truth."""
    for result, seen, felt in whisks(results):
        truth = number(seen.get("d_x_mm"))
        for answer in felt["estimates"]:
            error = number(answer["d_x_est_mm"]) - truth
            yield answer | {
                "trial": result["trial"]["name"],
                "whisk": seen["whisk"],
                "error_mm": error,
                "alpha_est_deg": _degrees(answer["alpha_est_rad"]),
                "error_percent": 100.0 * error / truth,
                "beta_est_deg": _degrees(answer["beta_est_rad"]),
            }


def track_rows(result: dict) -> Iterator[dict]:
    """A row a frame, by column."""
    for seen in result["seen"]["whisks"]:
        frames = seen.get("frames") or {"index": []}
        for k, index in enumerate(frames["index"]):
            row = {"frame": index, "whisk": seen["whisk"], "touching": int(frames["touching"][k])}
            same = ("time_s", "slip_mm", "slip_sigma_mm", "d_y_mm", "d_z_mm", "status")
            row |= {name: frames[name][k] for name in same}
            angles = (("motor_deg", "motor_rad"), ("theta_deg", "theta_rad"), ("phi_seen_deg", "phi_rad"))
            row |= {name: _degrees(frames[key][k]) for name, key in angles}
            yield row | _place(frames["point_mm"][k], frames["point_sigma_mm"][k])

