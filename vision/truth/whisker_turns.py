"""The motor's angle by the whisker's own base, where none was logged.

The wire leaves its clamp along a tangent that turns with the motor. Of a bent wire the whole shape
shows it: a fit to coarse angles, then how far each frame is turned beyond them (`vision.fit.turns`),
and so on until nothing turns any more. What all frames have in common is the clamp's: the angle is 0
where the free whisker lies along x of the rig.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from vision.fit.turns import Turns
from vision.geometry.base_lines import BaseLines
from vision.geometry.camera import Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rods import Rods
from vision.geometry.vision_settings import VisionSettings
from vision.truth.observe import observe_trial
from vision.truth.records import TrialTruth, WhiskTruth
from vision.truth.trial_pictures import TrialPictures

# [passes] At most: from angles that are off by a third of the push three were enough. Study:
# tests/bench/workflows/test_seen_angles.py.
_PASSES = 6
# [1] Of a turn's own sigma, RMS: a pass that turns frames by less is the last. Derived.
_CONVERGED = 0.2

# [1] Of the coarse angles from the stroke's start, tried one after the other: where frames before touch
# turn by more or less than said, they look bent. Set by eye.
# Study: tests/bench/workflows/test_seen_angles.py.
_SCALES = (1.0, 1.04, 0.96, 1.08, 0.92)

_USUAL = VisionSettings()


@dataclass(frozen=True, eq=False)
class WhiskerAngles:
    """Angles (n,) of the whisker's base, rad, in frames (n,), with covariance (n, n) of their
    differences.
    """

    frame: np.ndarray
    angle_rad: np.ndarray
    covariance: np.ndarray


def whisker_angles(
    pictures: TrialPictures, stroke: slice, cameras: Cameras, rods: Rods
) -> WhiskerAngles:
    """Return the angles of the whisker's base in the frames of one stroke.

    pictures: with coarse motor angles. stroke: of frame indices. Raises Refused where no pass sees
    the wire from free to bent, or the angles do not converge.
    """
    observe = partial(observe_trial, whisks=[stroke], cameras=cameras, rods=rods, settings=_USUAL)
    pictures, truth = _first_seen(pictures, stroke, observe)
    for _ in range(_PASSES):
        turns = truth.turns
        motor_rad = np.array(pictures.motor_rad)
        motor_rad[turns.index] += turns.turn_rad + _clamp_rad(truth.base)
        if _have_converged(turns):
            return WhiskerAngles(turns.index, motor_rad[turns.index], turns.covariance)
        pictures = replace(pictures, motor_rad=motor_rad)
        truth = observe(pictures).whisks[0]
        if not _is_seen(truth):
            raise _not_seen(truth)
    raise Refused(
        f"the angles of the whisker's base do not converge in {_PASSES} passes",
        code="base_not_converged",
    )


def _first_seen(
    pictures: TrialPictures, stroke: slice, observe: Callable[..., TrialTruth]
) -> tuple[TrialPictures, WhiskTruth]:
    """Return the pictures with the first coarse angles by which the wire is seen from free to bent, and
    the truth by them. Raises Refused where none is.
    """
    first_rad = pictures.motor_rad[stroke][0]
    first = None
    for scale in _SCALES:
        scaled = replace(pictures, motor_rad=first_rad + scale * (pictures.motor_rad - first_rad))
        truth = observe(scaled).whisks[0]
        if _is_seen(truth):
            return scaled, truth
        first = first or truth
    raise _not_seen(first)


def _is_seen(truth: WhiskTruth) -> bool:
    """Return whether a pass has seen the wire from free to bent."""
    return truth.turns is not None and truth.base is not None


def _not_seen(truth: WhiskTruth) -> Refused:
    """Return the refusal of a wire that is not seen so."""
    why = str(truth.status) or "too few frames before touch"
    return Refused(f"the wire is not seen from its base on: {why}", code="base_not_seen")


def _clamp_rad(base: BaseLines) -> float:
    """Return the mean angle by which the free whisker leads the motor's angle, rad."""
    azimuth = np.arctan2(base.direction[:, 1], base.direction[:, 0])
    return float(np.mean(np.angle(np.exp(1j * (azimuth - base.motor_rad)))))


def _have_converged(turns: Turns) -> bool:
    """Return whether a pass has turned no frame against the others by what its sigma makes much of."""
    n = len(turns.turn_rad)
    without_mean = np.eye(n) - 1.0 / n
    own = without_mean @ turns.covariance @ without_mean
    step = turns.turn_rad - turns.turn_rad.mean()
    return bool(np.sum(step**2) <= _CONVERGED**2 * np.trace(own))
