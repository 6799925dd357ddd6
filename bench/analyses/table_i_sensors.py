"""What each sensor of Table I is worth on a session's own trials, by slope and friction: sensors.csv, summary lines.

Only where a load cell was recorded: then each whisk is judged by all of them.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.analyses.friction_tables import SurfaceFriction
from bench.base.drawing import label_of
from bench.base.tables import SURFACE, WHISKS_KNOWN, WHISKS_WITHOUT, Column, Kind, Table, alike
from bench.records.trial_result import EstimateRow, TrialResult, whisks
from bench.trials.estimate_errors import is_sound, slope_deg
from vision.geometry.counted import counted
from vision.truth.value import Value

SENSORS = Table(
    "sensors",
    "A row a sensor, surface and range of slopes, over the measured whisks with a truth of which "
    "nothing is doubtful; none without a load cell ([sensors.md](sensors.md)).",
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
        Column("error_mean_percent", "mean of estimate less truth, % of the truth"),
        Column("error_rms_percent", "RMS of estimate less truth, % of the truth"),
        Column("error_sigma_percent", "RMS of the stated sigmas, % of the truth"),
        Column("inside_percent", "how many of the 95 % intervals hold the truth"),
    ),
)
_ASKED = ("touch_alone", "no_slip", "moment_rate", "with_friction", "force_and_moment")
_BETA_DEG = 15.0  # °: slopes of one row, of the paper's steps of 5° three; 0, 15, 30 … lie in the middles of theirs


@dataclass(frozen=True)
class SensorWorth:
    """One sensor's estimator over the whisks of one surface within a range of slopes; alpha_deg: of that surface, as
    seen, else as fitted. none: whisks without a distance; inside_percent: of the 95 % intervals, how many hold."""

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


def sensors_worth(
    results: Sequence[TrialResult], friction: Sequence[SurfaceFriction]
) -> list[SensorWorth]:
    """Over the measured whisks of which truth and estimate are sound; empty where no load cell was recorded."""
    groups: dict[tuple, list[np.ndarray]] = {}
    for result, seen, felt in whisks(results):
        if result.trial.purpose != "measure" or not (
            felt.sensors and seen.has_truth and is_sound(seen, felt)
        ):
            continue
        said = {row.estimator: row for row in (*felt.estimates, *felt.sensors)}
        middle = float(np.rint(abs(slope_deg(result, seen)) / _BETA_DEG) * _BETA_DEG)
        for name in _ASKED:
            groups.setdefault((result.trial.surface, middle, name), []).append(
                _judged(said[name], seen.d_x_mm)
            )
    alphas = _alphas_deg(friction)
    return [
        _pooled(name, surface, middle, alphas.get(surface, np.nan), np.array(found))
        for (surface, middle, name), found in sorted(groups.items(), key=_in_order)
    ]


def _in_order(item: tuple) -> tuple:
    surface, middle, name = item[0]
    return surface, middle, _ASKED.index(name)


def _judged(row: EstimateRow, truth: Value) -> np.ndarray:
    """Error and its stated sigma, % of the truth, and whether the interval holds it (3,)."""
    error, sigma = row.d_x_est_mm.value - truth.value, np.hypot(row.d_x_est_mm.sigma, truth.sigma)
    return 100.0 * np.array(
        [error / truth.value, sigma / truth.value, bool(row.holds(truth.value))]
    )


def _alphas_deg(friction: Iterable[SurfaceFriction]) -> dict[str, float]:
    """Friction angle by surface: of all its speeds the mean, as seen, else as fitted."""
    found: dict[str, list[float]] = {}
    for one in friction:
        seen = one.alpha("seen")[0]
        found.setdefault(one.surface.name, []).append(
            seen if np.isfinite(seen) else one.alpha("least_squares")[0]
        )
    return {surface: float(np.degrees(np.mean(alphas))) for surface, alphas in found.items()}


def _pooled(
    name: str, surface: str, middle: float, alpha_deg: float, percent: np.ndarray
) -> SensorWorth:
    known = percent[np.isfinite(percent).all(axis=1)]
    slopes = max(middle - 0.5 * _BETA_DEG, 0.0), middle + 0.5 * _BETA_DEG
    place = name, surface, *slopes, alpha_deg, len(known), len(percent) - len(known)
    if not len(known):
        return SensorWorth(*place, *(np.nan,) * 4)
    rms = np.sqrt(np.mean(known[:, :2] ** 2, axis=0)).tolist()
    return SensorWorth(*place, float(known[:, 0].mean()), *rms, float(known[:, 2].mean()))


def write_sensors(out: Path, worth: Sequence[SensorWorth]) -> None:
    """Write sensors.csv."""
    SENSORS.write(out, map(vars, worth))


def sensor_lines(worth: Sequence[SensorWorth]) -> Iterator[str]:
    """For the summary: a line a surface and range of slopes."""
    for surface, slope in dict.fromkeys((one.surface, one.beta_from_deg) for one in worth):
        mine = [one for one in worth if (one.surface, one.beta_from_deg) == (surface, slope)]
        alpha = f", α {mine[0].alpha_deg:.1f}°" if np.isfinite(mine[0].alpha_deg) else ""
        said = ", ".join(f"{label_of(one.estimator)} {_percent(one)}" for one in mine)
        many = counted(max(one.whisks + one.none for one in mine), "whisk")
        yield f"{surface or 'whisks'}, β {slope:g} to {mine[0].beta_to_deg:g}°{alpha} ({many}): {said}"


def _percent(one: SensorWorth) -> str:
    return f"{one.error_rms_percent:.2g} %" if one.whisks else "none"
