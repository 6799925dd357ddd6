"""The truth of one whisk while it is recorded: little work is left after the last frame.

The steps are those of `vision.truth`, with the same physics and the same sigmas, but each is taken
as soon as its frames are there:

    frames 0 to 2      the touched object; the wire's rest shape; lines of both, and a fit to them;
                       the object's lines finely; the wire's shading and the lens blur
    each frame         the wire's bend, by votes near the extrapolation of the last two; its line, by
                       the shading of the first frames
    frame 4            where else the bar may be
    the last frame     its bend, its line, one fit, and whether another place explains the bar better

The first step is the costly one; best is a camera that runs before the motor does. `LiveWhisk.add`
only keeps a picture, `LiveWhisk.work` takes the next step that is due, and `LiveWhisk.finish` all that
are left. A program that records calls `work` while it waits for the next frame. What passes on:

    LiveBench ─► LiveWhisk ─► _FirstViews (cameras, object) ─► _Follower (rest shape, bends)
                                  ─► _LineReading (blur, strategy), WireLines (the wire's line) ─► WhiskTruth

Where `vision.truth.observe` would leave a camera out or try another place of the bar, there is no
number here, and the status says why: the recording can still be evaluated as any other.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vision.fit.first_bends import SwingPictures, find_bend, find_rest, next_bend
from vision.fit.touch import frames_that_touch
from vision.geometry.camera import Cameras
from vision.geometry.number_words import counted
from vision.geometry.reasons import Reason, joined
from vision.geometry.refusals import Refused
from vision.geometry.rods import Rods
from vision.geometry.touched import Axis
from vision.geometry.vision_settings import VisionSettings
from vision.live.wire_lines import CarriedLines, WireLines, frames_lit_alike
from vision.pictures.view import View
from vision.touched.search import SeenBar, find_object, find_object_again
from vision.touched.search_scene import SearchScene
from vision.truth.explanations import Explanation, compare_early, unexplained
from vision.truth.line_source import EarlierWhisk
from vision.truth.observe import views_facing, warnings_of, why_failed
from vision.truth.place_comparison import FRAMES, PlaceComparison
from vision.truth.records import WhiskTruth
from vision.truth.strategies import Strategy, strategies
from vision.truth.traced_lines import TracedLines
from vision.truth.trial_pictures import TrialPictures
from vision.truth.truth_rows import DRAWN_MM, DRAWN_POINTS, to_whisk
from vision.truth.whisk_fit import (
    check_scatter,
    coarse_curves,
    expect_by_bends,
    fit_before_touch,
    fit_last,
    require_cameras,
)
from vision.truth.whisk_pictures import FittedWhisk, WhiskPictures
from vision.truth.whisk_place import WhiskPlace

# [frames] With which work begins: two give the noise, a third what moves. In fifteen path-traced
# scenes the bar was as near by three frames as by all. Study: tests/studies/speed/live.py.
FIRST_FRAMES = 3
# [rad] A motor that turns by less from frame to frame stands: a motor's step. Stated.
_STANDING_RAD = np.radians(0.02)
# [diameters] Of the whisker, by which its tip has moved from the first frame to the last where their median
# stands for the scene without it; where less, the scene known before is taken. With 2, from where on no
# pixel shows it in half of the frames, three scenes move by 0.26 sigma at most. Study: thresholds.py.
_SWEPT_DIAMETERS = 0.5

_DEFAULT = VisionSettings()


@dataclass(frozen=True, eq=False)
class LiveBench:
    """What is known before a whisk.

    background: by camera the scene (h, w) without whisker and bar. stroke_rad: lowest and highest
    motor angle of the stroke to come. settings: all but picture_scale, every_frame and rounds, which
    a live whisk does without. earlier: what the whisk before has shown.
    """

    cameras: Cameras
    rods: Rods
    background: Mapping[str, np.ndarray | None]
    stroke_rad: tuple[float, float]
    settings: VisionSettings = _DEFAULT
    earlier: EarlierWhisk | None = None


@dataclass(frozen=True, eq=False)
class _FirstViews:
    """The cameras that face the whisker, their first frames, and the object.

    bar: found in the first frames, and moved to where the fit to the free frames has it.
    """

    views: tuple[View, ...]
    cameras: Cameras
    left_out: tuple[Reason, ...]
    bar: SeenBar


@dataclass(eq=False)
class _Follower:
    """Finds the wire's bend (2,), rad, frame by frame, about a rest shape (2, 4), mm, and an object.

    sights: a camera each, with what stood still in the frames that it was made from. bends_rad: by
    frame.
    """

    sights: list[SwingPictures]
    axis: Axis
    rest_mm: np.ndarray
    bends_rad: dict[int, np.ndarray] = field(default_factory=dict)

    def follow(self, frame: int, motor_rad: float, views: Sequence[View]) -> None:
        """Find the bend in the next frame, which the views have."""
        guess_rad = next_bend(self.bends_rad.values())
        sights = [replace(sight, view=view) for sight, view in zip(self.sights, views)]
        self.bends_rad[frame] = find_bend(
            sights, self.axis, self.rest_mm, frame, motor_rad, guess_rad
        )

    def free_frames(self, motor_rad: Mapping[int, float]) -> list[int]:
        """Return the frames that do not touch by their bends."""
        angles_rad = np.array([motor_rad[frame] for frame in self.bends_rad])
        if np.ptp(angles_rad) < _STANDING_RAD:
            return list(self.bends_rad)
        _, is_free = frames_that_touch(angles_rad, np.array(list(self.bends_rad.values())))
        return [frame for frame, free in zip(self.bends_rad, is_free) if free]


@dataclass(frozen=True, eq=False)
class _LineReading:
    """How the last lines are read: what the fit to the free frames chose and measured.

    blur_px: of each camera's lens.
    """

    strategy: Strategy
    blur_px: Mapping[str, float]


@dataclass(eq=False)
class LiveWhisk:
    """One whisk that is being recorded.

    frames: by camera the pictures so far, by frame. time_s, motor_rad: by frame. refused: why there
    will be no truth, None as long as nothing says so. shown: what the next whisk begins from, None before
    the truth and without one.
    """

    bench: LiveBench
    number: int = 0
    frames: dict[str, dict[int, np.ndarray]] = field(default_factory=dict)
    time_s: dict[int, float] = field(default_factory=dict)
    motor_rad: dict[int, float] = field(default_factory=dict)
    refused: Reason | None = None
    shown: EarlierWhisk | None = None
    _standing: set[int] = field(default_factory=set)
    _found: _FirstViews | None = None
    _follower: _Follower | None = None
    _reading: _LineReading | None = None
    _is_bar_fine: bool = False
    _wire: WireLines | None = None
    _comparison: PlaceComparison | None = None
    _is_compared: bool = False

    def add(
        self, camera: str, frame: int, time_s: float, motor_rad: float, picture: np.ndarray
    ) -> None:
        """Keep a camera's grey picture (h, w) of a frame, its time and the motor's angle; no work.

        Frames come in order; one that a camera lost is left out. Of frames in which the motor stands
        only the first few are kept.
        """
        if frame not in self.motor_rad and self._stands(motor_rad):
            self._standing.add(frame)
        if frame in self._standing:
            return
        self.frames.setdefault(camera, {})[frame] = picture
        self.time_s[frame] = time_s
        self.motor_rad[frame] = motor_rad

    def _stands(self, motor_rad: float) -> bool:
        """Return whether the motor stands since the frame before, and there are frames enough to begin."""
        if len(self.motor_rad) < FIRST_FRAMES:
            return False
        *_, before_rad = self.motor_rad.values()
        return abs(motor_rad - before_rad) < _STANDING_RAD

    def work(self) -> bool:
        """Take the next step that is due. Return whether there was one."""
        step = self._step_due()
        if step is None:
            return False
        try:
            step()
        except (Refused, np.linalg.LinAlgError) as reason:
            if self.bench.earlier is not None and self._reading is None:
                self._forget_earlier()
            else:
                self.refused = why_failed(reason)
        return True

    def _forget_earlier(self) -> None:
        """Begin again without the whisk before, since when the wire may have slipped in its hub."""
        self.bench = replace(self.bench, earlier=None)
        self._follower = None

    def finish(self) -> WhiskTruth:
        """Return the truth by all frames, without a number where its status says why."""
        while self.work():
            pass
        if self.refused is None:
            try:
                return self._truth()
            except (Refused, np.linalg.LinAlgError) as reason:
                self.refused = why_failed(reason)
        return self._without_truth(self.refused)

    def lines_px(self) -> dict[str, dict[str, np.ndarray]]:
        """Return what is known so far, as lines (m, 2) px by camera and name.

        `bar_left` and `bar_right` are the object's edges, `wire` the whisker in the last frame whose bend
        is known; {} as long as nothing is.
        """
        if self._found is None:
            return {}
        bar = self.bench.rods.bar
        drawn = {}
        for view in self._found.views:
            left, right = self._found.bar.axis.edges_px(
                view.camera, bar.radius_mm, DRAWN_MM, DRAWN_POINTS
            )
            drawn[view.camera.name] = {"bar_left": left, "bar_right": right}
        if self._follower is not None and self._follower.bends_rad:
            whisk = self._whisk()
            curve = self._place(whisk).curves[whisk.frames[-1]]
            for view in self._found.views:
                drawn[view.camera.name]["wire"] = view.camera.project(curve.points_mm)
        return drawn

    def _step_due(self) -> Callable[[], None] | None:
        """Return the next step, in the order of the module's introduction; None where it waits for a frame."""
        if self.refused is not None:
            return None
        if self._found is None:
            is_due = len(self._shared_frames()) >= FIRST_FRAMES
            return self._find if is_due else None
        if self._follower is None:
            return self._find_rest
        if self._next_frame() is not None:
            return self._follow
        if self._reading is None:
            return self._fit_free
        if not self._is_bar_fine:
            return self._measure_bar
        last = list(self._follower.bends_rad)[-1]
        if self._wire is None or not self._wire.is_lit_alike(self.motor_rad[last]):
            return self._trace_wire
        if last not in self._wire.frames:
            return self._carry_on
        is_due = len(self._wire.frames) >= FRAMES and not self._is_compared
        return self._compare_places if is_due else None

    def _shared_frames(self) -> list[int]:
        """Return the frames that every camera has."""
        names = self.bench.cameras.names if self._found is None else self._found.cameras.names
        return [f for f in self.time_s if all(f in self.frames.get(name, ()) for name in names)]

    def _next_frame(self) -> int | None:
        """Return the frame after the last whose bend is known; None where there is none yet."""
        last = max(self._follower.bends_rad, default=-1)
        return min((f for f in self._shared_frames() if f > last), default=None)

    def _by_frame(self, values: Mapping[int, float]) -> np.ndarray:
        """Return values (n,) of all frames up to the last, NaN for those that are missing."""
        count = max(values) + 1
        return np.array([values.get(frame, np.nan) for frame in range(count)])

    def _views(self, frames: Sequence[int]) -> tuple[View, ...]:
        """Return the views with these frames alone."""
        views = []
        for view in self._found.views:
            pictures = self.frames[view.camera.name]
            views.append(replace(view, frames={frame: pictures[frame] for frame in frames}))
        return tuple(views)

    def _find(self) -> None:
        """Find the object in the first frames. Raises Refused where none is seen."""
        bench = self.bench
        first = self._shared_frames()[:FIRST_FRAMES]
        pictures = TrialPictures(
            {name: {f: self.frames[name][f] for f in first} for name in bench.cameras.names},
            self._by_frame(self.time_s),
            self._by_frame(self.motor_rad),
            bench.background,
        )
        stroke_rad = np.array(bench.stroke_rad)
        views, cameras, left_out = views_facing(
            pictures, bench.cameras, bench.rods.wire, stroke_rad
        )
        scene = SearchScene(views, cameras, bench.rods, stroke_rad, bench.settings)
        if bench.earlier is None:
            bar = find_object(scene)
        else:
            bar = find_object_again(scene, bench.earlier.axis)
        self._found = _FirstViews(tuple(views), cameras, tuple(left_out), bar)

    def _find_rest(self) -> None:
        """Find the wire's rest shape in the first frames. Raises Refused where none is seen."""
        found = self._found
        axis = found.bar.axis
        motor = {f: self.motor_rad[f] for f in found.views[0].frames}
        sights = self._sights(found.views, axis)
        if self.bench.earlier is None:
            rest_mm = find_rest(sights, found.cameras, axis, motor)
        else:
            rest_mm = self.bench.earlier.rest_mm
        self._follower = _Follower(sights, axis, rest_mm)

    def _sights(self, views: Sequence[View], axis: Axis) -> list[SwingPictures]:
        """Return what stands still in the frames of some views."""
        rods = self.bench.rods
        radius_mm = rods.bar.radius_mm
        if not self._has_swung(list(views[0].frames)):
            return [SwingPictures.of_standing(view, rods, axis, radius_mm) for view in views]
        return [SwingPictures.of(view, rods, axis, list(view.frames), radius_mm) for view in views]

    def _has_swung(self, frames: Sequence[int]) -> bool:
        """Return whether the whisker moves in some frames by as much as to vanish in their median."""
        wire = self.bench.rods.wire
        swept_mm = wire.length_mm * np.ptp([self.motor_rad[frame] for frame in frames])
        return bool(swept_mm > _SWEPT_DIAMETERS * wire.diameter_mm)

    def _follow(self) -> None:
        """Find the wire's bend in the next frame."""
        follower = self._follower
        frame = self._next_frame()
        before = list(follower.bends_rad)
        if before and not self._has_swung(before) and self._has_swung([*before, frame]):
            follower.sights = self._sights(self._views([*before, frame]), follower.axis)
        follower.follow(frame, self.motor_rad[frame], self._views([frame]))

    def _whisk(self) -> WhiskPictures:
        """Return the whisk in the frames whose bends are known."""
        found = self._found
        frames = list(self._follower.bends_rad)
        return WhiskPictures(
            self.number,
            frames,
            self._by_frame(self.time_s),
            self._by_frame(self.motor_rad),
            self._views(frames),
            found.cameras,
            self.bench.rods,
            found.bar,
            self.bench.settings,
            left_out=found.left_out,
        )

    def _fit_free(self) -> None:
        """Fit the free frames so far, and follow the later ones about what that shows.

        Raises Refused where their lines are not seen, or are not those of one wire.
        """
        follower = self._follower
        whisk = self._whisk().during(follower.free_frames(self.motor_rad))
        strategy = strategies(whisk)[0]
        lines = TracedLines(whisk, strategy.reader)
        if self.bench.earlier is not None:
            lines.begin_as(self.bench.earlier)
        axis, rest_mm = fit_before_touch(whisk, lines, follower.rest_mm)
        self._reading = _LineReading(strategy, lines.blur_px)
        self._found = replace(self._found, bar=replace(self._found.bar, axis=axis))
        sights = self._sights(whisk.views, axis)
        self._follower = _Follower(sights, axis, rest_mm, follower.bends_rad)

    def _measure_bar(self) -> None:
        """Measure the object's lines finely, about where the free frames have it."""
        whisk = self._whisk()
        lines = TracedLines(whisk, self._reading.strategy.reader)
        lines.object_points(self._place(whisk), last=True)
        self._is_bar_fine = True

    def _place(self, whisk: WhiskPictures) -> WhiskPlace:
        """Return where object and wire are in the frames of a whisk, by the wire's bends."""
        follower = self._follower
        curves, _ = coarse_curves(whisk, follower.rest_mm, follower.bends_rad)
        return WhiskPlace(whisk.bar.axis, curves, whisk.bar_swept_mm)

    def _trace_wire(self) -> None:
        """Trace the wire in the frames so far in which it is lit alike."""
        whisk = self._whisk()
        whisk = whisk.during(frames_lit_alike(whisk.frames, self.motor_rad))
        self._wire = WireLines.trace(whisk, self._place(whisk), self._reading.blur_px)

    def _carry_on(self) -> None:
        """Find the wire in the frames that came since it was traced."""
        whisk = self._whisk()
        known = self._wire.frames
        whisk = whisk.during([frame for frame in whisk.frames if frame > known[-1]])
        self._wire.carry_on(whisk, self._place(whisk))

    def _compare_places(self) -> None:
        """Compare the bar's place by the free frames with others nearby."""
        whisk = self._whisk()
        self._comparison = compare_early(whisk, self._place(whisk).curves)
        self._is_compared = True

    def _truth(self) -> WhiskTruth:
        """Return the truth by all frames. Raises Refused where they determine none."""
        if self._wire is None:
            few = f"{counted(len(self._shared_frames()), 'frame')} seen by every camera"
            raise Refused(f"{few}, {FIRST_FRAMES} are needed", code="too_few_frames")
        follower = self._follower
        strategy = self._reading.strategy
        whisk = replace(self._whisk().during(self._wire.frames), light=self._wire.light)
        bends_rad = {frame: follower.bends_rad[frame] for frame in whisk.frames}
        whisk, expected = expect_by_bends(whisk, strategy.touch, follower.rest_mm, bends_rad)
        lines = CarriedLines(whisk, strategy.reader, wire=self._wire)
        fitted = fit_last(whisk, lines, expected, strategy.touch)
        require_cameras(fitted.problem.seen, strategy.touch)
        check_scatter(fitted, lines.most_scatter_px)
        return self._unless_elsewhere(whisk, fitted)

    def _unless_elsewhere(self, whisk: WhiskPictures, fitted: FittedWhisk) -> WhiskTruth:
        """Return the truth that was fitted; none where another place explains the object better."""
        explanation = Explanation(whisk, fitted)
        elsewhere = unexplained(explanation, self._comparison)
        if elsewhere:
            return self._without_truth(elsewhere)
        truth = to_whisk(whisk, fitted)
        self.shown = EarlierWhisk(explanation.axis, fitted.rest_mm, self._reading.blur_px)
        return replace(truth, status=joined(truth.status, *warnings_of(whisk, fitted, beam=None)))

    def _without_truth(self, status: Reason) -> WhiskTruth:
        """Return the row of a whisk without a truth."""
        frames = [] if self._follower is None else list(self._follower.bends_rad)
        cameras = self.bench.cameras if self._found is None else self._found.cameras
        left_out = () if self._found is None else self._found.left_out
        return WhiskTruth(
            self.number,
            None,
            cameras=len(cameras),
            frames_used=len(frames),
            status=joined(status, *left_out),
        )
