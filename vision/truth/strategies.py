"""How the bar is read and how touch is told: by two cameras' sights that cross, or by what a single one shows.

Two cameras know bar and wire in space: the bar's middle is enough, and touch is told by clearance. To one camera, or to
several on one side, the bar is as far away as it looks wide, and the wire touches when it begins to bend.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import singledispatch

import numpy as np

from vision.fit.problem import Problem, State
from vision.fit.solve import solve
from vision.fit.touch import (
    FEWEST_FREE,
    bends_tell_more,
    frames_by_touch,
    frames_that_touch,
    touch_and_sigma,
)
from vision.fit.touch_by_onset import touch_by_onset
from vision.geometry.camera import Cameras
from vision.geometry.contact import BarAxis
from vision.geometry.refusals import Refused
from vision.geometry.rounded import RoundedAxis
from vision.geometry.touched import Axis
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.view import View
from vision.touched.edges import measure_edges
from vision.touched.line import BarLineEstimate, measure_bars
from vision.touched.one_view import seen_from_one_side
from vision.touched.silhouette_edges import SilhouetteEdges, measure_silhouette_edges
from vision.truth.whisk_pictures import WhiskPictures
from vision.wire.points import LinePoints

# [rad, frames] Frames from so far before touch on make the truth, four at least: a whisker that
# stands farther away is lit otherwise, and what its line is off by does not cancel in the
# differences. Strokes of 24° taken whole erred in slip by 0.02 mm, ten of its sigmas. Study:
# thresholds.py truth.strategies _NEAR_TOUCH_RAD ….
_NEAR_TOUCH_RAD, _FEWEST_NEAR = np.radians(3.5), 4
# [1] The first of so many parts of a stroke, two frames at least, is taken as free before
# anything is known. Set by eye. Study: thresholds.py truth.strategies _EARLY_PARTS ….
# the first of so many parts of a stroke is taken as free before anything is known
_EARLY_PARTS = 7.0
# [px] How far off an outline may be that was settled by rough edges. Stated.
_OFF_PX = 3.0
# [nats] How much more probable an outline's edges are than edges anywhere, in all cameras: a
# wrong place said 2, true ones 3.8 to 7.9. Study: rounded_seen.py.
_LEAST_SAID = 3.0
# [stretches] Of an outline: a camera that is asked for so many and shows none contradicts the
# others, as one did that had a cone upside down. Study: rounded_seen.py.
_ASKED = 4
# [rad] Two sights nearer to each other tell no place along them, as planes through a bar do
# (`_NARROW_RAD`). Stated.
_LEAST_SIGHTS_RAD = np.radians(8.0)
NEVER_TOUCHES = "the whisker never touches"
STARTS_TOUCHING = "touches from the start: fewer than two frames of free stroke"


@dataclass
class BarMiddles:
    """The bar by its middle in each view; lines: as measured the time before, by which they are measured finely; are
    they so, they stay: another look at the same pixels tells nothing new."""

    views: Sequence[View]
    radius_mm: float
    settings: VisionSettings
    lines: dict[str, BarLineEstimate] = field(default_factory=dict)
    are_fine: bool = False

    def points(
        self, axis: BarAxis, wires_px: Mapping[str, Sequence[np.ndarray]], *, last: bool
    ) -> dict[str, dict[int, LinePoints]]:
        """By camera and side of the bar (0: its middle, see `Observed`), about an axis. See `measure_bars`.

        last: nothing is measured after it, so it is finely, too, where it is the first.
        """
        looks = 0 if self.are_fine else 2 if last and not self.lines else 1
        for _ in range(looks):
            self.are_fine = bool(self.lines)
            self.lines = measure_bars(
                self.views, axis, self.radius_mm, wires_px, self.settings, self.lines
            )
        return {name: {0: line.points} for name, line in self.lines.items() if line.is_bar}

    def observed(
        self,
        axis: BarAxis,
        came_mm: np.ndarray,
        frames: Sequence[int],
        wires_px: Mapping[str, Sequence[np.ndarray]],
        *,
        last: bool,
    ) -> dict[str, list[tuple[int, int, LinePoints]]]:
        """By camera (frame of the fit, side, points) of the bar's lines; one that stands is seen in no frame alone."""
        seen = self.points(axis, wires_px, last=last)
        return {
            name: [(0, side, points) for side, points in sides.items()]
            for name, sides in seen.items()
        }


@dataclass
class Outline:
    """A rounded object by the edges of its outline in each view; limbs: as measured the time before, by which they are
    measured finely."""

    views: Sequence[View]
    radius_mm: float
    settings: VisionSettings
    limbs: dict[str, SilhouetteEdges] = field(default_factory=dict)

    def observed(
        self,
        axis: RoundedAxis,
        came_mm: np.ndarray,
        frames: Sequence[int],
        wires_px: Mapping[str, Sequence[np.ndarray]],
        *,
        last: bool,
    ) -> dict[str, list[tuple[int, int, LinePoints]]]:
        """As `BarMiddles.observed`; all points are of an edge, against what lies within. Raises Refused where no
        outline is clear, or a camera contradicts the others."""
        for _ in range(2 if last and not self.limbs else 1):
            self.limbs = measure_silhouette_edges(
                self.views, axis, self.radius_mm, wires_px, self.settings, _OFF_PX, self.limbs
            )
        for name, limb in self.limbs.items():
            if limb.segments >= _ASKED and not len(limb.points):
                raise Refused(
                    f"camera {name} shows no edge of the object where the other cameras have it",
                    code="no_object_edge",
                )
        if sum(limb.log_evidence for limb in self.limbs.values()) < _LEAST_SAID:
            raise Refused(
                "no clear outline of the object is seen: too little of its edges stands out",
                code="no_object_outline",
            )
        return {
            name: [(0, 1, limb.points)] for name, limb in self.limbs.items() if len(limb.points)
        }


class BarEdges(BarMiddles):
    """The bar by its two edges (sides -1 and 1), which tell how far away it is; by its middle where these are not
    seen."""

    def points(
        self, axis: BarAxis, wires_px: Mapping[str, Sequence[np.ndarray]], *, last: bool
    ) -> dict[str, dict[int, LinePoints]]:
        """See `BarMiddles.points`."""
        found = super().points(axis, wires_px, last=last)
        for view in self.views:
            name = view.camera.name
            edges = measure_edges(view, axis, self.radius_mm, wires_px[name], self.settings)
            found |= {name: edges} if edges else {}
        return found


@dataclass(frozen=True)
class TouchByClearance:
    """Touch is where the resting whisker reaches the bar. fewest_cameras: so many must see the wire."""

    fewest_cameras: int = 1

    def near(self, motor: Mapping[int, float], bend: Mapping[int, np.ndarray]) -> list[int]:
        """The frames to fit, by coarse bends (2,) in all: from a little before the first that surely touches."""
        angles = np.array(list(motor.values()))
        touching, _ = frames_that_touch(angles, np.array(list(bend.values())))
        if not np.any(touching):
            return list(motor)
        first = int(np.argmax(touching))
        begin = min(
            int(np.argmax(angles > angles[first] - _NEAR_TOUCH_RAD)), max(first - _FEWEST_NEAR, 0)
        )
        return list(motor)[begin:]

    def first(self, motor_rad: np.ndarray, bend_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which frames touch, and which are free, (f,) bool each, by coarse bends (f, 2). Raises Refused."""
        touching, free = frames_that_touch(motor_rad, bend_rad)
        if not np.any(touching):
            raise Refused(NEVER_TOUCHES, code="never_touches")
        return touching, free

    def settled(
        self, problem: Problem, state: State, covariance: np.ndarray
    ) -> tuple[Problem, State]:
        """Problem and state with what the fit tells of touch, from its covariance (size, size)."""
        return problem, state

    def parted(
        self, problem: Problem, state: State, answer: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """`first` once more, by a fit. answer (size, size): how its parameters answer. Raises Refused."""
        touch_rad, sigma_rad = touch_and_sigma(problem, state.vector, answer)
        touching, free = frames_by_touch(problem.motor_rad, touch_rad, sigma_rad)
        if bends_tell_more(problem.motor_rad, sigma_rad):
            touching, free = touching | problem.touching & ~free, free | ~problem.bent & ~touching
        if np.sum(free) < FEWEST_FREE:
            raise Refused(STARTS_TOUCHING, code="starts_touching")
        if not np.any(touching):
            raise Refused(NEVER_TOUCHES, code="never_touches")
        return touching, free


@dataclass(frozen=True)
class TouchByOnset:
    """Touch is when the whisker begins to bend: of its first frames alone it is known that they are free, as a bend
    along the sight is not seen at first. Methods as those of `TouchByClearance`."""

    fewest_cameras: int = 1

    def near(self, motor: Mapping[int, float], bend: Mapping[int, np.ndarray]) -> list[int]:
        """All frames: what the coarse bend says of touch is not known."""
        return list(motor)

    def first(self, motor_rad: np.ndarray, bend_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Those that the coarse bends (f, 2) show to touch, beyond the first part of the stroke."""
        free = early(motor_rad)
        return frames_that_touch(motor_rad, bend_rad)[0] & ~free, free

    def settled(
        self, problem: Problem, state: State, covariance: np.ndarray
    ) -> tuple[Problem, State]:
        """The fit with the onset of bending in place of the frames that were taken to touch."""
        problem, state = touch_by_onset(problem, state, covariance)
        return problem, solve(problem, state)[0]

    def parted(
        self, problem: Problem, state: State, answer: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The frames after the onset, and again the first part of the stroke."""
        return problem.touching, early(problem.motor_rad)


Touch = TouchByClearance | TouchByOnset


Reader = BarMiddles | Outline


def ways_to_see(whisk: WhiskPictures) -> list[tuple[Reader, Touch]]:
    """Return the ways to see a whisk; where the first is refused, the next is taken.

    Raises Refused where the cameras cannot see such an object.
    """
    return _ways_to_see(whisk.bar.axis, whisk)


@singledispatch
def _ways_to_see(axis: Axis, whisk: WhiskPictures) -> list[tuple[Reader, Touch]]:
    """Return the ways to see a whisk against what stands there."""
    raise NotImplementedError(f"no way to see a {whisk.rods.bar.name}")


@_ways_to_see.register
def _ways_to_see_rounded(axis: RoundedAxis, whisk: WhiskPictures) -> list[tuple[Reader, Touch]]:
    """Return the one way to see an object that is no straight bar: by its silhouette.

    Raises Refused where all cameras are on one side of it.
    """
    if widest_sights_rad(whisk.cameras, axis.spot_mm) < _LEAST_SIGHTS_RAD:
        raise Refused(
            "an object that is no straight bar is seen by two cameras or more, from different sides",
            code="object_from_one_side",
        )
    reader = Outline(whisk.views, whisk.rods.bar.radius_mm, whisk.settings)
    return [(reader, TouchByClearance(fewest_cameras=2))]


@_ways_to_see.register
def _ways_to_see_bar(axis: BarAxis, whisk: WhiskPictures) -> list[tuple[Reader, Touch]]:
    """Return the ways to see a straight bar: by its middle, or by its edges.

    The edges are read where all cameras stand on one side of it, or a single one sees it. There the
    wire's cameras may still determine touch by clearance, two at least.
    """
    radius_mm = whisk.rods.bar.radius_mm
    seeing = [view for view in whisk.views if view.camera.name in whisk.bar.seen_by]
    if seen_from_one_side(whisk.cameras, axis):
        return [(BarEdges(seeing or whisk.views, radius_mm, whisk.settings), TouchByOnset())]
    if len(seeing) == 1:
        by_clearance = BarEdges(seeing, radius_mm, whisk.settings)
        by_onset = BarEdges(seeing, radius_mm, whisk.settings)
        return [(by_clearance, TouchByClearance(fewest_cameras=2)), (by_onset, TouchByOnset())]
    return [(BarMiddles(whisk.views, radius_mm, whisk.settings), TouchByClearance())]


def widest_sights_rad(cameras: Cameras, point_mm: np.ndarray) -> float:
    """Between the sights of a point (3,) of the two cameras that see it from the most different sides."""
    sights = np.array([point_mm - camera.centre_mm for camera in cameras])
    sights /= np.linalg.norm(sights, axis=1, keepdims=True)
    return float(np.arccos(np.clip(np.min(sights @ sights.T), -1.0, 1.0)))


def early(motor_rad: np.ndarray) -> np.ndarray:
    """The frames (f,) bool of the first part of the stroke, two at least, that are taken as free for a first look."""
    within = motor_rad <= motor_rad[0] + (motor_rad[-1] - motor_rad[0]) / _EARLY_PARTS
    return np.arange(len(motor_rad)) < max(FEWEST_FREE, np.sum(within))
