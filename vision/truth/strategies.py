"""How the object is read and how touch is found: what the cameras of a whisk can determine.

Two cameras whose sights cross locate bar and wire in space: the bar's middle is enough, and touch
is where their clearance ends. To one camera, or to several on one side, the bar is as far away as
it appears wide, and the wire touches when it begins to bend.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import singledispatch

import numpy as np

from vision.fit.problem import Problem, State
from vision.fit.solve import solve
from vision.fit.touch import (
    FEWEST_FREE,
    bends_divide_better,
    bent_frames,
    frames_by_touch,
    frames_that_touch,
    touch_and_sigma,
    unbent_frames,
)
from vision.fit.touch_by_onset import touch_by_onset
from vision.geometry.camera import Cameras
from vision.geometry.contact import BarAxis
from vision.geometry.refusals import Refused
from vision.geometry.rotation import unit
from vision.geometry.rounded import RoundedAxis
from vision.geometry.touched import Axis
from vision.touched.one_view import seen_from_one_side
from vision.truth.moving_bar import BarInFrames
from vision.truth.readers import BarEdges, BarMiddles, ObjectReader, SilhouetteReader
from vision.truth.whisk_pictures import WhiskPictures

# [rad] Frames from so far before touch on make the truth: a whisker that stands farther away is lit
# otherwise, and what its line is off by does not cancel in the differences. Strokes of 24° taken
# whole erred in slip by 0.02 mm, ten of its sigmas. Study: thresholds.py truth.strategies
# _NEAR_TOUCH_RAD ….
_NEAR_TOUCH_RAD = np.radians(3.5)
# [frames] Fewest before touch that make the truth. Study: thresholds.py truth.strategies
# _NEAR_TOUCH_RAD ….
_FEWEST_NEAR = 4
# [1] The first of so many parts of a stroke, two frames at least, is taken as free before
# anything is known. By 10 nothing moves, by 5 touch by 0.34 sigma. Study: thresholds.py truth.strategies _EARLY_PARTS ….
_EARLY_PARTS = 7.0
# [rad] Two sights nearer to each other determine no place along them. Stated.
_LEAST_SIGHTS_RAD = np.radians(8.0)
NEVER_TOUCHES = "the whisker never touches"
STARTS_TOUCHING = "touches from the start: fewer than two frames of free stroke"


@dataclass(frozen=True)
class Touch(ABC):
    """How touch is found. fewest_cameras: so many must see the wire."""

    fewest_cameras: int = 1

    @abstractmethod
    def frames_to_fit(
        self, motor: Mapping[int, float], bend: Mapping[int, np.ndarray]
    ) -> list[int]:
        """Return the frames to fit. motor, bend: by frame, motor angle and coarse bends (2,)."""

    @abstractmethod
    def split_by_bends(
        self, motor_rad: np.ndarray, bend_rad: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return which frames touch and which are free, (f,) bool each, by coarse bends (f, 2).

        Raises Refused where there is no touch.
        """

    @abstractmethod
    def with_touch(
        self, problem: Problem, state: State, covariance: np.ndarray
    ) -> tuple[Problem, State]:
        """Return problem and state with what a fit says of touch. covariance (size, size)."""

    @abstractmethod
    def split_by_fit(
        self, problem: Problem, state: State, covariance: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return which frames touch and which are free, (f,) bool each, by a fit.

        covariance (size, size): of its parameters. Raises Refused where one of both is missing.
        """


class TouchByClearance(Touch):
    """Touch is where the resting whisker reaches the object."""

    def frames_to_fit(
        self, motor: Mapping[int, float], bend: Mapping[int, np.ndarray]
    ) -> list[int]:
        """Return the frames from a little before the first that surely touches, else all."""
        frames = list(motor)
        motor_rad = np.array(list(motor.values()))
        touching, _ = frames_that_touch(motor_rad, np.array(list(bend.values())))
        if not np.any(touching):
            return frames
        first = int(np.argmax(touching))
        nearest = int(np.argmax(motor_rad > motor_rad[first] - _NEAR_TOUCH_RAD))
        return frames[min(nearest, max(first - _FEWEST_NEAR, 0)) :]

    def split_by_bends(
        self, motor_rad: np.ndarray, bend_rad: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return which frames touch and which are free. Raises Refused where all are free."""
        touching, free = frames_that_touch(motor_rad, bend_rad)
        if np.all(free):
            raise Refused(NEVER_TOUCHES, code="never_touches")
        return touching, free

    def with_touch(
        self, problem: Problem, state: State, covariance: np.ndarray
    ) -> tuple[Problem, State]:
        """Return problem and state as they are."""
        return problem, state

    def split_by_fit(
        self, problem: Problem, state: State, covariance: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return which frames touch and which are free, by the touch of the fit and its sigma.

        Where bends part them better, both count; no frame is free that surely bends, and where the
        clearance decides on none, those touch that surely bend. Raises Refused where fewer than two
        are free, or none touches.
        """
        touch_rad, sigma_rad = touch_and_sigma(problem, state.vector, covariance)
        touching, free = frames_by_touch(problem.motor_rad, touch_rad, sigma_rad)
        if bends_divide_better(problem.motor_rad, sigma_rad):
            touching_by_bends = problem.touching & ~free
            free_by_bends = ~problem.bent & ~touching
            touching = touching | touching_by_bends
            free = free | free_by_bends
        free = unbent_frames(problem, state, free)
        if np.sum(free) < FEWEST_FREE:
            raise Refused(STARTS_TOUCHING, code="starts_touching")
        if not np.any(touching):
            touching = bent_frames(problem, state, covariance) & ~free
        if not np.any(touching):
            raise Refused(NEVER_TOUCHES, code="never_touches")
        return touching, free


class TouchByOnset(Touch):
    """Touch is when the whisker begins to bend.

    Of its first frames alone it is known that they are free: a bend along the sight is not seen at
    first.
    """

    def frames_to_fit(
        self, motor: Mapping[int, float], bend: Mapping[int, np.ndarray]
    ) -> list[int]:
        """Return all frames: which touch is not known by coarse bends."""
        return list(motor)

    def split_by_bends(
        self, motor_rad: np.ndarray, bend_rad: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return which frames the coarse bends (f, 2) show to touch, and the first of the stroke."""
        free = early(motor_rad)
        return frames_that_touch(motor_rad, bend_rad)[0] & ~free, free

    def with_touch(
        self, problem: Problem, state: State, covariance: np.ndarray
    ) -> tuple[Problem, State]:
        """Return the fit with the onset of bending in place of the frames that touch."""
        problem, state = touch_by_onset(problem, state, covariance)
        return problem, solve(problem, state)[0]

    def split_by_fit(
        self, problem: Problem, state: State, covariance: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the frames after the onset, and the first part of the stroke."""
        return problem.touching, early(problem.motor_rad)


@dataclass(frozen=True)
class Strategy:
    """How the object of a whisk is read, and how touch is found."""

    reader: ObjectReader
    touch: Touch


def strategies(whisk: WhiskPictures) -> list[Strategy]:
    """Return how a whisk may be evaluated; where the first is refused, the next is tried.

    Raises Refused where the cameras cannot see such an object.
    """
    if whisk.motion is not None:
        return [_strategy_of_moving_bar(whisk)]
    return _strategies(whisk.bar.axis, whisk)


def _strategy_of_moving_bar(whisk: WhiskPictures) -> Strategy:
    """Return the strategy for a bar that moves.

    Raises Refused where the cameras do not locate it in space.
    """
    if seen_from_one_side(whisk.cameras, whisk.bar.axis) or len(whisk.views) < 2:
        raise Refused(
            "an object that moves or gives way is seen by two cameras or more, from different sides",
            code="moving_object_from_one_side",
        )
    return Strategy(BarInFrames(whisk.object_views), TouchByClearance())


@singledispatch
def _strategies(axis: Axis, whisk: WhiskPictures) -> list[Strategy]:
    """Return how a whisk against an object that stands there may be evaluated."""
    raise NotImplementedError(f"no strategy for a {whisk.rods.bar.name}")


@_strategies.register
def _strategies_of_rounded(axis: RoundedAxis, whisk: WhiskPictures) -> list[Strategy]:
    """Return the one strategy for an object that is no straight bar: by its silhouette.

    Raises Refused where all cameras are on one side of it.
    """
    if widest_sights_rad(whisk.cameras, axis.spot_mm) < _LEAST_SIGHTS_RAD:
        raise Refused(
            "an object that is no straight bar is seen by two cameras or more, from different sides",
            code="object_from_one_side",
        )
    reader = SilhouetteReader(whisk.object_views)
    return [Strategy(reader, TouchByClearance(fewest_cameras=2))]


@_strategies.register
def _strategies_of_bar(axis: BarAxis, whisk: WhiskPictures) -> list[Strategy]:
    """Return the strategies for a straight bar: by its middle, or by its edges.

    The edges are read where all cameras stand on one side of it, or a single one sees it. There the
    wire's cameras may still determine touch by clearance, two at least.
    """
    views = whisk.object_views
    seeing = [view for view in views if view.camera.name in whisk.bar.seen_by]
    edges = BarEdges(seeing or views)
    if seen_from_one_side(whisk.cameras, axis):
        return [Strategy(edges, TouchByOnset())]
    if len(seeing) == 1:
        return [
            Strategy(edges, TouchByClearance(fewest_cameras=2)),
            Strategy(BarEdges(seeing), TouchByOnset()),
        ]
    return [Strategy(BarMiddles(views), TouchByClearance())]


def widest_sights_rad(cameras: Cameras, point_mm: np.ndarray) -> float:
    """Return the angle between the most different sights of a point (3,) by two cameras, rad."""
    sights = unit(np.array([point_mm - camera.centre_mm for camera in cameras]))
    return float(np.arccos(np.clip(np.min(sights @ sights.T), -1.0, 1.0)))


def early(motor_rad: np.ndarray) -> np.ndarray:
    """Return which frames (f,) bool are the first of a stroke, two at least, to be taken as free."""
    within = motor_rad <= motor_rad[0] + (motor_rad[-1] - motor_rad[0]) / _EARLY_PARTS
    return np.arange(len(motor_rad)) < max(FEWEST_FREE, np.sum(within))
