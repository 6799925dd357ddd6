"""One whisk in a trial's pictures, with what is known beforehand, and the fit to them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from vision.fit.bend_onset import Onset
from vision.fit.blocks import BAR_PRIOR
from vision.fit.converged_fit import ConvergedFit
from vision.fit.exposure import Exposure, slip_in_exposure
from vision.fit.motion import Gives, Motion, StatedVelocity, Yielding
from vision.fit.one_camera_less import OneLess, covariance_of, leave_out_each
from vision.fit.touch import first_touch
from vision.geometry.camera import Cameras
from vision.geometry.centreline import Curves
from vision.geometry.reasons import Reason
from vision.geometry.rods import Rods
from vision.geometry.sampling import spread
from vision.geometry.touched import Axis
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.view import View
from vision.touched.object_view import ObjectView
from vision.touched.search import SeenBar
from vision.truth.line_source import EarlierWhisk, LineSource, StrokeBends
from vision.truth.value import Value, propagated_sigma
from vision.wire.one_sided import WireAppearance

# [rad] A bar begins to give way at touch: a tenth of a micrometre there, less than the contact's
# own sigma. Derived.
_EXACT_RAD = 1e-6
# [rad] Of a whisk that ends at touch, so that nothing is divided by 0. Derived.
_LEAST_SPAN_RAD = 1e-4
# [1] Of the frames that the best camera has: a camera with fewer costs more frames than it adds
# precision. 0.5 to 0.9 move nothing on the fixtures. Study: thresholds.py truth.whisk_pictures
# _FEWEST_SHARE ….
_FEWEST_SHARE = 0.7


@dataclass(frozen=True, eq=False)
class AxisPrior:
    """Where the touched object is believed to stand, before a line of it is seen.

    axis: counted from there. sigma (4,): two shifts, mm, and two tilts, rad, across it.
    """

    axis: Axis
    sigma: np.ndarray


@dataclass(frozen=True, eq=False)
class WhiskPictures:
    """One whisk in the pictures of a trial.

    indices: the frames of the stroke. time_s, motor_rad (n,): at every frame of the trial. light:
    filled with how each camera sees the wire. left_out: a line on each camera that is not used.
    stated_velocity: of a bar that moves. gives: of one that gives way. make_lines: makes the source of
    the whisk's lines, by arguments as of `vision.truth.traced_lines.TracedLines`. picture_of: as of
    `TrialPictures`. stated_place: of an object whose place is known without its lines. earlier: of the
    whisk before in the same trial.
    """

    number: int
    indices: Sequence[int]
    time_s: np.ndarray
    motor_rad: np.ndarray
    views: tuple[View, ...]
    cameras: Cameras
    rods: Rods
    bar: SeenBar
    settings: VisionSettings
    light: dict[str, WireAppearance] = field(default_factory=dict)
    left_out: tuple[Reason, ...] = ()
    stated_velocity: StatedVelocity | None = None
    gives: Gives | None = None
    make_lines: Callable[..., LineSource] | None = None
    picture_of: Mapping[str, str] = field(default_factory=dict)
    stated_place: AxisPrior | None = None
    earlier: EarlierWhisk | None = None

    def axis_prior(self, axis: Axis) -> AxisPrior:
        """Return what is believed of the object's place: what is stated, or that it is about the axis of the pass before."""
        return self.stated_place or AxisPrior(axis, BAR_PRIOR)

    @property
    def motion(self) -> Motion | Yielding | None:
        """Return the motion of the bar through the frames; None where it stands."""
        if self.gives is not None:
            return Yielding(self.gives, self.angles_rad, self.bar.axis.direction)
        if self.stated_velocity is None:
            return None
        return Motion.steady(self.stated_velocity, self.time_s[self.frames])

    @property
    def onset(self) -> Onset | None:
        """Return when a bar begins to give way, which is when the unbent whisker touches it."""
        return None if self.gives is None else Onset(self.gives.touch_rad, _EXACT_RAD)

    def yielding(self, came_mm: np.ndarray, touch_rad: float) -> "WhiskPictures":
        """Return the whisk with the displacements (f, 3) of a bar that gives way, and the angle of
        its touch.
        """
        if self.gives is None:
            return self
        span_rad = max(float(self.angles_rad.max()) - touch_rad, _LEAST_SPAN_RAD)
        farthest_mm = float(np.linalg.norm(came_mm, axis=1).max())
        return replace(self, gives=Gives(touch_rad, span_rad, farthest_mm))

    def yielding_as(self, fit: ConvergedFit) -> "WhiskPictures":
        """Return the whisk with the displacements and the touch of a fit, see `yielding`."""
        if self.gives is None:
            return self
        touch_rad = float(first_touch(fit.problem, fit.state.vector).motor_rad)
        return self.yielding(fit.shifts_mm, touch_rad)

    @property
    def object_views(self) -> list[ObjectView]:
        """Return the views of the touched object, before any wire is known."""
        radius_mm = self.rods.bar.radius_mm
        return [ObjectView(view, radius_mm, self.settings) for view in self.views]

    @property
    def bar_swept_mm(self) -> float:
        """Return the radius about its axis within which the bar stays through the whisk."""
        farthest_mm = 0.0
        if self.gives is not None:
            farthest_mm = self.gives.most_mm
        elif self.stated_velocity is not None:
            distances_mm = np.linalg.norm(self.motion.expected_mm, axis=1)
            farthest_mm = float(distances_mm.max(initial=0.0))
        return self.rods.bar.radius_mm + farthest_mm

    @cached_property
    def frames(self) -> list[int]:
        """Return the frames that every camera has."""
        return [f for f in self.indices if all(f in view.frames for view in self.views)]

    @cached_property
    def motor(self) -> dict[int, float]:
        """Return the motor angle, rad, by frame, of the frames that every camera has."""
        return {f: float(self.motor_rad[f]) for f in self.frames}

    @property
    def angles_rad(self) -> np.ndarray:
        """Return the motor angles (f,) of the frames that every camera has."""
        return self.motor_rad[self.frames]

    def during(self, frames: Sequence[int]) -> "WhiskPictures":
        """Return the whisk in some of its frames."""
        return replace(self, indices=frames)

    @property
    def is_thinned(self) -> bool:
        """Return whether only some frames of the stroke are used."""
        return isinstance(self.indices, range) and abs(self.indices.step) > 1

    def with_all_frames(self) -> "WhiskPictures":
        """Return the whisk in every frame of a stroke that was thinned."""
        thinned = self.indices
        return self.during(range(thinned.start, thinned.stop, int(np.sign(thinned.step))))

    def without_gaps(self) -> "WhiskPictures":
        """Return the whisk by the cameras that have most of its frames: one camera's gaps are not
        all cameras'.
        """
        counts = {}
        for view in self.views:
            counts[view.camera.name] = sum(f in view.frames for f in self.indices)
        fewest = _FEWEST_SHARE * max(counts.values())
        lines = []
        for name, count in counts.items():
            if count <= fewest:
                sentence = f"camera {name} was left out: {count} frames of {len(self.indices)}"
                lines.append(Reason("camera_with_few_frames", sentence))
        kept = self._by([name for name, count in counts.items() if count > fewest])
        return replace(kept, left_out=(*lines, *self.left_out))

    def without(self, camera: str, line: Reason) -> "WhiskPictures":
        """Return the whisk by the other cameras, and a line on why."""
        others = [view.camera.name for view in self.views if view.camera.name != camera]
        return replace(self._by(others), left_out=(*self.left_out, line))

    def _by(self, names: list[str]) -> "WhiskPictures":
        """Return the whisk by the cameras of these names."""
        views = tuple(view for view in self.views if view.camera.name in names)
        return replace(self, views=views, cameras=self.cameras.subset(names))


@dataclass(frozen=True, eq=False)
class FittedWhisk(ConvergedFit):
    """The fit to a whisk's pictures: frames are those in it. lines: the source of its lines."""

    frames: list[int]
    lines: LineSource | None = None

    @cached_property
    def exposure(self) -> Exposure:
        """Return the slip while the shutter was open."""
        return slip_in_exposure(self)

    @cached_property
    def one_less(self) -> list[OneLess]:
        """Return the fits without each of its cameras."""
        return leave_out_each(self)

    @cached_property
    def covariance(self) -> np.ndarray:
        """Return the covariance (size, size) of the parameters, slip within the exposure and
        contradictions between the cameras included.
        """
        contradictions = covariance_of(self.one_less, self.problem.size)
        return self.fit_covariance + self.exposure.covariance + contradictions

    def some_curves(self, count: int) -> dict[int, Curves]:
        """Return the centrelines of so many frames spread over the whisk, by frame."""
        return {self.frames[k]: self.curves.one(k) for k in spread(range(len(self.frames)), count)}

    @property
    def stroke_bends(self) -> StrokeBends:
        """Return the wire's bends over its stroke."""
        return StrokeBends(self.frames, self.problem.motor_rad, self.bend_rad)

    def of_whisk(self, name: str) -> Value:
        """Return a quantity of the whole whisk by its name."""
        sigma = propagated_sigma(self.by_parameter.whisk[name], self.covariance)
        return Value(float(self.measured.whisk[name]), float(sigma))

    def of_frames(self, name: str) -> Value:
        """Return a quantity of each frame (f,) by its name."""
        sigma = propagated_sigma(self.by_parameter.frame[name], self.covariance)
        return Value(self.measured.frame[name], sigma)
