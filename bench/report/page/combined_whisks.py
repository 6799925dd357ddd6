"""What whisks tell together, for the page: friction of each surface, distance without α_est, softness, sensors. Out of
the run's tables; only what has a row with a number in it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.analyses.friction_tables import SURFACES
from bench.analyses.soft import COMPLIANCE
from bench.analyses.table_i_sensors import SENSORS
from bench.analyses.tilted import TILTS
from bench.base.drawing import label_of
from bench.base.tables import Table
from bench.report.page.words import MISSING, number, with_sigma

_ALPHAS = {
    **{"seen": "seen", "felt": "felt", "least_squares": "fit of Fig. 8", "tilting": "tilting"},
    **{"consistency": "one distance", "smoothness": "several distances"},
}


@dataclass(frozen=True)
class TogetherTable:
    """A table of the page: title, the file that has it all, head, and a text a cell."""

    title: str
    file: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def together(out: Path) -> list[TogetherTable]:
    """The tables that have rows. Raises BadInput where a file is damaged."""
    tables = (_friction(out), _tilts(out), _softness(out), _sensors(out))
    return [table for table in tables if table.rows]


def _friction(out: Path) -> TogetherTable:
    table = _read(out, SURFACES)
    ways = [way for way in _ALPHAS if any(np.isfinite(row[f"alpha_{way}_deg"]) for row in table)]
    rows = (
        (_surface(row), str(row["whisks"]), *(_told(row, f"alpha_{way}", "deg") for way in ways))
        for row in table
    )
    head = ("surface", "whisks", *(f"{_ALPHAS[way]} [°]" for way in ways))
    return TogetherTable(
        "Friction angle α of each surface, way by way",
        "surfaces.csv",
        head,
        tuple(rows) * bool(ways),
    )


def _tilts(out: Path) -> TogetherTable:
    title = "d_x and α from whisks at several slopes, without α_est"
    head = (
        "surface",
        "whisks",
        "slopes set [°]",
        "d_x [mm]",
        "95 % [mm]",
        "α [°]",
        "error [%]",
        "status",
    )
    rows = tuple(
        (
            *(
                _surface(row),
                str(row["whisks"]),
                _range(row["beta_from_deg"], row["beta_to_deg"], 0),
            ),
            *(
                _told(row, "d_x", "mm"),
                _range(row["d_x_low_mm"], row["d_x_high_mm"], 2),
                _told(row, "alpha", "deg"),
            ),
            *(number(row["error_percent"]), row["status"] or MISSING),
        )
        for row in _read(out, TILTS)
    )
    return TogetherTable(title, "tilts.csv", head, rows)


def _softness(out: Path) -> TogetherTable:
    title = "Softness of the object, from whisks at two distances"
    head = ("surface", "whisks", "distances set [mm]", "d_x [mm]", "gives way [mm/N]")
    head += ("stiffness, 95 % [N/mm]", "status")
    rows = tuple(
        (
            *(_surface(row), f"{row['whisks_near']:g} + {row['whisks_far']:g}"),
            *(_range(row["near_nominal_mm"], row["far_nominal_mm"], 0), _told(row, "d_x", "mm")),
            *(_told(row, "give", "mm_N"), _stiffness(row), row["status"] or MISSING),
        )
        for row in _read(out, COMPLIANCE)
    )
    return TogetherTable(title, "compliance.csv", head, rows)


def _stiffness(row: np.void) -> str:
    """An end that is missing is infinite."""
    low, high = row["stiffness_low_N_mm"], row["stiffness_high_N_mm"]
    if not np.isfinite(low):
        return MISSING
    return f"{low:.3g} to {high:.3g}" if np.isfinite(high) else f"more than {low:.3g}"


def _sensors(out: Path) -> TogetherTable:
    """A row a surface and range of slopes, a column a sensor."""
    table = _read(out, SENSORS)
    names = list(dict.fromkeys(str(row["estimator"]) for row in table))
    title = "Sensors of Table I: RMS error of d_x (± RMS of the stated sigmas)"
    head = (
        "surface",
        "slope seen [°]",
        "α [°]",
        "whisks",
        *(f"{label_of(name)} [%]" for name in names),
    )
    return TogetherTable(title, "sensors.csv", head, tuple(_sensor_rows(table, names)))


def _sensor_rows(table: np.ndarray, names: Sequence[str]) -> Iterator[tuple[str, ...]]:
    groups: dict[tuple, dict[str, np.void]] = {}
    for row in table:
        groups.setdefault((row["surface"], row["beta_from_deg"]), {})[str(row["estimator"])] = row
    for mine in groups.values():
        one = next(iter(mine.values()))
        asked = max(int(row["whisks"] + row["none"]) for row in mine.values())
        slopes, alpha = (
            _range(one["beta_from_deg"], one["beta_to_deg"], 1),
            number(one["alpha_deg"], 1),
        )
        cells = (_of_sensor(mine[name]) if name in mine else MISSING for name in names)
        yield (one["surface"] or MISSING, slopes, alpha, str(asked), *cells)


def _of_sensor(row: np.void) -> str:
    if not row["whisks"]:
        return MISSING
    few = f" ({row['whisks']} whisks)" if row["none"] else ""
    return f"{number(row['error_rms_percent'], 1)} ± {number(row['error_sigma_percent'], 1)}{few}"


def _read(out: Path, table: Table) -> np.ndarray:
    """Read the rows of one of the run's tables; none where it has no such table."""
    return table.read(out) if (out / table.file).exists() else np.array([])


def _surface(row: np.void) -> str:
    speed = f", {row['speed_deg_s']:g}°/s" if np.isfinite(row["speed_deg_s"]) else ""
    return (row["surface"] or MISSING) + speed


def _told(row: np.void, stem: str, unit: str) -> str:
    return with_sigma(row[f"{stem}_{unit}"], row[f"{stem}_sigma_{unit}"])


def _range(low: float, high: float, digits: int) -> str:
    return (
        f"{number(low, digits)} to {number(high, digits)}"
        if np.isfinite([low, high]).all()
        else MISSING
    )
