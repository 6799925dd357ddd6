"""The truth that a whisk would have, with its sigmas: the fit and the covariance of `evaluate` on predicted lines."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.plan.sight import (
    Hides,
    Sight,
    bar_points,
    blank_view,
    curves_of,
    nothing_hides,
    sight_of,
    wire_points,
)
from bench.plan.staged import Staged
from vision.fit.line_noise import LineNoise
from vision.fit.problem import Problem, State
from vision.fit.solve import weighted_jacobian
from vision.geometry.camera import Cameras
from vision.geometry.centreline import is_before
from vision.geometry.reasons import Reason
from vision.geometry.refusals import Refused
from vision.geometry.vision_settings import VisionSettings
from vision.touched.one_view import seen_from_one_side
from vision.truth.observe import NOT_CONVERGED
from vision.truth.records import WhiskTruth
from vision.truth.strategies import NEVER_TOUCHES, TouchByClearance, TouchByOnset, early
from vision.truth.truth_rows import to_whisk
from vision.truth.whisk_pictures import FittedWhisk, WhiskPictures
from vision.truth.whisk_truth import require_both_rods

_USUAL = VisionSettings()
_ALL_BEHIND = Reason("all_cameras_behind", "all cameras have the whisker behind them")


@dataclass(frozen=True, eq=False)
class Expected:
    """What a whisk would give: its truth (values as staged, sigmas as expected; without any where `status` says why),
    what each camera has in sight, and the fit, None where there is none."""

    truth: WhiskTruth
    sights: Mapping[str, Sight]
    fitted: FittedWhisk | None = None


def expected(
    staged: Staged,
    cameras: Cameras,
    lines: Mapping[str, LineNoise],
    hides: Hides = nothing_hides,
    settings: VisionSettings = _USUAL,
) -> Expected:
    """A whisk seen by cameras whose lines have such sigmas."""
    facing = [
        camera.name for camera in cameras if is_before(camera, staged.rods.wire, staged.motor_rad)
    ]
    if not facing:
        return Expected(WhiskTruth(0, None, status=_ALL_BEHIND), {})
    cameras, curves = cameras.subset(facing), curves_of(staged, near_frames(staged))
    sights = {camera.name: sight_of(camera, staged, curves, settings, hides) for camera in cameras}
    try:
        fitted = _fitted(staged, cameras, lines, sights, curves)
    except Refused as reason:
        return Expected(WhiskTruth(0, None, cameras=len(cameras), status=reason.reason), sights)
    except np.linalg.LinAlgError:
        return Expected(
            WhiskTruth(0, None, cameras=len(cameras), status=NOT_CONVERGED),
            sights,
        )
    every = range(len(staged.motor_rad))
    views = tuple(blank_view(camera, every) for camera in cameras)
    whisk = WhiskPictures(
        0, every, staged.time_s, staged.motor_rad, views, cameras, staged.rods, None, settings
    )
    return Expected(to_whisk(whisk, fitted), sights, fitted)


def near_frames(staged: Staged) -> list[int]:
    """The frames that make the truth."""
    return TouchByClearance().frames_to_fit(
        dict(enumerate(staged.motor_rad.tolist())), dict(enumerate(staged.bend_rad))
    )


def _fitted(
    staged: Staged,
    cameras: Cameras,
    lines: Mapping[str, LineNoise],
    sights: Mapping[str, Sight],
    curves,
) -> FittedWhisk:
    """The fit to the predicted lines. Raises Refused where there is none."""
    frames, seen = list(curves), []
    for number, camera in enumerate(cameras):
        noise = lines.get(camera.name)
        if noise is not None and np.isfinite(noise.wire_px):
            seen += wire_points(sights[camera.name], number, curves, noise.wire_px)
        if noise is not None:
            seen += bar_points(camera, number, staged.axis, staged.rods, noise.bar_px)
    require_both_rods(seen)
    touches = staged.motor_rad[frames] > staged.touch.motor_rad
    if not np.any(touches):
        raise Refused(NEVER_TOUCHES, code="never_touches")
    alike = [lines[name].alike if name in lines else 0.0 for name in cameras.names]
    problem = Problem(
        cameras,
        staged.rods,
        staged.axis,
        staged.motor_rad[frames],
        touches,
        touches,
        seen,
        neighbour_correlation=alike,
    )
    by_edges = any(one.side for one in seen)
    few = by_edges and len({one.camera for one in seen if one.frame >= 0}) < 2
    parted = _by_onset if seen_from_one_side(cameras, staged.axis) or few else _by_clearance
    problem, state = parted(problem, staged, frames)
    return FittedWhisk.of(problem, state, _answer(problem, state), frames)


def _answer(problem: Problem, state: State) -> np.ndarray:
    """How the parameters answer the observations, (size, size)."""
    rows = weighted_jacobian(problem, state)
    return np.linalg.inv(rows.T @ rows)


def state_of(problem: Problem, staged: Staged, frames: Sequence[int]) -> State:
    """The parameters as staged."""
    vector = np.zeros(problem.size)
    vector[problem.blocks.rest_shape.slice] = np.ravel(staged.rest_mm)
    vector[problem.first_bend :] = staged.bend_rad[frames][problem.bent].ravel()
    return State(vector, staged.arc_mm[frames])


def _by_clearance(problem: Problem, staged: Staged, frames: Sequence[int]) -> tuple[Problem, State]:
    """The problem with the frames parted as the fit would know them to touch, and the state."""
    state = state_of(problem, staged, frames)
    touching, free = TouchByClearance().part_by_fit(problem, state, _answer(problem, state))
    problem = replace(problem, touching=touching, bent=~free)
    return problem, state_of(problem, staged, frames)


def _by_onset(problem: Problem, staged: Staged, frames: Sequence[int]) -> tuple[Problem, State]:
    """The same where only the onset of bending tells when the whisker touches."""
    free = early(problem.motor_rad)
    problem = replace(problem, touching=problem.touching & ~free, bent=~free)
    state = state_of(problem, staged, frames)
    return TouchByOnset().with_touch(problem, state, _answer(problem, state))
