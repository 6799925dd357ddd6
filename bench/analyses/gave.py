"""How far objects that give way were seen to come, and over the force felt how soft they are: gives_way.csv, lines of
the summary, and what compliance.csv has beside section VII's.

Only where a trial says that its object gives way (object_gives_way in trial.toml). The way is seen without any gauge;
only what it is worth in mm/N takes the force that is felt.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from bench.base.tables import SURFACE, TRIAL, WHISK, Column, Kind, Table, with_sigma
from bench.records.trial_result import FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.trials.estimate_errors import is_sound
from vision.geometry.counted import counted
from vision.truth.value import UNKNOWN, Value

GIVES_WAY = Table(
    "gives_way",
    "A row a touching frame of trials with `object_gives_way` that have a truth "
    "([soft.md](soft.md)).",
    (
        TRIAL,
        WHISK,
        SURFACE,
        Column("frame", "number of the frame in the trial", Kind.WHOLE),
        Column("theta_deg", "pushing angle"),
        *with_sigma(
            "gave_mm",
            "how far the object is from where it stood, away from the contact; seen, without any "
            "gauge",
        ),
        *with_sigma("gave_aside_mm", "how far it is across that and the bar"),
    ),
)


def write_gives_way(out: Path, results: Sequence[TrialResult]) -> None:
    """gives_way.csv, a row a touching frame; nothing where no object gave way."""
    rows = [
        row
        for result, seen, _ in whisks(results)
        if seen.truth.gave is not None
        for row in _rows(result, seen)
    ]
    if rows:
        GIVES_WAY.write(out, rows)


def _rows(result: TrialResult, seen: SeenWhisk) -> Iterator[dict]:
    gave, trial = seen.truth.gave, result.trial
    columns = gave.index, np.degrees(gave.theta_rad), gave.normal_mm.value, gave.normal_mm.sigma
    for values in zip(*columns, gave.aside_mm.value, gave.aside_mm.sigma):
        frame, *numbers = (value.item() for value in values)
        yield dict(zip(GIVES_WAY.names, (trial.name, seen.whisk, trial.surface, frame, *numbers)))


def gave_at(seen: SeenWhisk, theta_rad: float) -> Value:
    """How far the object came along its normal up to a pushing angle, mm; NaN beyond the frames."""
    gave = seen.truth.gave
    if gave is None or not gave.theta_rad[0] <= theta_rad <= gave.theta_rad[-1]:
        return UNKNOWN
    of = (
        float(np.interp(theta_rad, gave.theta_rad, part))
        for part in (gave.normal_mm.value, gave.normal_mm.sigma)
    )
    return Value(*of)


def normal_force_N(seen: SeenWhisk, felt: FeltWhisk) -> Value:
    """Of the whisker on the object, along its normal: by the moments felt where the contact is seen,
    (m_z cos β + m_y sin β)/d_x."""
    m_y, m_z, d_x, beta = felt.m_y_Nmm, felt.m_z_Nmm, seen.d_x_mm, seen.beta_rad.value
    along = m_y.value * np.sin(beta) + m_z.value * np.cos(beta)
    own = np.hypot(m_y.sigma * np.sin(beta), m_z.sigma * np.cos(beta))
    turned = (m_y.value * np.cos(beta) - m_z.value * np.sin(beta)) * seen.beta_rad.sigma
    force = along / d_x.value
    return Value(
        float(force),
        float(np.hypot(np.hypot(own, turned) / d_x.value, force * d_x.sigma / d_x.value)),
    )


def give_seen(result: TrialResult, seen: SeenWhisk, felt: FeltWhisk) -> Value:
    """Compliance of the object by the way seen and the force felt, mm/N; NaN where either is not known."""
    way = gave_at(seen, float(np.radians(result.theta_deg)))
    if not (np.isfinite(way.value) and felt.has_moments and seen.has_truth):
        return UNKNOWN
    force = normal_force_N(seen, felt)
    give = way.value / force.value
    return Value(
        give, abs(give) * float(np.hypot(way.sigma / way.value, force.sigma / force.value))
    )


def mean_give(results: Sequence[TrialResult]) -> tuple[Value, int]:
    """Of all sound whisks whose object gave way: mean compliance, mm/N, and their number. Gauges and cameras are those
    of all, so that the mean is known no better than one."""
    each = [
        give_seen(result, seen, felt)
        for result, seen, felt in whisks(results)
        if is_sound(seen, felt)
    ]
    each = [give for give in each if np.isfinite(give.value)]
    if not each:
        return UNKNOWN, 0
    sigma = float(np.sqrt(np.mean([give.sigma**2 for give in each])))
    return Value(float(np.mean([give.value for give in each])), sigma), len(each)


def gave_lines(results: Sequence[TrialResult]) -> Iterator[str]:
    """A line a surface and speed whose object was seen to give way."""
    for surface, speed in dict.fromkeys(r.trial.panel for r in results):
        mine = [r for r in results if r.trial.panel == (surface, speed)]
        give, count = mean_give(mine)
        if count:
            named = (
                f"{surface or 'surface not named'}{f', {speed:g}°/s' if speed is not None else ''}"
            )
            yield (
                f"{named}: seen to give way ({GIVES_WAY.file}); over the force felt by {give.value:.3f} ± {give.sigma:.3f} mm/N "
                f"({counted(count, 'whisk')})"
            )
