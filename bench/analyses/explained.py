"""Where the error of (10) comes from: explained.csv.

(10) is taken again with what was felt or assumed replaced by what was seen, one thing at a time, in this order: touch,
moments, friction angle. Each share is the change of d_x that its replacement makes, with the sign that it has in the
error; what remains is beam theory and slip along the whisker. Where the truth is a stage's, which sees neither touch
nor moments, the friction angle alone is replaced, by the one fitted to the surface's other whisks; touch and moments
are in the remainder.
"""

from collections.abc import Iterable, Iterator, Sequence
from operator import itemgetter
from typing import TYPE_CHECKING

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun
from bench.analyses.cells import value_cells
from bench.analyses.estimates_again import FITTED
from bench.analyses.pooling import known_rows
from bench.base.drawing import blank
from bench.base.tables import TRIAL, WHISK, Column, Table, with_sigma
from bench.gauges.gauge_readings import reference_from_pictures
from bench.records.trial_result import (
    WITH_FRICTION,
    EstimateRow,
    FeltWhisk,
    SeenWhisk,
    TrialResult,
    whisks,
)
from bench.session.whisker import Whisker
from bench.trials.estimate_errors import sound_whisks
from estimator.distance import with_friction

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHARES = ("by_touch_mm", "by_moments_mm", "by_alpha_mm", "remainder_mm")
EXPLAINED = Table(
    "explained",
    "A row a whisk with truth and estimate by (10): its error in parts; the last row is their mean.",
    (
        TRIAL,
        WHISK,
        Column("d_x_mm", "distance: the truth"),
        *with_sigma("alpha_seen_deg", "friction angle, seen"),
        Column("error_mm", "of (10): the sum of the next four"),
        Column("by_touch_mm", "what it changes by when touch felt becomes touch seen"),
        Column("by_moments_mm", "and when then the moments felt become those of the shape seen"),
        Column("by_alpha_mm", "and when then α_est becomes α seen; by a stage, α fitted"),
        Column("remainder_mm", "beam theory, slip along the whisker; by a stage all else"),
    ),
)
TOTAL = "mean"
_LABELS = {
    "by_touch_mm": ("touch felt → seen", "#80b1d3"),
    "by_moments_mm": ("moments felt → seen", "#fdb462"),
    "by_alpha_mm": ("α$_{est}$ → α seen", "#b3de69"),
    "remainder_mm": ("beam theory, slip along", "#bbbbbb"),
}
_MOST_NAMED = 40  # whisks; more bars than that have no room for a name each


class Explained(Analysis):
    """Which part of (10)'s error is touch, moments, friction angle, and which is theory."""

    tables = (EXPLAINED,)
    figure_name = "explained"
    figure_title = "The error of (10) explained"
    figure_caption = (
        "In per cent of d_x: what the error changes by when felt touch, moments and α_est become "
        "those seen, in this order."
    )

    def compute(self, run: EvaluatedRun) -> list[dict]:
        """Return a row a whisk, and last the mean over those without a warning."""
        rows = list(explained_rows(run.results, run.whisker))
        if not rows:
            return []
        sound = sound_whisks(run.results)
        return [*rows, mean_row([row for row in rows if (row["trial"], row["whisk"]) in sound])]

    def row(self, one: dict) -> dict:
        """Return a row as it is."""
        return one

    def figure(self, found: Sequence[dict]) -> "Figure | None":
        """Draw a bar a whisk, the mean last, in percent of the true d_x.

        Shares are stacked away from zero to either side; a mark stands at their sum, the error.
        """
        if not found:
            return None
        count = len(found)
        drawing = blank(float(np.clip(2.5 + 0.45 * count, 5.5, 16.0)), 4.2)
        axes = drawing.subplots()
        place = np.arange(count, dtype=float)
        place[-1] += 0.5
        _stack_shares(axes, place, found)
        axes.plot(place, _percent(found, "error_mm"), "k_", ms=9, mew=1.6, label="error of (10)")
        axes.axhline(0.0, color="0.3", lw=0.8)
        axes.set(
            ylabel="share of the error of d$_x$  [%]",
            title="Replaced in this order: touch, moments, friction angle",
        )
        if count <= _MOST_NAMED:
            axes.set_xticks(
                place, [_bar_name(row) for row in found], rotation=60, ha="right", fontsize=7
            )
        else:
            axes.set_xticks([place[-1]], [TOTAL], fontsize=7)
        drawing.legend(loc="outside lower center", ncols=3)
        return drawing


def _stack_shares(axes: "Axes", place: np.ndarray, rows: Sequence[dict]) -> None:
    """Draw each whisk's shares as bars at its place (n,), stacked away from zero to either side."""
    top = np.zeros(len(rows))
    bottom = np.zeros(len(rows))
    for name, (label, colour) in _LABELS.items():
        share = np.nan_to_num(_percent(rows, name))
        start = np.where(share > 0, top, bottom)
        axes.bar(place, share, bottom=start, color=colour, label=label, width=0.75)
        top += np.maximum(share, 0.0)
        bottom += np.minimum(share, 0.0)


def explained_rows(results: Iterable[TrialResult], whisker: Whisker) -> Iterator[dict]:
    """Yield the rows of whisks with truth and estimate; cells that cannot be known are NaN."""
    for result, seen, felt in whisks(results):
        ten = felt.estimate(WITH_FRICTION)
        if ten is None or not seen.has_truth:
            continue
        alpha_rad = seen.friction_rad.value
        shares = _shares_by_fit(seen, felt, ten)
        if seen.deflection is not None:
            shares = _shares(result, seen, felt, ten, alpha_rad, whisker)
        yield {
            "trial": result.trial.name,
            "whisk": seen.whisk,
            **value_cells("alpha_seen_deg", seen.friction_rad),
            **shares,
        }


def _shares_by_fit(seen: SeenWhisk, felt: FeltWhisk, ten: EstimateRow) -> dict:
    """Return the error of (10) and its change by the fitted friction angle, mm; no share is seen."""
    truth = seen.d_x_mm.value
    d_x = ten.d_x_est_mm.value
    fitted = felt.estimate(FITTED)
    d_x_alpha = np.nan if fitted is None else fitted.d_x_est_mm.value
    return {
        "d_x_mm": truth,
        "error_mm": d_x - truth,
        "by_touch_mm": np.nan,
        "by_moments_mm": np.nan,
        "by_alpha_mm": d_x - d_x_alpha,
        "remainder_mm": d_x_alpha - truth,
    }


def _shares(
    result: TrialResult,
    seen: SeenWhisk,
    felt: FeltWhisk,
    ten: EstimateRow,
    alpha_seen_rad: float,
    whisker: Whisker,
) -> dict:
    """Return the error of (10) and the change of d_x by each replacement, mm."""
    theta = result.theta_rad
    theta_seen = theta + felt.touch_felt_rad.value - seen.touch_rad.value
    alpha_est = ten.alpha_est_rad
    alpha = max(alpha_seen_rad if np.isfinite(alpha_seen_rad) else alpha_est, 0.0)
    m_felt = (felt.m_y_Nmm.value, felt.m_z_Nmm.value)
    m_seen = _moments_seen(seen, theta_seen, whisker)
    d_x = by_10(theta, *m_felt, alpha_est, whisker)
    d_x_touch = by_10(theta_seen, *m_felt, alpha_est, whisker)
    d_x_moments = by_10(theta_seen, *m_seen, alpha_est, whisker)
    d_x_alpha = by_10(theta_seen, *m_seen, alpha, whisker)
    truth = seen.d_x_mm.value
    return {
        "d_x_mm": truth,
        "error_mm": d_x - truth,
        "by_touch_mm": d_x - d_x_touch,
        "by_moments_mm": d_x_touch - d_x_moments,
        "by_alpha_mm": d_x_moments - d_x_alpha,
        "remainder_mm": d_x_alpha - truth,
    }


def by_10(
    theta_rad: float | np.ndarray,
    m_y_Nmm: float | np.ndarray,
    m_z_Nmm: float | np.ndarray,
    alpha_rad: float | np.ndarray,
    whisker: Whisker,
) -> float | np.ndarray:
    """Return d_x of (10), mm, for arrays or floats."""
    beam = whisker.beam
    return beam.distance_mm(with_friction(theta_rad, m_y_Nmm, m_z_Nmm, alpha_rad, beam.C_Nmm2))


def _moments_seen(seen: SeenWhisk, theta_rad: float, whisker: Whisker) -> tuple[float, float]:
    """Return (m_y, m_z) of the exact rod through the contact seen, at a pushing angle.

    Moments per angle are interpolated between the frames.
    """
    reference = reference_from_pictures(seen, whisker)
    if reference is None:
        return np.nan, np.nan
    per_angle = reference.moments / reference.theta_rad[:, None]  # (frames, 2) N·mm/rad
    m_y = theta_rad * float(np.interp(theta_rad, reference.theta_rad, per_angle[:, 0]))
    m_z = theta_rad * float(np.interp(theta_rad, reference.theta_rad, per_angle[:, 1]))
    return m_y, m_z


def mean_row(rows: Sequence[dict]) -> dict:
    """Return mean error and mean shares over the whisks for which all are known.

    Shares keep their signs, so they add up. A share that is known of none of them has no mean.
    """
    shares = []
    for name in SHARES:
        if np.isfinite([row[name] for row in rows]).any():
            shares.append(name)
    names = ("d_x_mm", "error_mm", *shares)
    complete, _ = known_rows(map(itemgetter(*names), rows), len(names))
    means = complete.mean(axis=0).tolist() if len(complete) else []
    return {"trial": TOTAL, **dict(zip(names, means))}


def _bar_name(row: dict) -> str:
    """Return the name of a bar: the trial, and the whisk where it is not the first."""
    return f"{row['trial']} {row['whisk']}" if row.get("whisk") else row["trial"]


def _percent(rows: Sequence[dict], name: str) -> np.ndarray:
    """Return a column in percent of the true distance."""
    return np.array([100.0 * row.get(name, np.nan) / row.get("d_x_mm", np.nan) for row in rows])
