"""Objects that moved while they were touched: every estimator's error over their speed, moving.csv and moving.png.

Only where a trial says how its object moves (object_velocity_mm_s).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bench.base.drawing import blank, colour_of, label_of, save, style
from bench.base.results import hash_of
from bench.base.tables import SURFACE, TRIAL, WHISK, Column, Kind, Table, alike, status, with_sigma
from bench.gauges.felt import motor_speed
from bench.records.trial_result import EstimateRow, SeenWhisk, TrialResult, whisks
from bench.session.session import Session
from bench.session.trial import Trial
from bench.trials.estimate_errors import is_sound
from bench.trials.object_motion import in_contact_frame
from vision.geometry.counted import counted

if TYPE_CHECKING:  # matplotlib is loaded where something is drawn
    from matplotlib.figure import Figure

_WAYS = ("x", "y", "z")
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
        *alike((f"velocity_{way}_mm_s" for way in _WAYS), _AS_STATED),
        Column("velocity_sigma_mm_s", "its standard deviation each way"),
        *alike((f"velocity_seen_{way}_mm_s" for way in _WAYS), _AS_SEEN),
        *alike((f"velocity_seen_{way}_sigma_mm_s" for way in _WAYS), "its standard deviations"),
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
        status("what is doubtful of the estimate"),
    ),
)
FIGURE = "moving.png"


@dataclass(frozen=True, eq=False)
class Moved:
    """One estimate of a whisk whose object moved; share_percent: the object's speed along the push, of the whisker's
    own at the contact."""

    trial: Trial
    seen: SeenWhisk
    answer: EstimateRow
    share_percent: float
    sound: bool

    @property
    def error_percent(self) -> float:
        """Estimate less truth, % of the truth."""
        return 100.0 * (self.answer.d_x_est_mm.value / self.seen.d_x_mm.value - 1.0)

    @property
    def inside(self) -> bool | None:
        """Whether the 95 % interval holds the truth; None where there is no interval."""
        return (
            self.answer.holds(self.seen.d_x_mm.value) if np.isfinite(self.error_percent) else None
        )


def moved_whisks(session: Session, results: Sequence[TrialResult]) -> list[Moved]:
    """Every estimate of every whisk against an object that moved, of which the truth is known."""
    found = []
    for result, seen, felt in whisks(results):
        trial = session.trial(result.trial.name)
        if trial.object_velocity_mm_s is not None and seen.has_truth and felt.has_moments:
            share, sound = _share_percent(trial, seen), is_sound(seen, felt)
            found += [
                Moved(trial, seen, answer, share, sound)
                for answer in (*felt.estimates, *felt.sensors)
            ]
    return found


def _share_percent(trial: Trial, seen: SeenWhisk) -> float:
    along = in_contact_frame(np.array(trial.object_velocity_mm_s), seen.touch_rad.value)[1]
    return float(100.0 * along / (motor_speed(seen.frames) * seen.d_x_mm.value))


def write_moving(out: Path, found: Sequence[Moved], *, drawn: bool) -> list[str]:
    """moving.csv and moving.png, the names of figures; nothing where no object moved."""
    if not found:
        return []
    MOVING.write(out, map(_row, found))
    if not drawn:
        return []
    with style():
        save(
            error_over_speed(found),
            out / FIGURE,
            hash_of([list(_row(one).values()) for one in found]),
        )
    return [FIGURE]


def _row(one: Moved) -> dict:
    trial, seen, answer = one.trial, one.seen, one.answer
    row = {
        "trial": trial.name,
        "whisk": seen.whisk,
        "surface": trial.surface,
        "status": answer.status,
    }
    row |= {
        "beta_deg": float(np.degrees(seen.beta_rad.value)),
        "velocity_share_percent": one.share_percent,
    }
    told, as_seen = trial.object_velocity_mm_s, seen.truth.velocity_mm_s
    for k, way in enumerate(_WAYS):
        row[f"velocity_{way}_mm_s"] = float(told[k])
        if as_seen is not None:
            row[f"velocity_seen_{way}_mm_s"] = float(as_seen.value[k])
            row[f"velocity_seen_{way}_sigma_mm_s"] = float(as_seen.sigma[k])
    row |= {"velocity_sigma_mm_s": trial.object_velocity_sigma_mm_s, "estimator": answer.estimator}
    row |= {"d_x_mm": float(seen.d_x_mm.value), "d_x_sigma_mm": float(seen.d_x_mm.sigma)}
    row |= {"d_x_est_mm": answer.d_x_est_mm.value, "d_x_est_sigma_mm": answer.d_x_est_mm.sigma}
    row |= {
        "error_mm": answer.d_x_est_mm.value - seen.d_x_mm.value,
        "error_percent": one.error_percent,
    }
    return row | {"inside": None if one.inside is None else int(one.inside)}


def error_over_speed(found: Sequence[Moved]) -> "Figure":
    """Error of d_x over the object's speed along the push, estimator by estimator."""
    figure = blank(6.0, 4.0)
    axes = figure.subplots()
    for number, name in enumerate(dict.fromkeys(one.answer.estimator for one in found)):
        mine = sorted(
            (one for one in found if one.answer.estimator == name),
            key=lambda one: one.share_percent,
        )
        share, error = (
            [getattr(one, what) for one in mine] for what in ("share_percent", "error_percent")
        )
        axes.plot(share, error, "o", ms=4, color=colour_of(name, number), label=label_of(name))
    axes.axhline(0.0, color="0.6", lw=0.8, zorder=0)
    axes.set(
        xlabel="object's speed along the push  [% of the whisker's at the contact]",
        ylabel="error of d$_x$  [%]",
    )
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def moving_lines(found: Sequence[Moved]) -> Iterator[str]:
    """For the summary: a line on the whisks, and one an estimator."""
    judged = [one for one in found if one.sound and np.isfinite(one.error_percent)]
    if not judged:
        return
    shares = [one.share_percent for one in judged]
    whole = {(one.trial.name, one.seen.whisk) for one in judged}
    yield (
        f"{counted(len(whole), 'whisk')} against objects that moved along the push at {min(shares):+.0f} to "
        f"{max(shares):+.0f} % of the whisker's speed; error of d_x, RMS:"
    )
    for name in dict.fromkeys(one.answer.estimator for one in judged):
        mine = [one for one in judged if one.answer.estimator == name]
        rms, held = (
            np.sqrt(np.mean([one.error_percent**2 for one in mine])),
            [one.inside for one in mine],
        )
        yield (
            f"  {label_of(name)}: {rms:.2g} %; its 95 % interval holds {sum(map(bool, held))} of "
            f"{counted(len(mine), 'whisk')}"
        )
