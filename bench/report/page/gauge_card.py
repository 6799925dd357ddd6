"""The gauges of a run: coefficients with U95, residuals, and the whisks that they rest on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from bench.gauges.certificate import U95
from bench.report.page.svg import Mark, Panel, legend, limits
from bench.report.page.words import Row, number, with_sigma
from bench.report.run_facts import GaugeFacts, GaugePoints

_AXES = ("m_y", "m_z")
_MOST_IN_LEGEND = 8  # trials; more have no colour of their own
_MOST_POINTS = 500  # of a panel: more hide each other


@dataclass(frozen=True)
class GaugePart:
    """The section's tables and drawings. coefficients: (row's name, its values with U95); whisks: (key of the row,
    name, turn of the follicle, points, where the moments come from, RMS residuals of m_y and m_z)."""

    source: str
    coefficients: tuple[tuple[str, ...], ...]
    whisks: tuple[tuple[str, ...], ...]
    panels: tuple[Markup, ...]
    legend: Markup | str
    left_out: bool


def gauge_part(facts: GaugeFacts | None, rows: Sequence[Row]) -> GaugePart | None:
    """What the page says of the gauges; None where there are none."""
    if facts is None:
        return None
    at = {(row.trial, row.seen.whisk): row for row in rows}
    points = [p for p in facts.points if (p.trial, p.whisk) in at]
    trials = list(dict.fromkeys(p.trial for p in points))
    coloured = len(trials) <= _MOST_IN_LEGEND
    series = {trial: n if coloured else 1 for n, trial in enumerate(trials)}
    every = 1 + sum(len(p.moments_Nmm) for p in points) // _MOST_POINTS
    return GaugePart(
        facts.source,
        tuple(
            (
                name,
                *(
                    number(v, 4) + (f" ± {U95 * s:.4f}" if s > 0 else "")
                    for v, s in zip(values, sigmas)
                ),
            )
            for name, values, sigmas in zip(
                _AXES, facts.matrix_Nmm_per_V, facts.matrix_sigma_Nmm_per_V
            )
        ),
        tuple(_whisk(p, at[p.trial, p.whisk]) for p in points),
        tuple(_panel(axis, points, series, at, every) for axis in (0, 1)) if points else (),
        legend([(trial, f"e{n}", n) for trial, n in series.items()]) if coloured and trials else "",
        every > 1,
    )


def _whisk(p: GaugePoints, row: Row) -> tuple[str, ...]:
    moments = "seen in pictures" if row.seen.deflection is not None else "set: nominal distance"
    rms = np.sqrt(np.mean(p.residuals_Nmm**2, axis=0))
    return (
        row.key,
        row.name,
        f"{p.roll_deg:g}°",
        str(len(p.moments_Nmm)),
        moments,
        *(number(v, 4) for v in rms),
    )


def _panel(axis: int, points: Sequence[GaugePoints], series: dict, at: dict, every: int) -> Markup:
    """Residuals of one moment over that moment, each point ± one sigma."""
    known = np.concatenate([p.moments_Nmm[:, axis] for p in points])
    reach = [
        v
        for p in points
        for side in (-1, 1)
        for v in (p.residuals_Nmm + side * p.moments_sigma_Nmm)[:, axis]
    ]
    panel, name = Panel(limits(known), limits(reach, (0.0, 0.0))), _AXES[axis]
    all_marks = [
        _mark(p, n, axis, series[p.trial], at) for p in points for n in range(len(p.moments_Nmm))
    ]
    marks = [panel.mark(mark) for mark in all_marks[::every]]
    alt = f"{name} by the gauges less that known, N·mm, against that known: {len(marks)} points"
    return panel.drawing(
        marks, (f"{name} known  [N·mm]", "gauge less known  [N·mm]"), f"residuals of {name}", alt
    )


def _mark(p: GaugePoints, n: int, axis: int, series: int, at: dict) -> Mark:
    x, off, sigma = (
        float(v[n, axis]) for v in (p.moments_Nmm, p.residuals_Nmm, p.moments_sigma_Nmm)
    )
    said = f"{_AXES[axis]} = {number(x, 3)} N·mm, gauge less known {with_sigma(off, sigma)}"
    title = f"{p.trial}, whisk {p.whisk}: {said}"
    key = at[p.trial, p.whisk].key
    return Mark(x, off, sigma, f"e{series}", series, key, p.trial, p.whisk, title)
