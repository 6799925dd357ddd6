"""The gauges of a run: coefficients with U95, and the whisks that they rest on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.gauges.certificate import U95
from bench.gauges.gauge_readings import source_of
from bench.report.page.words import WhiskRow, by_whisk, number
from bench.report.run_facts import GaugeFacts, GaugePoints


@dataclass(frozen=True)
class GaugePart:
    """The section on gauges.

    coefficients: (name of the row, its values with U95). whisks: (key of the row, name, turn of the
    follicle, points, where the moments come from, RMS residuals of m_y and m_z, N·mm).
    """

    source: str
    coefficients: tuple[tuple[str, ...], ...]
    whisks: tuple[tuple[str, ...], ...]


def gauge_part(facts: GaugeFacts | None, rows: Sequence[WhiskRow]) -> GaugePart | None:
    """Return what the page says of the gauges; None where there are none."""
    if facts is None:
        return None
    row_of = by_whisk(rows)
    table = []
    for points in facts.points:
        row = row_of.get((points.trial, points.whisk))
        if row is not None:
            table.append(_whisk(points, row))
    return GaugePart(facts.source, _coefficients(facts), tuple(table))


def _coefficients(facts: GaugeFacts) -> tuple[tuple[str, ...], ...]:
    """Return a row for each moment: its name, and the coefficient of each channel with U95."""
    table = []
    for name, values, sigmas in zip(
        ("m_y", "m_z"), facts.matrix_Nmm_per_V, facts.matrix_sigma_Nmm_per_V
    ):
        row = [name]
        for value, sigma in zip(values, sigmas):
            uncertainty = f" ± {U95 * sigma:.4f}" if sigma > 0 else ""
            row.append(number(value, 4) + uncertainty)
        table.append(tuple(row))
    return tuple(table)


def _whisk(points: GaugePoints, row: WhiskRow) -> tuple[str, ...]:
    """Return the row of a whisk that calibrated."""
    source = source_of(row.seen)
    rms_y, rms_z = np.sqrt(np.mean(points.residuals_Nmm**2, axis=0))
    turn = f"{points.roll_deg:g}°"
    count = str(len(points.moments_Nmm))
    return row.key, row.name, turn, count, source, number(rms_y, 4), number(rms_z, 4)
