"""The truth that a known whisk would give, with its sigmas, by the fit's own covariance."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from vision.fit.converged_fit import ConvergedFit
from vision.fit.covariance import variance_by_cause
from vision.fit.line_noise import LineNoise
from vision.fit.problem import Problem, State
from vision.geometry.camera import Cameras
from vision.geometry.centreline import is_before
from vision.geometry.reasons import Reason
from vision.geometry.refusals import Refused
from vision.geometry.vision_settings import VisionSettings
from vision.touched.one_view import seen_from_one_side
from vision.truth.at_angle import NearAngle
from vision.truth.known_whisk import KnownWhisk
from vision.truth.observe import why_failed
from vision.truth.predicted_lines import PredictedLines
from vision.truth.records import WhiskTruth
from vision.truth.sight import Hides, Sight, blank_view, find_sight
from vision.truth.strategies import NEVER_TOUCHES, TouchByClearance, TouchByOnset, early
from vision.truth.truth_rows import to_whisk
from vision.truth.value import FIELDS
from vision.truth.whisk_pictures import FittedWhisk

_USUAL = VisionSettings()
_ALL_BEHIND = Reason("all_cameras_behind", "all cameras have the whisker behind them")
_AT_TOUCH = ("d_x", "touch", "beta")
_AT_ANGLE = ("slip", "phi", "alpha")


@dataclass(frozen=True, eq=False)
class PredictedTruth:
    """The truth that a known whisk would give.

    truth: its values as known, its sigmas as expected; d_x_mm is NaN where its status says why
    there is none. sights: by camera, what it has in sight. fitted: None where there is no fit.
    """

    truth: WhiskTruth
    sights: Mapping[str, Sight]
    fitted: FittedWhisk | None = None

    @property
    def is_known(self) -> bool:
        """Return whether there would be a truth."""
        return self.fitted is not None and self.truth.d_x_mm.is_known

    def sigmas(self, theta_rad: float) -> dict[str, float]:
        """Return the standard deviations of d_x, touch and beta, and of slip, phi and alpha at a
        pushing angle, in mm and rad.

        Those at an angle count the scatter that frames have by their noise: a known whisk's have
        none.
        """
        truth = self.truth
        at_angle = truth.at(theta_rad)
        found = {
            "d_x": float(truth.d_x_mm.sigma),
            "touch": float(truth.touch_rad.sigma),
            "beta": float(truth.beta_rad.sigma),
        }
        near = None
        if truth.smooth is not None and not at_angle.status:
            near = NearAngle(truth.smooth, theta_rad)
        for name in _AT_ANGLE:
            by_noise = 0.0 if near is None else near.scatter(name).expected
            found[name] = float(np.hypot(getattr(at_angle, FIELDS[name]).sigma, by_noise))
        return found

    def largest_causes(self, theta_rad: float) -> dict[str, tuple[str, float]]:
        """Return the cause of the largest part of each variance, and that part of it.

        Names of quantities are those of `sigmas`, causes those of `variance_by_cause`.
        """
        fitted = self.fitted
        frame_theta_rad = fitted.problem.motor_rad - fitted.measured.whisk["touch"]
        frame = int(np.argmin(np.abs(frame_theta_rad - theta_rad)))
        found = {}
        for name in _AT_TOUCH:
            found[name] = _largest_cause(fitted, fitted.by_parameter.whisk[name])
        for name in _AT_ANGLE:
            found[name] = _largest_cause(fitted, fitted.by_parameter.frame[name][frame])
        return found


def _largest_cause(fitted: FittedWhisk, gradient: np.ndarray) -> tuple[str, float]:
    """Return the cause of the largest part of a variance, and that part. gradient (size,)."""
    variances = variance_by_cause(fitted, gradient)
    known = {cause: variance for cause, variance in variances.items() if np.isfinite(variance)}
    largest = max(known, key=known.__getitem__)
    return largest, float(known[largest] / sum(known.values()))


def predict_truth(
    known: KnownWhisk,
    cameras: Cameras,
    noise: Mapping[str, LineNoise],
    hides: Hides | None = None,
    settings: VisionSettings = _USUAL,
) -> PredictedTruth:
    """Predict the truth of a whisk by cameras whose lines have such noise.

    noise: by camera; one without gives no line. hides: says what something else stands before.
    """
    facing = []
    for camera in cameras:
        if is_before(camera, known.rods.wire, known.motor_rad):
            facing.append(camera.name)
    if not facing:
        return PredictedTruth(WhiskTruth(0, None, status=_ALL_BEHIND), {})
    cameras = cameras.subset(facing)
    sights = {camera.name: find_sight(known, camera, settings, hides) for camera in cameras}
    lines = PredictedLines(known, cameras, sights, noise)
    try:
        fitted = _fit(lines)
    except (Refused, np.linalg.LinAlgError) as error:
        return _without_truth(lines, why_failed(error))
    frames = range(len(known.motor_rad))
    views = [blank_view(camera, frames) for camera in cameras]
    truth = to_whisk(known.pictured(views, cameras, settings), fitted)
    return PredictedTruth(truth, sights, fitted)


def _without_truth(lines: PredictedLines, status: Reason) -> PredictedTruth:
    """Return what is predicted of a whisk that no fit determines."""
    truth = WhiskTruth(0, None, cameras=len(lines.cameras), status=status)
    return PredictedTruth(truth, lines.sights)


def _fit(lines: PredictedLines) -> FittedWhisk:
    """Return the fit to the lines of a known whisk, which is where the whisk is.

    Raises Refused where they determine no touch, LinAlgError where they do not determine the rest.
    """
    known = lines.known
    cameras = lines.cameras
    seen = lines.all_points(known.place, last=True)
    correlation = []
    for name in cameras.names:
        correlation.append(lines.noise[name].alike if name in lines.noise else 0.0)
    problem = known.problem(cameras, seen, correlation)
    if not np.any(problem.touching):
        raise Refused(NEVER_TOUCHES, code="never_touches")
    seeing_wire = {one.camera for one in seen if one.on_wire}
    is_by_edges = any(one.side for one in seen)
    if seen_from_one_side(cameras, known.axis) or (is_by_edges and len(seeing_wire) < 2):
        problem, state = _part_by_onset(problem, known)
    else:
        problem, state = _part_by_clearance(problem, known)
    fitted = FittedWhisk(problem, state, known.frames_to_fit)
    _ = fitted.inverse_normal  # raises where the lines do not determine the fit
    return fitted


def _part_by_clearance(problem: Problem, known: KnownWhisk) -> tuple[Problem, State]:
    """Return the problem with the frames that a fit would know to touch or to be free."""
    state = known.state(problem)
    covariance = ConvergedFit(problem, state).inverse_normal
    touching, free = TouchByClearance().split_by_fit(problem, state, covariance)
    problem = replace(problem, touching=touching, bent=~free)
    return problem, known.state(problem)


def _part_by_onset(problem: Problem, known: KnownWhisk) -> tuple[Problem, State]:
    """Return the problem where only the onset of bending shows when the whisker touches."""
    free = early(problem.motor_rad)
    problem = replace(problem, touching=problem.touching & ~free, bent=~free)
    state = known.state(problem)
    return TouchByOnset().with_touch(problem, state, ConvergedFit(problem, state).inverse_normal)
