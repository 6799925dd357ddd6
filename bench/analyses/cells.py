"""Cells of rows: of the tables of a run, in their columns' units, and of the tables of the page."""

import numpy as np

from bench.base.numbers import MISSING, with_sigma
from bench.base.tables import sigma_name
from bench.records.trial_result import TrialResult
from vision import Value


def value_cells(column: str, value: Value) -> dict[str, float]:
    """Return the cells of a value and of its standard deviation; of an angle, in rad, the degrees."""
    shown = value.in_degrees() if column.endswith("_deg") else value
    return {column: float(shown.value), sigma_name(column): float(shown.sigma)}


def whisk_cells(result: TrialResult, whisk: int) -> dict:
    """Return the cells by which tables name a whisk; a table takes those that it has columns for."""
    trial = result.trial
    return {
        "trial": trial.name,
        "whisk": whisk,
        "surface": trial.surface,
        "speed_deg_s": trial.speed_deg_s,
    }


def as_cell(is_inside: bool | None) -> int | None:
    """Return the cell of whether an interval holds the truth; empty where that is not known."""
    return None if is_inside is None else int(is_inside)


def angle_text(angle: Value) -> str:
    """Return an angle, rad, with its sigma in degrees; a dash where it is not known."""
    shown = angle.in_degrees()
    return f"{shown.value:.2f} ± {shown.sigma:.2f}°" if angle.is_known else "-"


def panel_title(surface: str, speed_deg_s: float | None) -> str:
    """Return surface and speed in words."""
    name = surface or "surface not named"
    return name if speed_deg_s is None else f"{name}, {speed_deg_s:g}°/s"


def panel_cell(row: np.void) -> str:
    """Return surface and speed of a row."""
    speed = f", {row['speed_deg_s']:g}°/s" if np.isfinite(row["speed_deg_s"]) else ""
    return (row["surface"] or MISSING) + speed


def cell_with_sigma(row: np.void, stem: str, unit: str) -> str:
    """Return the value of two columns, such as d_x_mm and d_x_sigma_mm, with its sigma."""
    return with_sigma(row[f"{stem}_{unit}"], row[f"{stem}_sigma_{unit}"])
