"""The error of each estimator, a line a whisk."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from bench.base.drawing import label_of
from bench.records.trial_result import TrialResult
from bench.report.assembly import estimate_rows
from bench.trials.estimate_errors import Judged, sound_whisks


def error_lines(judged: Sequence[Judged]) -> Iterator[str]:
    """A column an estimator, estimate less truth in per cent."""
    judged = [j for j in judged if np.isfinite(j.error_percent)]
    if not judged:
        return
    columns = list(
        dict.fromkeys(
            (j.estimator, j.one_factor) for j in sorted(judged, key=lambda j: j.one_factor)
        )
    )
    columns = [c for c in columns if not c[1] or c[0] == "with_friction"]
    names = [label_of(name) + (", one factor" if one else "") for name, one in columns]
    widths = [max(17, len(name)) for name in names]
    yield f"{'trial':<18}{'whisk':>5}  {'β':>6}   " + "  ".join(
        f"{n:>{width}}" for n, width in zip(names, widths)
    )
    for key in dict.fromkeys((j.trial, j.whisk) for j in judged):
        mine = {(j.estimator, j.one_factor): j for j in judged if (j.trial, j.whisk) == key}
        cells = [f"{_error(mine.get(c)):>{width}}" for c, width in zip(columns, widths)]
        yield (
            f"{key[0]:<18}{key[1]:>5}  {next(iter(mine.values())).beta_deg:>5.1f}°   "
            + "  ".join(cells)
        )


def contact_lines(results: Iterable[TrialResult]) -> Iterator[str]:
    """How far contact points, deflections and slip by (10) are from those seen: RMS over whisks of which nothing is
    doubtful, and what was stated of each."""
    results = list(results)
    sound = sound_whisks(results)
    rows = [row for row in estimate_rows(results) if row["estimator"] == "with_friction"]
    rows = [row for row in rows if (row["trial"], row["whisk"]) in sound]
    columns = (
        ("point", None),
        ("d_y", "d_y_est_sigma_mm"),
        ("d_z", "d_z_est_sigma_mm"),
        ("slip", "slip_est_sigma_mm"),
    )
    parts = []
    for name, sigma in columns:
        finite = [row for row in rows if np.isfinite(row[f"{name}_error_mm"])]
        if finite:
            stated = f" ({_rms(finite, sigma):.3f} stated)" if sigma else ""
            parts.append(f"{name} {_rms(finite, f'{name}_error_mm'):.3f} mm{stated}")
    if parts:
        yield f"the contact felt by (10), RMS of what it is off by: {', '.join(parts)} (estimates.csv)"


def _rms(rows: Sequence[dict], column: str) -> float:
    return float(np.sqrt(np.mean(np.square([row[column] for row in rows]))))


def _error(j: Judged | None) -> str:
    return "-" if j is None else f"{j.error_percent:+.2f} ± {j.error_sigma_percent:.2f}"
