"""Where the error of (10) comes from: explained.csv, assembled from the results.

(10) is taken again with what was felt or assumed replaced by what was seen, one thing at a time, in this order: touch,
moments, friction angle. Each share is the change of d_x that its replacement makes, with the sign that it has in the
error; what remains is beam theory and slip along the whisker.
"""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bench.analyses.alphas import seen_friction
from bench.base.drawing import blank, is_drawn, save, style
from bench.base.results import hash_of
from bench.base.tables import TRIAL, WHISK, Column, Table, with_sigma
from bench.gauges.gauge_readings import reference_from_pictures
from bench.records.trial_result import EstimateRow, FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.session.whisker import Whisker
from bench.trials.estimate_errors import sound_whisks
from estimator.distance import with_friction

if TYPE_CHECKING:
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
        Column("by_alpha_mm", "and when then α_est becomes α seen"),
        Column("remainder_mm", "beam theory, and slip along the whisker"),
    ),
)
TOTAL = "mean"
_LOOK = {
    "by_touch_mm": ("touch felt → seen", "#80b1d3"),
    "by_moments_mm": ("moments felt → seen", "#fdb462"),
    "by_alpha_mm": ("α$_{est}$ → α seen", "#b3de69"),
    "remainder_mm": ("beam theory, slip along", "#bbbbbb"),
}
_MOST_NAMED = 40  # whisks; more bars than that have no room for a name each


def write_explained(
    out: Path, results: Iterable[TrialResult], whisker: Whisker, *, drawn: bool = True
) -> list[str]:
    """explained.csv: a row for each whisk that has a truth and an estimate by (10), and the mean of those of which
    nothing is doubtful; its bar chart, where it is to be `drawn`. Names of the pictures.
    """
    results = list(results)
    rows = list(explained_rows(results, whisker))
    sound = sound_whisks(results)
    total = (
        [mean_row([row for row in rows if (row["trial"], row["whisk"]) in sound])] if rows else []
    )
    EXPLAINED.write(out, [*rows, *total])
    if not rows or not drawn:
        return []
    path, stamp = out / "explained.png", hash_of(rows, _LOOK)
    if not is_drawn(path, stamp):
        with style():
            save(draw_explained([*rows, *total]), path, stamp)
    return [path.name]


def explained_rows(results: Iterable[TrialResult], whisker: Whisker) -> Iterator[dict]:
    """Rows by column; cells that cannot be known are NaN."""
    for result, seen, felt in whisks(results):
        answer = next((a for a in felt.estimates if a.estimator == "with_friction"), None)
        if answer is None or seen.deflection is None:
            continue
        alpha, sigma = seen_friction(seen)
        row = {"trial": result.trial.name, "whisk": seen.whisk}
        row |= {
            "alpha_seen_deg": float(np.degrees(alpha)),
            "alpha_seen_sigma_deg": float(np.degrees(sigma)),
        }
        yield row | _shares(result, seen, felt, answer, alpha, whisker)


def _shares(
    result: TrialResult,
    seen: SeenWhisk,
    felt: FeltWhisk,
    answer: EstimateRow,
    alpha_seen: float,
    whisker: Whisker,
) -> dict:
    """The error of (10) and what each replacement changes, mm."""
    theta, alpha_est = np.radians(result.theta_deg), answer.alpha_est_rad
    late = felt.touch_felt_rad.value - seen.touch_rad.value
    m_felt = (felt.m_y_Nmm.value, felt.m_z_Nmm.value)
    m_seen = _moments_seen(seen, theta + late, whisker)
    alpha_used = alpha_seen if np.isfinite(alpha_seen) else alpha_est
    steps = [
        (theta, m_felt, alpha_est),
        (theta + late, m_felt, alpha_est),
        (theta + late, m_seen, alpha_est),
    ]
    steps.append((theta + late, m_seen, max(alpha_used, 0.0)))
    d_x = [by_10(t, *m, a, whisker) for t, m, a in steps]
    truth = seen.d_x_mm.value
    by = {
        name: d_x[k] - d_x[k + 1]
        for k, name in enumerate(("by_touch_mm", "by_moments_mm", "by_alpha_mm"))
    }
    return {"d_x_mm": truth, "error_mm": d_x[0] - truth, **by, "remainder_mm": d_x[3] - truth}


def by_10(
    theta_rad: float | np.ndarray,
    m_y_Nmm: float | np.ndarray,
    m_z_Nmm: float | np.ndarray,
    alpha_rad: float | np.ndarray,
    whisker: Whisker,
) -> float | np.ndarray:
    """d_x of (10), mm; arrays or floats."""
    beam = whisker.beam
    return beam.distance_mm(with_friction(theta_rad, m_y_Nmm, m_z_Nmm, alpha_rad, beam.C_Nmm2))


def _moments_seen(seen: SeenWhisk, theta: float, whisker: Whisker) -> tuple[float, float]:
    """(m_y, m_z) of the exact rod through the contact seen, at a pushing angle: per angle, between the frames."""
    reference = reference_from_pictures(seen, whisker)
    if reference is None:
        return float("nan"), float("nan")
    per_angle = reference.moments / reference.theta_rad[:, None]
    m_y, m_z = (
        theta * float(np.interp(theta, reference.theta_rad, column)) for column in per_angle.T
    )
    return m_y, m_z


def mean_row(rows: Sequence[dict]) -> dict:
    """Mean error and mean shares over the whisks for which all are known; shares keep their signs, so they add up."""
    names = ("d_x_mm", "error_mm", *SHARES)
    values = np.array([[row[name] for name in names] for row in rows]).reshape(-1, len(names))
    complete = values[np.isfinite(values).all(axis=1)]
    return {"trial": TOTAL} | (
        dict(zip(names, complete.mean(axis=0).tolist())) if len(complete) else {}
    )


def draw_explained(rows: Sequence[dict]) -> "Figure":
    """A bar a whisk, its shares stacked away from zero to either side, and a mark for their sum, the error; the mean
    last. In per cent of the true d_x."""
    figure = blank(float(np.clip(2.5 + 0.45 * len(rows), 5.5, 16.0)), 4.2)
    axes, place = (
        figure.subplots(),
        np.arange(len(rows)) + 0.5 * (np.arange(len(rows)) == len(rows) - 1),
    )
    up, down = np.zeros(len(rows)), np.zeros(len(rows))
    for name, (label, colour) in _LOOK.items():
        share = np.nan_to_num(_percent(rows, name))
        axes.bar(
            place,
            share,
            bottom=np.where(share > 0, up, down),
            color=colour,
            label=label,
            width=0.75,
        )
        up, down = up + np.maximum(share, 0.0), down + np.minimum(share, 0.0)
    axes.plot(place, _percent(rows, "error_mm"), "k_", ms=9, mew=1.6, label="error of (10)")
    axes.axhline(0.0, color="0.3", lw=0.8)
    axes.set(
        ylabel="share of the error of d$_x$  [%]",
        title="Replaced in this order: touch, moments, friction angle",
    )
    if len(rows) <= _MOST_NAMED:
        names = [row["trial"] + (f" {row['whisk']}" if row.get("whisk") else "") for row in rows]
        axes.set_xticks(place, names, rotation=60, ha="right", fontsize=7)
    else:
        axes.set_xticks([place[-1]], [TOTAL], fontsize=7)
    figure.legend(loc="outside lower center", ncols=3)
    return figure


def _percent(rows: Sequence[dict], name: str) -> np.ndarray:
    return np.array([100.0 * row.get(name, np.nan) / row.get("d_x_mm", np.nan) for row in rows])
