"""Cells that several tables of the page have, made from rows of the run's tables."""

import numpy as np

from bench.base.numbers import MISSING, with_sigma


def panel_cell(row: np.void) -> str:
    """Return surface and speed of a row."""
    speed = f", {row['speed_deg_s']:g}°/s" if np.isfinite(row["speed_deg_s"]) else ""
    return (row["surface"] or MISSING) + speed


def cell_with_sigma(row: np.void, stem: str, unit: str) -> str:
    """Return the value of two columns, such as d_x_mm and d_x_sigma_mm, with its sigma."""
    return with_sigma(row[f"{stem}_{unit}"], row[f"{stem}_sigma_{unit}"])
