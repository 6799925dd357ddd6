"""A recorded session as a plan: each whisk as the cameras saw it, its sigmas expected beside those stated."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.plan.expected import expected
from bench.plan.outlook import AT_THETA, AT_TOUCH, Outlook, outlook
from bench.plan.plan_rows import Facts, Row, tried_on
from bench.plan.staged import Staged, on_bar
from bench.plan.tries import Try
from bench.records.trial_result import SeenTrial, SeenWhisk
from bench.rig.bar import TouchedBar, find_first_touch
from bench.rig.elastic_rod import Rod
from bench.session.session import Session
from bench.session.trial import Trial
from bench.session.whisker import Whisker
from vision.geometry import rods
from vision.geometry.camera import Cameras
from vision.geometry.vision_settings import VisionSettings

# Of the friction that stages a whisk again; where it is seen by less, sigmas change little.
_FRICTION_RAD = np.radians([1.0, 45.0])
_USUAL_FRICTION_RAD = np.radians(12.0)


@dataclass(frozen=True, eq=False)
class SeenTask:
    """One whisk that was recorded."""

    session: Session
    trial: Trial
    seen: SeenTrial
    whisk: SeenWhisk
    cameras: Cameras
    tries: Sequence[Try]
    theta_rad: float


def plan_seen(task: SeenTask) -> Row:
    """A whisk with its sigmas as expected from where rods and cameras stand, and how sure each camera's lines were in
    it."""
    whisk, facts = task.whisk, _facts(task)
    if not whisk.has_truth:
        return Row(facts, Outlook(status=whisk.status), stated={})
    try:
        staged = stage_again(task)
    except ArithmeticError as problem:
        return Row(
            facts, Outlook(status=f"cannot be staged again: {problem}"), stated=_stated(whisk)
        )
    clock_sigma_s = 0.0 if task.seen.clock is None else task.seen.clock.sigma_s
    settings = VisionSettings(clock_sigma_s=clock_sigma_s)
    cameras = task.cameras.subset(
        [name for name in task.cameras.names if name in whisk.truth.lines]
    )
    found = outlook(
        expected(staged, cameras, whisk.truth.lines, settings=settings),
        whisk.truth.lines,
        task.theta_rad,
    )
    tried = [
        tried_on(
            staged,
            one,
            one.lines(whisk.truth.lines, staged.axis),
            task.theta_rad,
            settings=settings,
        )
        for one in task.tries
    ]
    return Row(facts, found, tuple(tried), whisk.truth.lines, _stated(whisk))


def stage_again(task: SeenTask) -> Staged:
    """The whisk by the rig's mechanics: the bar where it was seen, the friction as seen. Raises ArithmeticError."""
    whisk, trial = task.whisk, task.trial
    rod = _rod(task.session.whisker)
    d_x, touch = float(whisk.d_x_mm.value), float(whisk.touch_rad.value)
    bar = TouchedBar.at_contact(
        d_x_mm=d_x,
        beta_rad=float(whisk.beta_rad.value),
        psi_rad=float(whisk.psi_rad.value),
        touch_rad=touch,
        radius_mm=0.5 * trial.bar_diameter_mm,
        whisker_radius_mm=float(rod.radius_mm(d_x)),
    )
    alpha = float(whisk.at.alpha_rad.value) if whisk.at is not None else np.nan
    friction = np.tan(np.clip(alpha, *_FRICTION_RAD) if np.isfinite(alpha) else _USUAL_FRICTION_RAD)
    frames = whisk.frames
    made = on_bar(
        rod,
        bar,
        find_first_touch(rod, bar, touch, d_x),
        float(friction),
        frames.motor_rad,
        frames.time_s,
    )
    wire = task.session.whisker.wire
    return replace(
        made, rods=rods.Rods(wire, rods.Bar(trial.bar_diameter_mm, trial.bar_diameter_sigma_mm))
    )


def _rod(whisker: Whisker) -> Rod:
    shape = whisker.shape, whisker.length_mm, whisker.diameter_mm, whisker.implied_modulus_GPa
    return Rod(*shape, tip_diameter_mm=whisker.tip_diameter_mm)


def _facts(task: SeenTask) -> Facts:
    whisk, trial = task.whisk, task.trial
    angles = [float(np.degrees(angle.value)) for angle in (whisk.beta_rad, whisk.psi_rad)]
    speed = np.nan if trial.speed_deg_s is None else float(trial.speed_deg_s)
    return Facts(
        trial.name,
        whisk.whisk,
        trial.purpose,
        trial.surface,
        speed,
        *angles,
        float(whisk.d_x_mm.value),
    )


def _stated(whisk: SeenWhisk) -> dict[str, float]:
    """Sigmas by column, as `evaluate` states them; touch without what all whisks' felt touches add to it."""
    at_touch = {"d_x_mm": whisk.d_x_mm, "touch_deg": whisk.touch_rad, "beta_deg": whisk.beta_rad}
    at_theta = {
        "slip_mm": whisk.at.slip_mm,
        "phi_deg": whisk.at.phi_rad,
        "alpha_deg": whisk.at.alpha_rad,
    }
    return {
        name: float(value.sigma) * (AT_TOUCH | AT_THETA)[name][1]
        for name, value in (at_touch | at_theta).items()
    }
