"""The error of each estimator, a line a whisk."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from bench.analyses.pooling import grouped, rms
from bench.base.drawing import label_of
from bench.records.trial_result import WITH_FRICTION, TrialResult
from bench.report.whisk_rows import estimate_rows
from bench.trials.estimate_errors import Judged, sound_whisks

_NARROWEST = 17  # letters of a column


def error_lines(judged: Sequence[Judged]) -> Iterator[str]:
    """Yield a head and a line a whisk, a column an estimator: estimate less truth in percent."""
    known = [one for one in judged if one.is_shown and np.isfinite(one.error_percent)]
    if not known:
        return
    by_factor = sorted(known, key=lambda one: one.one_factor)
    heads = {one.way: _head(one) for one in by_factor}
    yield f"{'trial':<18}{'whisk':>5}  {'β':>6}   {_in_columns(heads.values(), heads.values())}"
    for (trial, whisk), mine in grouped(known, lambda one: (one.trial, one.whisk)).items():
        errors = dict.fromkeys(heads, "-")
        for one in mine:
            errors[one.way] = f"{one.error_percent:+.2f} ± {one.error_sigma_percent:.2f}"
        cells = _in_columns(heads.values(), errors.values())
        yield f"{trial:<18}{whisk:>5}  {mine[0].beta_deg:>5.1f}°   {cells}"


def _head(judged: Judged) -> str:
    """Return the head of the column that an error stands in."""
    return label_of(judged.estimator) + (", one factor" if judged.one_factor else "")


def _in_columns(heads: Iterable[str], cells: Iterable[str]) -> str:
    """Return cells in columns as wide as their heads."""
    padded = []
    for head, cell in zip(heads, cells):
        padded.append(cell.rjust(max(_NARROWEST, len(head))))
    return "  ".join(padded)


def contact_lines(results: Iterable[TrialResult]) -> Iterator[str]:
    """Yield how far contact points, deflections and slip by (10) are from those seen.

    RMS over whisks without a warning, and what was stated of each.
    """
    results = list(results)
    sound = sound_whisks(results)
    rows = []
    for row in estimate_rows(results):
        if row["estimator"] == WITH_FRICTION and (row["trial"], row["whisk"]) in sound:
            rows.append(row)
    parts = []
    for name in ("point", "d_y", "d_z", "slip"):
        error = f"{name}_error_mm"
        known = [row for row in rows if np.isfinite(row[error])]
        if not known:
            continue
        part = f"{name} {rms(row[error] for row in known):.3f} mm"
        if name != "point":
            stated_mm = rms(row[f"{name}_est_sigma_mm"] for row in known)
            part += f" ({stated_mm:.3f} stated)"
        parts.append(part)
    if parts:
        errors = ", ".join(parts)
        yield f"the contact by (10), RMS error: {errors} (estimates.csv)"
