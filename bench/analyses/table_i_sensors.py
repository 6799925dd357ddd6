"""What each sensor of Table I is worth on a session's own trials, by slope and friction: sensors.csv.

Only where a load cell was recorded: then each whisk is judged by all of them.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import degrees
from pathlib import Path

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun, Heading, PageTable, read_rows
from bench.analyses.friction_tables import SurfaceFriction
from bench.analyses.pooling import grouped, known_rows, mean, rms, sound_measured_whisks
from bench.base.drawing import label_of
from bench.base.numbers import MISSING, number, number_range
from bench.base.tables import SURFACE, WHISKS_KNOWN, WHISKS_WITHOUT, Column, Kind, Table, alike
from bench.records.trial_result import EstimateRow, TrialResult
from bench.trials.estimate_errors import slope_deg
from vision import Value
from vision.geometry import counted

SENSORS = Table(
    "sensors",
    "A row a sensor, surface and range of slopes, over the measured whisks with a truth "
    "and no warning; none without a load cell ([sensors.md](sensors.md)).",
    (
        Column(
            "estimator",
            "touch_alone, no_slip, moment_rate, with_friction, force_and_moment",
            Kind.TEXT,
        ),
        SURFACE,
        *alike(("beta_from_deg", "beta_to_deg"), "size of the slope seen, in steps of 15°"),
        Column("alpha_deg", "friction angle of the surface as seen, else by the fit of Fig. 8"),
        WHISKS_KNOWN,
        WHISKS_WITHOUT,
        Column("error_mean_percent", "mean error, % of the truth"),
        Column("error_rms_percent", "RMS error, % of the truth"),
        Column("error_sigma_percent", "RMS of the stated sigmas, % of the truth"),
        Column("inside_percent", "how many of the 95 % intervals hold the truth"),
    ),
)
_ESTIMATORS = ("touch_alone", "no_slip", "moment_rate", "with_friction", "force_and_moment")
# [°] Slopes of one row, of the paper's steps of 5° three; 0, 15, 30 … lie in the middles of theirs.
_BETA_DEG = 15.0


@dataclass(frozen=True)
class SensorErrors:
    """Errors of one sensor on one surface within a range of slopes: the columns of SENSORS."""

    estimator: str
    surface: str
    beta_from_deg: float
    beta_to_deg: float
    alpha_deg: float
    whisks: int
    none: int
    error_mean_percent: float
    error_rms_percent: float
    error_sigma_percent: float
    inside_percent: float

    @property
    def group(self) -> tuple[str, float]:
        """Return surface and least slope: sensors of one group were judged by the same whisks."""
        return self.surface, self.beta_from_deg

    @property
    def text(self) -> str:
        """Return the RMS error as the summary has it."""
        return f"{self.error_rms_percent:.2g} %" if self.whisks else "none"


class Sensors(Analysis):
    """How far each sensor of Table I errs on the same whisks."""

    tables = (SENSORS,)
    heading = Heading("sensors", "Sensors of Table I: error of d_x, RMS (sensors.csv)")

    def compute(self, run: EvaluatedRun) -> list[SensorErrors]:
        """Return the errors of each sensor, surface and range of slopes."""
        return sensor_errors(run.results, run.friction)

    def lines(self, found: Sequence[SensorErrors]) -> Iterator[str]:
        """Yield a line a surface and range of slopes."""
        for (surface, from_deg), mine in grouped(found, lambda one: one.group).items():
            first = mine[0]
            where = f"{surface or 'whisks'}, β {from_deg:g} to {first.beta_to_deg:g}°"
            if np.isfinite(first.alpha_deg):
                where += f", α {first.alpha_deg:.1f}°"
            count = max(one.whisks + one.none for one in mine)
            errors = ", ".join(f"{label_of(one.estimator)} {one.text}" for one in mine)
            yield f"{where} ({counted(count, 'whisk')}): {errors}"

    def page_table(self, out: Path) -> PageTable:
        """Return a row a surface and range of slopes, a column a sensor."""
        table = read_rows(out, SENSORS)
        names = list(dict.fromkeys(str(row["estimator"]) for row in table))
        groups = grouped(table, lambda row: (row["surface"], row["beta_from_deg"]))
        title = "Sensors of Table I: RMS error of d_x (± RMS of the stated sigmas)"
        head = ("surface", "slope seen [°]", "α [°]", "whisks")
        head += tuple(f"{label_of(name)} [%]" for name in names)
        rows = tuple(_page_row(mine, names) for mine in groups.values())
        return PageTable(title, SENSORS.file, head, rows)


def _page_row(rows: Sequence[np.void], names: Sequence[str]) -> tuple[str, ...]:
    """Return the cells of a surface and range of slopes, from the rows of its sensors."""
    of_sensor = {str(row["estimator"]): row for row in rows}
    first = rows[0]
    count = max(int(row["whisks"] + row["none"]) for row in rows)
    slopes = number_range(first["beta_from_deg"], first["beta_to_deg"], 1)
    cells = [first["surface"] or MISSING, slopes, number(first["alpha_deg"], 1), str(count)]
    for name in names:
        cells.append(_error_cell(of_sensor[name]) if name in of_sensor else MISSING)
    return tuple(cells)


def _error_cell(row: np.void) -> str:
    """Return a sensor's error with its stated sigma; of how many whisks where it lacks some."""
    if not row["whisks"]:
        return MISSING
    few = f" ({row['whisks']} whisks)" if row["none"] else ""
    return f"{number(row['error_rms_percent'], 1)} ± {number(row['error_sigma_percent'], 1)}{few}"


def sensor_errors(
    results: Sequence[TrialResult], friction: Sequence[SurfaceFriction]
) -> list[SensorErrors]:
    """Return the errors over measured whisks that are sound; none without a load cell."""
    percent: dict[tuple, list[tuple[float, float, float]]] = {}
    for result, seen, felt in sound_measured_whisks(results):
        if not (felt.sensors and seen.has_truth):
            continue
        by_name = {row.estimator: row for row in (*felt.estimates, *felt.sensors)}
        middle_deg = _middle_deg(slope_deg(result, seen))
        for order, name in enumerate(_ESTIMATORS):
            key = (result.trial.surface, middle_deg, order)
            percent.setdefault(key, []).append(_error_percent(by_name[name], seen.d_x_mm))
    alphas_deg = _alphas_deg(friction)
    found = []
    for (surface, middle_deg, order), errors in sorted(percent.items()):
        alpha_deg = alphas_deg.get(surface, np.nan)
        found.append(_pooled(_ESTIMATORS[order], surface, middle_deg, alpha_deg, errors))
    return found


def _middle_deg(slope: float) -> float:
    """Return the middle of the range in which the size of a slope lies, degrees."""
    return _BETA_DEG * float(np.rint(abs(slope) / _BETA_DEG))


def _pooled(
    estimator: str,
    surface: str,
    middle_deg: float,
    alpha_deg: float,
    percent: Sequence[tuple[float, float, float]],
) -> SensorErrors:
    """Return the errors of a sensor over whisks, as `_error_percent` has each.

    middle_deg: of the range of slopes.
    """
    known, none = known_rows(percent, 3)
    errors, sigmas, inside = known.T
    return SensorErrors(
        estimator,
        surface,
        max(middle_deg - 0.5 * _BETA_DEG, 0.0),
        middle_deg + 0.5 * _BETA_DEG,
        alpha_deg,
        len(known),
        none,
        error_mean_percent=mean(errors),
        error_rms_percent=rms(errors),
        error_sigma_percent=rms(sigmas),
        inside_percent=mean(inside),
    )


def _error_percent(row: EstimateRow, truth: Value) -> tuple[float, float, float]:
    """Return error and its stated sigma, percent of the truth; 100 where the interval holds it."""
    error = row.error_percent(truth)
    return error.value, error.sigma, 100.0 * bool(row.holds(truth.value))


def _alphas_deg(friction: Iterable[SurfaceFriction]) -> dict[str, float]:
    """Return the friction angle by surface: the mean of all its speeds, as seen, else as fitted."""
    found = {}
    for surface, of_speeds in grouped(friction, lambda one: one.surface.name).items():
        found[surface] = degrees(np.mean([one.best_alpha_rad for one in of_speeds]))
    return found
