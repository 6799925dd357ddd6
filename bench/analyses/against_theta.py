"""Error and sigma of each estimator against the pushing angle θ, over the whisks of one run: table, figure, summary.

Section VII has θ small, noise has it large: where between them an estimator errs least is read off here.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bench.base.drawing import blank, colour_of, is_drawn, label_of, save, style
from bench.base.results import DRAWING, hash_of, hash_of_code
from bench.base.tables import WHISKS_KNOWN, WHISKS_WITHOUT, Column, Kind, Table
from bench.records.trial_result import TrialResult, whisks
from bench.trials.estimate_errors import is_sound
from vision.geometry.counted import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

AGAINST_THETA = Table(
    "against_theta",
    "A row an estimator and pushing angle, over the measured whisks with a truth of which nothing "
    "is doubtful.",
    (
        Column("estimator", "as in estimates.csv", Kind.TEXT),
        Column("theta_deg", "pushing angle, from 0.2° as far as strokes go"),
        WHISKS_KNOWN,
        WHISKS_WITHOUT,
        Column("error_mean_percent", "mean of estimate less truth, % of the truth"),
        Column("error_rms_percent", "RMS of estimate less truth, % of the truth"),
        Column("error_sigma_percent", "RMS of the stated sigmas, with what α_est may be off by"),
        Column(
            "error_sigma_alpha_exact_percent", "RMS of the stated sigmas, as if α_est were right"
        ),
    ),
)
FIGURE = "against_theta.png"
_FEWEST_SHARE = 0.9  # of an estimator's whisks: a θ that fewer reach is one of other whisks


@dataclass(frozen=True)
class AtTheta:
    """One estimator at one pushing angle: whisks with a distance and without, mean and RMS error, % of d_x, and the RMS
    of the stated sigmas, with what α_est may be off by and as if it were right."""

    estimator: str
    theta_deg: float
    whisks: int
    none: int
    error_mean_percent: float
    error_rms_percent: float
    error_sigma_percent: float
    error_sigma_alpha_exact_percent: float


def against_theta(results: Sequence[TrialResult]) -> list[AtTheta]:
    """Over the measured whisks of which truth and estimate are sound."""
    groups: dict[tuple[str, float], list[np.ndarray]] = {}
    for result, seen, felt in whisks(results):
        if result.trial.purpose != "measure" or not (seen.has_truth and is_sound(seen, felt)):
            continue
        for at in felt.by_theta:
            for row in at.estimates:
                sigmas = np.array([row.d_x_est_mm.sigma, row.d_x_est_sigma_alpha_exact_mm])
                error = row.d_x_est_mm.value - seen.d_x_mm.value
                percent = (
                    100.0
                    / seen.d_x_mm.value
                    * np.array([error, *np.hypot(sigmas, seen.d_x_mm.sigma)])
                )
                groups.setdefault(
                    (row.estimator, round(float(np.degrees(at.theta_rad)), 6)), []
                ).append(percent)
    return [
        _pooled(*key, np.array(found))
        for key, found in sorted(groups.items(), key=lambda item: item[0][1])
    ]


def _pooled(estimator: str, theta_deg: float, percent: np.ndarray) -> AtTheta:
    finite = percent[np.isfinite(percent).all(axis=1)]
    count = len(finite), len(percent) - len(finite)
    if not len(finite):
        return AtTheta(estimator, theta_deg, *count, *(np.nan,) * 4)
    rms = np.sqrt(np.mean(finite**2, axis=0)).tolist()
    return AtTheta(estimator, theta_deg, *count, float(finite[:, 0].mean()), *rms)


def best(rows: Sequence[AtTheta], estimator: str) -> AtTheta | None:
    """Where the estimator's RMS error is least, among the θ that nearly all of its whisks reach."""
    mine = [row for row in rows if row.estimator == estimator and row.whisks]
    most = max((row.whisks for row in mine), default=0)
    return min(
        (row for row in mine if row.whisks >= _FEWEST_SHARE * most),
        key=lambda row: row.error_rms_percent,
        default=None,
    )


def theta_lines(rows: Sequence[AtTheta], theta_deg: float) -> Iterator[str]:
    """A line an estimator: the θ of least error, and the error where the run's own θ is."""
    for name in dict.fromkeys(row.estimator for row in rows):
        least = best(rows, name)
        if least is None:
            continue
        here = [
            row
            for row in rows
            if row.estimator == name and row.theta_deg == theta_deg and row.whisks
        ]
        beside = (
            f"; at {theta_deg:g}° {here[0].error_rms_percent:.2f} %"
            if here and here[0] != least
            else ""
        )
        yield (
            f"{label_of(name)}: least error at θ = {least.theta_deg:g}°, {least.error_rms_percent:.2f} % RMS over "
            f"{counted(least.whisks, 'whisk')}, {least.error_sigma_percent:.2f} % stated{beside}"
        )


def write_against_theta(
    out: Path, results: Sequence[TrialResult], *, drawn: bool = True
) -> tuple[list[AtTheta], list[str]]:
    """Table, and the figure where it is to be `drawn`; the rows, and the figure's name where there is one."""
    rows = against_theta(results)
    AGAINST_THETA.write(out, map(vars, rows))
    if not drawn or not any(row.whisks for row in rows):
        return rows, []
    stamp = hash_of([vars(row) for row in rows], hash_of_code(DRAWING))
    if not is_drawn(out / FIGURE, stamp):
        with style():
            save(figure(rows), out / FIGURE, stamp)
    return rows, [FIGURE]


def figure(rows: Sequence[AtTheta]) -> "Figure":
    """RMS error solid, stated sigma dashed, as if α_est were right dotted; a ring where the error is least."""
    drawing = blank(5.6, 4.8)
    axes = drawing.subplots()
    for number, name in enumerate(dict.fromkeys(row.estimator for row in rows)):
        mine, colour = (
            [row for row in rows if row.estimator == name and row.whisks],
            colour_of(name, number),
        )
        theta = [row.theta_deg for row in mine]
        axes.plot(
            theta,
            [row.error_rms_percent for row in mine],
            "o-",
            ms=3.5,
            color=colour,
            label=label_of(name),
        )
        axes.plot(theta, [row.error_sigma_percent for row in mine], "--", lw=1.0, color=colour)
        axes.plot(
            theta, [row.error_sigma_alpha_exact_percent for row in mine], ":", lw=1.0, color=colour
        )
        least = best(rows, name)
        if least is not None:
            axes.plot(least.theta_deg, least.error_rms_percent, "o", ms=9, mfc="none", mec=colour)
    axes.plot([], [], "--", lw=1.0, color="0.4", label="stated sigma")
    axes.plot([], [], ":", lw=1.0, color="0.4", label="sigma, α$_{est}$ exact")
    axes.plot([], [], "o", ms=9, mfc="none", mec="0.4", label="least error")
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="pushing angle θ  [°]",
        ylabel="error of d$_x$, its sigma  [%]",
    )
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter("")
    axes.set_xticks(
        [t for t in (0.2, 0.5, 1, 2, 3, 5, 10, 20) if t <= max(row.theta_deg for row in rows)]
    )
    axes.grid(alpha=0.25, which="major")
    _legend(drawing, axes)
    return drawing


def _legend(drawing: "Figure", axes: "Axes", styles: int = 3) -> None:
    """A column of estimators, and one of what the last lines, the `styles`, stand for; the shorter one is filled up."""
    entries = list(zip(*axes.get_legend_handles_labels()))
    columns, nothing = (entries[:-styles], entries[-styles:]), (axes.plot([], [], " ")[0], "")
    most = max(map(len, columns))
    filled = [entry for column in columns for entry in [*column, *[nothing] * (most - len(column))]]
    drawing.legend(*zip(*filled), loc="outside lower center", ncols=2)
