"""How far objects that give way were seen to come, and over the force felt how soft they are: gives_way.csv.

Only where a trial says that its object gives way (object_gives_way in trial.toml). The way is seen without any gauge;
only what it is worth in mm/N takes the force that is felt. compliance.csv has that next to section VII's.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun, Heading
from bench.analyses.cells import panel_title, whisk_cells
from bench.analyses.pooling import grouped
from bench.base.combined import Measurement, Measurements, sigma_without
from bench.base.tables import SURFACE, TRIAL, WHISK, Column, Kind, Table, with_sigma
from bench.records.trial_result import FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.trials.estimate_errors import is_sound
from vision import UNKNOWN, Value
from vision.geometry import counted

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
            "how far the object is from where it stood, away from the contact; seen",
        ),
        *with_sigma("gave_aside_mm", "how far it is across that and the bar"),
    ),
)


OBJECT = Heading("object", "The object")


class GivesWay(Analysis):
    """How far objects were seen to give way, and how soft that makes them."""

    tables = (GIVES_WAY,)
    in_every_run = False
    heading = OBJECT

    def compute(self, run: EvaluatedRun) -> tuple[TrialResult, ...]:
        """Return the results as they are: they hold what was seen."""
        return run.results

    def rows(self, found: Sequence[TrialResult]) -> dict[Table, Iterator[dict]]:
        """Return a row a touching frame; none where no object gave way."""
        return {GIVES_WAY: _rows(found)}

    def lines(self, found: Sequence[TrialResult]) -> Iterator[str]:
        """Yield a line a surface and speed whose object was seen to give way."""
        for panel, results in grouped(found, lambda result: result.trial.panel).items():
            give, count = mean_give(results)
            if count:
                yield (
                    f"{panel_title(*panel)}: seen to give way ({GIVES_WAY.file}); over the force "
                    f"felt by {give.value:.3f} ± {give.sigma:.3f} mm/N ({counted(count, 'whisk')})"
                )


def _rows(results: Sequence[TrialResult]) -> Iterator[dict]:
    """Yield the rows of all whisks whose object gave way."""
    for result, seen, _ in whisks(results):
        gave = seen.truth.gave
        if gave is None:
            continue
        for k, frame in enumerate(gave.index):
            yield {
                **whisk_cells(result, seen.whisk),
                "frame": int(frame),
                "theta_deg": math.degrees(gave.theta_rad[k]),
                "gave_mm": float(gave.normal_mm.value[k]),
                "gave_sigma_mm": float(gave.normal_mm.sigma[k]),
                "gave_aside_mm": float(gave.lateral_mm.value[k]),
                "gave_aside_sigma_mm": float(gave.lateral_mm.sigma[k]),
            }


def gave_at(seen: SeenWhisk, theta_rad: float) -> Value:
    """Return how far the object came along its normal up to a pushing angle, mm.

    NaN beyond the frames.
    """
    gave = seen.truth.gave
    if gave is None or not gave.theta_rad[0] <= theta_rad <= gave.theta_rad[-1]:
        return UNKNOWN
    value = np.interp(theta_rad, gave.theta_rad, gave.normal_mm.value)
    sigma = np.interp(theta_rad, gave.theta_rad, gave.normal_mm.sigma)
    return Value(float(value), float(sigma))


def normal_force_N(seen: SeenWhisk, felt: FeltWhisk) -> Value:
    """Return the force of the whisker on the object, along its normal.

    By the moments felt where the contact is seen: (m_z cos β + m_y sin β)/d_x.
    """
    m_y = felt.m_y_Nmm
    m_z = felt.m_z_Nmm
    d_x = seen.d_x_mm
    sin = np.sin(seen.beta_rad.value)
    cos = np.cos(seen.beta_rad.value)
    moment = m_y.value * sin + m_z.value * cos
    by_moments = np.hypot(m_y.sigma * sin, m_z.sigma * cos)
    by_slope = (m_y.value * cos - m_z.value * sin) * seen.beta_rad.sigma
    force = moment / d_x.value
    by_distance = force * d_x.sigma / d_x.value
    return Value(float(force), math.hypot(np.hypot(by_moments, by_slope) / d_x.value, by_distance))


def give_seen(result: TrialResult, seen: SeenWhisk, felt: FeltWhisk) -> Value:
    """Return the object's compliance by the way seen and the force felt, mm/N.

    NaN where either is not known.
    """
    way = gave_at(seen, result.theta_rad)
    if not (way.is_known and felt.has_moments and seen.has_truth):
        return UNKNOWN
    force = normal_force_N(seen, felt)
    give = way.value / force.value
    relative_sigma = math.hypot(way.sigma / way.value, force.sigma / force.value)
    return Value(give, abs(give) * relative_sigma)


def _measurement(give: Value, result: TrialResult, seen: SeenWhisk, felt: FeltWhisk) -> Measurement:
    """Return a compliance with its sigma in parts.

    What whisks share of the way seen is not known: all of it counts as shared.
    """
    way = gave_at(seen, result.theta_rad)
    sin = np.sin(seen.beta_rad.value)
    cos = np.cos(seen.beta_rad.value)
    force_N = normal_force_N(seen, felt).value
    by_gauges = felt.shared_Nmm.reshape(-1, 2) @ [sin, cos] / (force_N * seen.d_x_mm.value)
    shared = seen.truth.shared
    d_x_sigma_mm = seen.d_x_mm.sigma if shared is None else shared.d_x_mm
    by_distance = d_x_sigma_mm / seen.d_x_mm.value
    relative = np.array([way.sigma / way.value, by_distance, *-by_gauges])
    common = give.value * relative
    own = sigma_without(give.sigma, common)
    return Measurement(give.value, own, common=tuple(common.tolist()))


def mean_give(results: Sequence[TrialResult]) -> tuple[Value, int]:
    """Return the mean compliance of all sound whisks whose object gave way, mm/N, and their number."""
    gives = []
    for result, seen, felt in whisks(results):
        if not is_sound(seen, felt):
            continue
        give = give_seen(result, seen, felt)
        if give.is_known:
            gives.append((result.trial.name, _measurement(give, result, seen, felt)))
    if not gives:
        return UNKNOWN, 0
    mean = Measurements.of(gives).mean()
    return Value(mean.value, mean.sigma), len(gives)
