"""Motion of an object at known speed, in the contact frame, for the estimator that takes it."""

from dataclasses import replace

import numpy as np

from bench.gauges.felt import FeltStroke
from bench.session.trial import Trial
from estimator.moving import known_motion
from estimator.whisk import ObjectMotion, Whisk
from vision.geometry import rotation_z

# Purpose of such a trial's results: equations of standing objects are not judged by it.
MOVING = "moving"
MOTION_ESTIMATORS = {"known_motion": known_motion}


def in_contact_frame(velocity_mm_s: np.ndarray, touch_rad: float) -> np.ndarray:
    """Rotate a velocity (3,) of the rig frame: along the whisker at touch, along its push, and up."""
    return rotation_z(touch_rad).T @ velocity_mm_s


def with_motion(whisk: Whisk, trial: Trial, stroke: FeltStroke, touch_rad: float) -> Whisk:
    """Return the whisk with the motion of the trial's object per radian, at the felt touch."""
    velocity = in_contact_frame(np.array(trial.object_velocity_mm_s), touch_rad)
    per_rad = 1.0 / stroke.speed_rad_s
    covariance = (per_rad * trial.object_velocity_sigma_mm_s) ** 2 * np.eye(3)
    return replace(whisk, object_motion=ObjectMotion(per_rad * velocity, covariance))
