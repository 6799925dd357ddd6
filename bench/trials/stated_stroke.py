"""A stroke against an object that stands where the stage has it, with how well each part of that is known."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bench.base.errors import BadInput
from bench.session.session import Session
from bench.session.signals import Signals
from bench.session.stage import StageLog
from bench.session.trial import Trial
from bench.trials.consistency import nominal_slope, nominal_slope_sigma_rad
from bench.trials.stage_contact import (
    REST_TERMS,
    Contact,
    Offsets,
    StatedBar,
    StatedObject,
    StatedPush,
    StatedRounded,
)
from bench.trials.trial_frames import stated_object
from vision.geometry import Rounded, apply, unit

# [mm] One sigma of where the clamp holds the whisker's axis beside the hub's: a collet's runout.
# Stated.
_CLAMP_MM = 0.3
# [1] Of the length: one sigma of the tip's distance from a straight line, by set and sag, where
# nothing is stated of the unloaded shape. A drawn wire, straightened by hand. Stated.
_SET_SHARE = 0.01


@dataclass(frozen=True, eq=False)
class StatedStroke:
    """A forward stroke of a trial whose stage states where its object stands.

    stroke: its rows in the signals.
    """

    session: Session
    trial: Trial
    signals: Signals
    stroke: slice

    @cached_property
    def _farthest_rad(self) -> np.ndarray:
        """Return the largest motor angle (n,) up to each sample."""
        return np.maximum.accumulate(self.signals.motor_rad[self.stroke])

    def time_s(self, motor_rad: np.ndarray | float) -> np.ndarray:
        """Return when the motor first comes to angles (...)."""
        return np.interp(motor_rad, self._farthest_rad, self.signals.time_s[self.stroke])

    def push(self) -> StatedPush:
        """Return the stroke against the object. Raise BadInput where the stage's log does not cover it."""
        trial = self.trial
        log = trial.stage
        if log is not None:
            _check_covers(log, self.signals.time_s[self.stroke])
        stated = trial.object
        origin_mm = np.zeros(3) if stated is None or stated.point_mm is None else stated.point_mm
        base = self.session.base
        T_base_rig = np.eye(3, 4) if base is None else base.T_base_rig

        def place_at(angles_rad: np.ndarray) -> np.ndarray:
            """Return the object's place (..., 3), mm, when the motor is at angles (...)."""
            in_rig_mm = np.broadcast_to(origin_mm, (*np.shape(angles_rad), 3))
            if log is not None:
                in_rig_mm = in_rig_mm + log.at(self.time_s(angles_rad))
            return apply(T_base_rig, in_rig_mm)

        standing = _standing_object(trial, T_base_rig[:, :3])
        motor_rad = self.signals.motor_rad[self.stroke]
        return StatedPush(motor_rad, place_at, self.session.whisker.wire, standing)

    def own_sigmas(self, touch: Contact) -> np.ndarray:
        """Return one sigma (p,) of each offset that is the trial's own: place and direction."""
        trial = self.trial
        variances = np.zeros(3)
        if trial.object is not None and trial.object.point_mm is not None:
            variances += trial.object.point_sigma_mm**2
        if trial.stage is not None:
            variances += trial.stage.sigma_at(self.time_s(touch.motor_rad)) ** 2
        slope_sigma_rad = nominal_slope_sigma_rad(trial)
        return Offsets(
            np.sqrt(variances), slope_sigma_rad, slope_sigma_rad, 0.0, np.zeros((2, REST_TERMS))
        ).vector

    def shared_sigmas(self, touch: Contact) -> np.ndarray:
        """Return one sigma (p,) of each offset that all whisks share: origin, radii, the whisker's shape, its base."""
        whisker = self.session.whisker
        reach_mm = 0.5 * np.hypot(self.trial.bar_diameter_sigma_mm, whisker.diameter_sigma_mm)
        is_stated = whisker.rest_curvature_per_mm is not None or whisker.rest_shape is not None
        set_mm = 0.0 if is_stated else _SET_SHARE * whisker.length_mm
        rest_mm = np.tile([_CLAMP_MM, 0.0, set_mm], (2, 1))
        place_mm = self.session.truth.origin_sigma_mm
        turn_rad = 0.0
        base = self.session.base
        if base is not None:
            turn_rad = base.sigma_rad
            of_base_mm = np.hypot(base.sigma_mm, turn_rad * touch.d_x_mm)
            place_mm = math.hypot(place_mm, of_base_mm)
        return Offsets(np.full(3, place_mm), turn_rad, turn_rad, float(reach_mm), rest_mm).vector


def _standing_object(trial: Trial, to_base: np.ndarray) -> StatedObject:
    """Return the trial's object with its direction. to_base (3, 3): turns rig vectors into the whisker's base frame."""
    form = stated_object(trial)
    if isinstance(form, Rounded):
        return StatedRounded(form, unit(to_base @ trial.object.direction))
    axis = None
    if trial.object is not None and trial.object.axis is not None:
        axis = unit(to_base @ trial.object.axis)
        axis = -axis if axis[2] < 0 else axis
    slope_rad = nominal_slope(trial).value
    return StatedBar(form.radius_mm, axis, float(slope_rad) if np.isfinite(slope_rad) else 0.0)


def _check_covers(log: StageLog, time_s: np.ndarray) -> None:
    """Raise BadInput where the stage's log does not cover a stroke's times (n,)."""
    if not log.covers(time_s):
        held = f"holds {log.time_s[0]:.6g} to {log.time_s[-1]:.6g} s"
        found = f"{held}; a stroke of the signals goes from {time_s[0]:.6g} to {time_s[-1]:.6g} s"
        raise BadInput(f"{found}; both are on one clock", file=log.label)
