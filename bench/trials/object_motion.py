"""An object that moves at known speed: what its whisk's estimator is told of it, in the contact frame."""

from dataclasses import replace

import numpy as np

from bench.gauges.felt import FeltStroke
from bench.session.trial import Trial
from estimator.moving import known_motion
from estimator.whisk import ObjectMotion, Whisk

MOVING = "moving"  # purpose of such a trial's results: equations of standing objects are not judged by it
ASKED = {"known_motion": known_motion}


def in_contact_frame(velocity_mm_s: np.ndarray, touch_rad: float) -> np.ndarray:
    """A velocity (3,) of the rig frame along the whisker at touch, along the way it pushes, and up."""
    cosine, sine = np.cos(touch_rad), np.sin(touch_rad)
    return np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]]) @ velocity_mm_s


def with_motion(whisk: Whisk, trial: Trial, stroke: FeltStroke, touch_rad: float) -> Whisk:
    """The whisk told how the trial's object moves; by where its touch was felt."""
    per_rad = 1.0 / stroke.speed_rad_s
    told = per_rad * in_contact_frame(np.array(trial.object_velocity_mm_s), touch_rad)
    spread = (per_rad * trial.object_velocity_sigma_mm_s) ** 2 * np.eye(3)
    return replace(whisk, object_motion=ObjectMotion(told, spread))
