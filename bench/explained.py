"""Where the error of (10) comes from: explained.csv, assembled from the results.

(10) is taken again with what was felt or assumed replaced by what was seen, one thing at a time, in this order: touch,
moments, friction angle. Each share is the change of d_x that its replacement makes, with the sign that it has in the
error; what remains is beam theory and slip along the whisker.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from bench.alphas import seen_friction
from bench.assembly import write_table
from bench.compare import whisks
from bench.gauge_readings import known_from_pictures
from bench.results import number
from bench.whisker import Whisker
from estimator.distance import with_friction

COLUMNS = (
    *("trial", "whisk", "alpha_seen_deg", "alpha_seen_sigma_deg", "error_mm", "by_touch_mm", "by_moments_mm"),
    *("by_alpha_mm", "remainder_mm"),
)


def write_explained(out: Path, results: Iterable[dict], whisker: Whisker) -> None:
    """explained.csv: a row for each whisk that has a truth and an estimate by (10)."""
    write_table(out / "explained.csv", COLUMNS, explained_rows(results, whisker))


def explained_rows(results: Iterable[dict], whisker: Whisker) -> Iterator[dict]:
    """Rows by column; cells that cannot be known are NaN."""
    for result, seen, felt in whisks(results):
        answer = next((a for a in felt["estimates"] if a["estimator"] == "with_friction"), None)
        if answer is None or not seen.get("deflection"):
            continue
        alpha, sigma = seen_friction(seen)
        row = {"trial": result["trial"]["name"], "whisk": seen["whisk"]}
        row |= {"alpha_seen_deg": float(np.degrees(alpha)), "alpha_seen_sigma_deg": float(np.degrees(sigma))}
        yield row | _shares(result, seen, felt, answer, alpha, whisker)


def _shares(result: dict, seen: dict, felt: dict, answer: dict, alpha_seen: float, whisker: Whisker) -> dict:
    """The error of (10) and what each replacement changes, mm."""
    theta, alpha_est = np.radians(result["theta_deg"]), answer["alpha_est_rad"]
    late = felt["touch_felt_rad"] - seen["touch_rad"]
    m_felt = (felt["m_y_Nmm"], felt["m_z_Nmm"])
    m_seen = _moments_seen(seen, theta + late, whisker)
    alpha_used = alpha_seen if np.isfinite(alpha_seen) else alpha_est
    steps = [(theta, m_felt, alpha_est), (theta + late, m_felt, alpha_est), (theta + late, m_seen, alpha_est)]
    steps.append((theta + late, m_seen, max(alpha_used, 0.0)))
    d_x = [with_friction(t, *m, a, whisker.C_Nmm2) for t, m, a in steps]
    truth = number(seen["d_x_mm"])
    by = {name: d_x[k] - d_x[k + 1] for k, name in enumerate(("by_touch_mm", "by_moments_mm", "by_alpha_mm"))}
    return {"error_mm": d_x[0] - truth, **by, "remainder_mm": d_x[3] - truth}


def _moments_seen(seen: dict, theta: float, whisker: Whisker) -> tuple[float, float]:
    """(m_y, m_z) of the exact rod through the contact seen, at a pushing angle: per angle, between the frames."""
    known = known_from_pictures(seen, whisker)
    if known is None:
        return float("nan"), float("nan")
    per_angle = known.moments / known.theta_rad[:, None]
    m_y, m_z = (theta * float(np.interp(theta, known.theta_rad, column)) for column in per_angle.T)
    return m_y, m_z
