"""A recorded session as a plan: each whisk as the cameras saw it, its expected sigmas and those stated."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.plan.changes import Change
from bench.plan.outlook import Outlook, in_unit, outlook
from bench.plan.plan_rows import Facts, Row, changed_sigmas
from bench.plan.staged import StagedWhisk, stage_on_bar
from bench.records.trial_result import SeenTrial, SeenWhisk
from bench.rig.bar import TouchedBar, find_first_touch
from bench.rig.elastic_rod import Rod
from bench.session.session import Session
from bench.session.trial import Trial
from bench.session.whisker import Whisker
from vision import predict_truth
from vision.geometry import Bar, Cameras, Rods, VisionSettings

# [rad] Least and most friction with which a whisk is staged again; where less was seen, sigmas
# change little. Stated.
_FRICTION_RAD = np.radians([1.0, 45.0])
# [rad] Friction where none was seen. Stated.
_USUAL_FRICTION_RAD = np.radians(12.0)


@dataclass(frozen=True, eq=False)
class SeenTask:
    """One whisk that was recorded."""

    session: Session
    trial: Trial
    seen: SeenTrial
    whisk: SeenWhisk
    cameras: Cameras
    changes: Sequence[Change]
    theta_rad: float


def plan_seen(task: SeenTask) -> Row:
    """Return the row of a recorded whisk.

    Its sigmas are expected from where rods and cameras stand, and from the noise of each camera's
    lines in it.
    """
    whisk = task.whisk
    facts = _facts(task)
    if not whisk.has_truth:
        return Row(facts, Outlook(status=whisk.status), stated={})
    stated = _stated_sigmas(whisk)
    try:
        known = stage_again(task).known
    except ArithmeticError as problem:
        return Row(facts, Outlook(status=f"cannot be staged again: {problem}"), stated=stated)
    clock = task.seen.clock
    settings = VisionSettings(clock_sigma_s=0.0 if clock is None else clock.sigma_s)
    noise = whisk.truth.lines
    cameras = task.cameras.subset([name for name in task.cameras.names if name in noise])
    predicted = predict_truth(known, cameras, noise, settings=settings)
    changes = []
    for change in task.changes:
        changed = change.line_noise(noise, known)
        after = predict_truth(known, change.cameras, changed, settings=settings)
        changes.append(changed_sigmas(change, after, task.theta_rad))
    return Row(facts, outlook(predicted, noise, task.theta_rad), tuple(changes), noise, stated)


def stage_again(task: SeenTask) -> StagedWhisk:
    """Return a recorded whisk by the rig's mechanics, with bar and friction as they were seen.

    Raises ArithmeticError where the whisker slips off or buckles.
    """
    whisk = task.whisk
    trial = task.trial
    rod = _rod(task.session.whisker)
    d_x_mm = float(whisk.d_x_mm.value)
    touch_rad = float(whisk.touch_rad.value)
    bar = TouchedBar.at_contact(
        d_x_mm=d_x_mm,
        beta_rad=float(whisk.beta_rad.value),
        psi_rad=float(whisk.psi_rad.value),
        touch_rad=touch_rad,
        radius_mm=0.5 * trial.bar_diameter_mm,
        whisker_radius_mm=float(rod.radius_mm(d_x_mm)),
    )
    touch = find_first_touch(rod, bar, touch_rad, d_x_mm)
    frames = whisk.frames
    staged = stage_on_bar(rod, bar, touch, _friction(whisk), frames.motor_rad, frames.time_s)
    stated_bar = Bar(trial.bar_diameter_mm, trial.bar_diameter_sigma_mm)
    stated = Rods(task.session.whisker.wire, stated_bar)
    return replace(staged, known=replace(staged.known, rods=stated))


def _friction(whisk: SeenWhisk) -> float:
    """Return the coefficient of friction that was seen, within bounds; the usual one for none."""
    alpha_rad = float(whisk.at.alpha_rad.value) if whisk.at is not None else np.nan
    if not np.isfinite(alpha_rad):
        alpha_rad = _USUAL_FRICTION_RAD
    return float(np.tan(np.clip(alpha_rad, *_FRICTION_RAD)))


def _rod(whisker: Whisker) -> Rod:
    """Return the rig's rod of a session's whisker."""
    sizes = (whisker.shape, whisker.length_mm, whisker.diameter_mm, whisker.implied_modulus_GPa)
    widths = whisker.widths if whisker.shape == "tapered" else ()
    return Rod(*sizes, tip_diameter_mm=whisker.tip_diameter_mm, widths=widths)


def _facts(task: SeenTask) -> Facts:
    """Return what was seen of a whisk."""
    whisk = task.whisk
    trial = task.trial
    speed_deg_s = np.nan if trial.speed_deg_s is None else float(trial.speed_deg_s)
    return Facts(
        trial=trial.name,
        whisk=whisk.whisk,
        purpose=trial.purpose,
        surface=trial.surface,
        speed_deg_s=speed_deg_s,
        beta_deg=math.degrees(whisk.beta_rad.value),
        psi_deg=math.degrees(whisk.psi_rad.value),
        d_x_mm=float(whisk.d_x_mm.value),
    )


def _stated_sigmas(whisk: SeenWhisk) -> dict[str, float]:
    """Return the sigmas by column that `evaluate` states.

    That of touch is without what the touches felt in all whisks add to it.
    """
    values = {
        "d_x_mm": whisk.d_x_mm,
        "touch_deg": whisk.touch_rad,
        "beta_deg": whisk.beta_rad,
        "slip_mm": whisk.at.slip_mm,
        "phi_deg": whisk.at.phi_rad,
        "alpha_deg": whisk.at.alpha_rad,
    }
    return {column: in_unit(column, float(value.sigma)) for column, value in values.items()}
