"""Error and sigma of each estimator against the pushing angle θ, over the whisks of one run.

Section VII has θ small, noise has it large: where between them an estimator errs least is read off here.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun, Heading
from bench.analyses.pooling import column, grouped, known_rows, mean, rms, sound_measured_whisks
from bench.base.drawing import blank, colour_of, label_logarithmic, label_of, nested_size
from bench.base.tables import WHISKS_KNOWN, WHISKS_WITHOUT, Column, Kind, Table
from bench.records.trial_result import EstimateRow, TrialResult
from vision import Value
from vision.geometry import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

AGAINST_THETA = Table(
    "against_theta",
    "A row an estimator and pushing angle, over the measured whisks with a truth and no warning.",
    (
        Column("estimator", "as in estimates.csv", Kind.TEXT),
        Column("theta_deg", "pushing angle, from 0.2° as far as strokes go"),
        WHISKS_KNOWN,
        WHISKS_WITHOUT,
        Column("error_mean_percent", "mean error, % of the truth"),
        Column("error_rms_percent", "RMS error, % of the truth"),
        Column("error_sigma_percent", "RMS of the stated sigmas, with what α_est may be off by"),
        Column(
            "error_sigma_alpha_exact_percent", "RMS of the stated sigmas, as if α_est were right"
        ),
    ),
)
# [share] Of an estimator's whisks: a θ that fewer reach is one of other whisks.
_FEWEST_SHARE = 0.9
# Lines that the legend explains by what they stand for: see `_explain_lines`.
_STYLES = 3
# [°] Labels of the logarithmic axis, as many as stand apart.
_TICKS_DEG = (0.2, 0.5, 1, 2, 3, 5, 10, 20)


@dataclass(frozen=True)
class AtTheta:
    """Errors of one estimator at one pushing angle: the columns of AGAINST_THETA."""

    estimator: str
    theta_deg: float
    whisks: int
    none: int
    error_mean_percent: float
    error_rms_percent: float
    error_sigma_percent: float
    error_sigma_alpha_exact_percent: float


@dataclass(frozen=True)
class ThetaErrors:
    """Errors at all pushing angles; theta_deg: the run's own pushing angle."""

    at: tuple[AtTheta, ...]
    theta_deg: float


class AgainstTheta(Analysis):
    """At which pushing angle an estimator errs least."""

    tables = (AGAINST_THETA,)
    heading = Heading("against_theta", "Error and sigma against θ (against_theta.csv)")
    figure_name = "against_theta"
    figure_title = "Error and sigma against θ"
    figure_caption = "RMS over the sound whisks: solid the error, dashed the stated sigma. Small θ: noise; large: bending."

    def compute(self, run: EvaluatedRun) -> ThetaErrors:
        """Return the errors of every estimator at every pushing angle."""
        return ThetaErrors(tuple(against_theta(run.results)), run.settings.theta_deg)

    def rows(self, found: ThetaErrors) -> dict[Table, list[dict]]:
        """Return a row an estimator and pushing angle."""
        return {AGAINST_THETA: [vars(one) for one in found.at]}

    def lines(self, found: ThetaErrors) -> Iterator[str]:
        """Yield a line an estimator: the θ of least error, and the error where the run's θ is."""
        for name, mine in grouped(found.at, lambda one: one.estimator).items():
            least = least_error(mine)
            if least is None:
                continue
            at_own_theta = ""
            for one in mine:
                if one.theta_deg == found.theta_deg and one.whisks and one != least:
                    at_own_theta = f"; at {found.theta_deg:g}° {one.error_rms_percent:.2f} %"
            yield (
                f"{label_of(name)}: least error at θ = {least.theta_deg:g}°, "
                f"{least.error_rms_percent:.2f} % RMS over {counted(least.whisks, 'whisk')}, "
                f"{least.error_sigma_percent:.2f} % stated{at_own_theta}"
            )

    def figure(self, found: ThetaErrors) -> "Figure | None":
        """Draw RMS error solid, stated sigma dashed, sigma as if α_est were right dotted.

        A ring stands where the error is least.
        """
        if not any(one.whisks for one in found.at):
            return None
        return _draw(found.at)


def against_theta(results: Sequence[TrialResult]) -> list[AtTheta]:
    """Return the errors at each pushing angle, over measured whisks that are sound, seen and felt."""
    percent: dict[tuple[str, float], list[np.ndarray]] = {}
    for _, seen, felt in sound_measured_whisks(results):
        if not seen.has_truth:
            continue
        for at in felt.by_theta:
            theta_deg = round(math.degrees(at.theta_rad), 6)
            for row in at.estimates:
                errors = _errors_percent(row, seen.d_x_mm)
                percent.setdefault((row.estimator, theta_deg), []).append(errors)
    in_order = sorted(percent, key=lambda key: key[1])
    return [_pooled(*key, percent[key]) for key in in_order]


def _errors_percent(row: EstimateRow, truth: Value) -> np.ndarray:
    """Return error, its sigma, and that as if α_est were right (3,), percent of the truth."""
    error = row.error_percent(truth)
    exact_mm = np.hypot(row.d_x_est_sigma_alpha_exact_mm, truth.sigma)
    return np.array([error.value, error.sigma, 100.0 * exact_mm / truth.value])


def _pooled(estimator: str, theta_deg: float, percent: Sequence[np.ndarray]) -> AtTheta:
    """Return the errors of one estimator and θ by those of its whisks, percent (n, 3)."""
    known, none = known_rows(percent, 3)
    return AtTheta(estimator, theta_deg, len(known), none, mean(known[:, 0]), *map(rms, known.T))


def least_error(rows: Sequence[AtTheta]) -> AtTheta | None:
    """Return where one estimator's RMS error is least, of the θ that nearly all its whisks reach."""
    most = max(row.whisks for row in rows)
    reached = [row for row in rows if row.whisks and row.whisks >= _FEWEST_SHARE * most]
    return min(reached, key=lambda row: row.error_rms_percent, default=None)


def _draw(rows: Sequence[AtTheta]) -> "Figure":
    """Draw the lines of all estimators, and what kinds of lines mean."""
    drawing = blank(5.6, 4.8)
    axes = drawing.subplots()
    of_estimators = grouped(rows, lambda row: row.estimator)
    for number, (name, mine) in enumerate(of_estimators.items()):
        rim_points = nested_size(number, len(of_estimators), least=0.0, step=1.3)
        _draw_estimator(axes, mine, label_of(name), colour_of(name, number), rim_points)
    _explain_lines(axes)
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="pushing angle θ  [°]",
        ylabel="error of d$_x$, its sigma  [%]",
    )
    label_logarithmic(axes.yaxis)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("")
    farthest_deg = max(row.theta_deg for row in rows)
    axes.set_xticks([tick for tick in _TICKS_DEG if tick <= farthest_deg])
    axes.grid(alpha=0.25, which="major")
    _add_legend(drawing, axes)
    return drawing


def _explain_lines(axes: "Axes") -> None:
    """Add to the legend what kinds of lines and the ring mean."""
    axes.plot([], [], "--", lw=1.0, color="0.4", label="stated sigma")
    axes.plot([], [], ":", lw=1.0, color="0.4", label="sigma, α$_{est}$ exact")
    axes.plot([], [], "o", ms=9, mfc="none", mec="0.4", label="least error")


def _draw_estimator(
    axes: "Axes", rows: Sequence[AtTheta], label: str, colour: str, rim_points: float
) -> None:
    """Draw error and sigmas of one estimator over θ, with a ring where the error is least.

    rim_points: by how much its lines are wider than those that are drawn last.
    """
    known = [row for row in rows if row.whisks]
    theta_deg = column(known, "theta_deg")
    errors = column(known, "error_rms_percent")
    width = 1.2 + rim_points
    axes.plot(theta_deg, errors, "o-", lw=width, ms=3.5 + rim_points, color=colour, label=label)
    for name, line in (
        ("error_sigma_percent", "--"),
        ("error_sigma_alpha_exact_percent", ":"),
    ):
        axes.plot(theta_deg, column(known, name), line, lw=1.0 + rim_points, color=colour)
    least = least_error(rows)
    if least is not None:
        size = 9 + 1.5 * rim_points
        axes.plot(least.theta_deg, least.error_rms_percent, "o", ms=size, mfc="none", mec=colour)


def _add_legend(drawing: "Figure", axes: "Axes") -> None:
    """Add a column of estimators, and one of what the last lines, `_STYLES` of them, stand for.

    The shorter column is filled up with empty entries.
    """
    entries = list(zip(*axes.get_legend_handles_labels()))
    empty = (axes.plot([], [], " ")[0], "")
    estimators = entries[:-_STYLES]
    meanings = entries[-_STYLES:]
    missing = len(estimators) - len(meanings)
    filled = [*estimators, *[empty] * -missing, *meanings, *[empty] * missing]
    drawing.legend(*zip(*filled), loc="outside lower center", ncols=2)
