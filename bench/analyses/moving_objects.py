"""Objects that moved while they were touched: every estimator's error over their speed.

Only where a trial says how its object moves (object_velocity_mm_s).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import degrees
from typing import TYPE_CHECKING

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun, Heading
from bench.analyses.compared_estimate import ComparedEstimate
from bench.analyses.pooling import column, coverage, grouped, rms
from bench.base.drawing import add_legend, blank, colour_of, label_of
from bench.base.tables import SURFACE, TRIAL, WHISK, Column, Kind, Table, alike, status, with_sigma
from bench.gauges.felt import motor_speed
from bench.records.trial_result import FeltWhisk, SeenWhisk, whisks
from bench.session.trial import Trial
from bench.trials.estimate_errors import is_sound
from bench.trials.object_motion import in_contact_frame
from vision.geometry import counted

if TYPE_CHECKING:  # matplotlib is loaded where something is drawn
    from matplotlib.figure import Figure

_AXES = ("x", "y", "z")
_AS_STATED = "velocity of the object as stated, rig frame"
_AS_SEEN = "velocity of the object by what was stated and the pictures"
MOVING = Table(
    "moving",
    "A row a whisk and estimator, of trials with `object_velocity_mm_s`, that have a truth and "
    "moments ([moving.md](moving.md)).",
    (
        TRIAL,
        WHISK,
        SURFACE,
        Column("beta_deg", "slope as seen"),
        Column(
            "velocity_share_percent",
            "the object's speed along the push, of the whisker's own at the contact",
        ),
        *alike((f"velocity_{axis}_mm_s" for axis in _AXES), _AS_STATED),
        Column("velocity_sigma_mm_s", "its standard deviation each way"),
        *alike((f"velocity_seen_{axis}_mm_s" for axis in _AXES), _AS_SEEN),
        *alike((f"velocity_seen_{axis}_sigma_mm_s" for axis in _AXES), "its standard deviations"),
        Column(
            "estimator",
            "as in estimates.csv; known_motion: (10), or (2), for an object that moves as stated",
            Kind.TEXT,
        ),
        *with_sigma("d_x_mm", "distance at first touch: the truth"),
        *with_sigma("d_x_est_mm", "distance at first touch: estimated"),
        Column("error_mm", "estimate less truth"),
        Column("error_percent", "that error, % of the truth"),
        Column("inside", "1 where the estimate's 95 % interval holds the truth, else 0"),
        status("warnings of the estimate"),
    ),
)


@dataclass(frozen=True, eq=False)
class Moved(ComparedEstimate):
    """One estimate of a whisk whose object moved.

    share_percent: the object's speed along the push, of the whisker's own at the contact.
    """

    trial: Trial
    seen: SeenWhisk
    share_percent: float
    is_sound: bool


class MovingObjects(Analysis):
    """How far estimators err where the object moves."""

    tables = (MOVING,)
    in_every_run = False
    heading = Heading("moving", "Objects that moved (moving.csv)")
    figure_name = "moving"
    needs_session = True

    def compute(self, run: EvaluatedRun) -> list[Moved]:
        """Return every estimate of every whisk with a truth whose object moved."""
        found = []
        for result, seen, felt in whisks(run.results):
            trial = run.session.trial(result.trial.name)
            if trial.object_velocity_mm_s is None or not (seen.has_truth and felt.has_moments):
                continue
            share = _share_percent(trial, seen, felt)
            sound = is_sound(seen, felt)
            for estimate in (*felt.estimates, *felt.sensors):
                found.append(Moved(estimate, seen.d_x_mm, trial, seen, share, sound))
        return found

    def row(self, one: Moved) -> dict:
        """Return the row of a whisk and estimator."""
        trial = one.trial
        seen = one.seen
        row = {
            "trial": trial.name,
            "whisk": seen.whisk,
            "surface": trial.surface,
            **one.cells,
            "beta_deg": degrees(seen.beta_rad.value),
            "velocity_share_percent": one.share_percent,
            "velocity_sigma_mm_s": trial.object_velocity_sigma_mm_s,
            "status": one.estimate.status,
        }
        for k, axis in enumerate(_AXES):
            row[f"velocity_{axis}_mm_s"] = float(trial.object_velocity_mm_s[k])
            if seen.truth.velocity_mm_s is not None:
                row[f"velocity_seen_{axis}_mm_s"] = float(seen.truth.velocity_mm_s.value[k])
                row[f"velocity_seen_{axis}_sigma_mm_s"] = float(seen.truth.velocity_mm_s.sigma[k])
        return row

    def lines(self, found: Sequence[Moved]) -> Iterator[str]:
        """Yield a line on the whisks, and one an estimator."""
        known = [one for one in found if one.is_sound and np.isfinite(one.error_percent)]
        if not known:
            return
        shares = column(known, "share_percent")
        number = len({(one.trial.name, one.seen.whisk) for one in known})
        yield (
            f"{counted(number, 'whisk')} against objects that moved along the push at "
            f"{min(shares):+.0f} to {max(shares):+.0f} % of the whisker's speed; error of d_x, RMS:"
        )
        for name, mine in grouped(known, lambda one: one.estimate.estimator).items():
            error_percent = rms(column(mine, "error_percent"))
            yield f"  {label_of(name)}: {error_percent:.2g} %; {coverage(mine, 'whisk')}"

    def figure(self, found: Sequence[Moved]) -> "Figure | None":
        """Draw the error of d_x over the object's speed along the push, estimator by estimator."""
        if not found:
            return None
        drawing = blank(6.0, 4.0)
        axes = drawing.subplots()
        by_estimator = grouped(found, lambda one: one.estimate.estimator)
        for number, (name, mine) in enumerate(by_estimator.items()):
            mine = sorted(mine, key=lambda one: one.share_percent)
            shares = column(mine, "share_percent")
            errors = column(mine, "error_percent")
            colour = colour_of(name, number)
            axes.plot(shares, errors, "o", ms=4, color=colour, label=label_of(name))
        axes.axhline(0.0, color="0.6", lw=0.8, zorder=0)
        axes.set(
            xlabel="object's speed along the push  [% of the whisker's at the contact]",
            ylabel="error of d$_x$  [%]",
        )
        add_legend(drawing, 3)
        return drawing


def _share_percent(trial: Trial, seen: SeenWhisk, felt: FeltWhisk) -> float:
    """Return the object's speed along the push, percent of the whisker's at the contact.

    Without frames touch is the one felt and the speed the nominal one, NaN where none is stated.
    """
    touch_rad = felt.touch_felt_rad.value
    speed_rad_s = np.nan if trial.speed_deg_s is None else np.radians(trial.speed_deg_s)
    if seen.frames is not None:
        touch_rad = seen.touch_rad.value
        speed_rad_s = motor_speed(seen.frames)
    velocity_mm_s = np.array(trial.object_velocity_mm_s)
    along_mm_s = in_contact_frame(velocity_mm_s, touch_rad)[1]
    whisker_mm_s = speed_rad_s * seen.d_x_mm.value
    return float(100.0 * along_mm_s / whisker_mm_s)
