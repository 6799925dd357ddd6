"""The truth of one trial, from another program's traces alone.

    traces → coarse rest shape and bends → wire's line points ┐
                                                              ├→ one fit over cameras and frames
    tracked points of the object, or its stated place ────────┘

Nothing here knows of a picture or of a gauge.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Self

import numpy as np

from vision.fit.problem import point_rows
from vision.fit.solve import residuals
from vision.geometry.camera import Cameras
from vision.geometry.contact import BarAxis
from vision.geometry.refusals import Refused
from vision.geometry.rods import Rods
from vision.geometry.touched import Axis
from vision.geometry.vision_settings import VisionSettings
from vision.touched.one_view import seen_from_one_side
from vision.touched.search import SeenBar
from vision.truth.coarse_traces import find_traced_rest, follow_traced_bends
from vision.truth.explanations import Explanation
from vision.truth.given_traces import TracesAlone
from vision.truth.object_places import ObjectPlace, PlacedObject, TrackedObject
from vision.truth.observe import cameras_facing, fitted_truth, nothing_seen, see_whisk, strokes_of
from vision.truth.records import TrialTruth, WhiskTruth
from vision.truth.sight import blank_view
from vision.truth.strategies import Touch, TouchByClearance, TouchByOnset, early
from vision.truth.trace_points import Trace
from vision.truth.whisk_fit import expect_by_bends, fit_lines
from vision.truth.whisk_pictures import AxisPrior, FittedWhisk, WhiskPictures

# [frames] Of a camera that is used, as of one with pictures. Derived.
_FEWEST_FRAMES = 3
# [sigmas] Of the object's lines, or of its stated place, from where the whisker touches it: trackers'
# sigmas are learnt from few places. Stated.
_MOST_APART = 5.0
_USUAL = VisionSettings()


@dataclass(frozen=True, eq=False)
class TrialTraces:
    """A trial as another program has traced it.

    traces: by camera, the wire's lines. time_s, motor_rad (n,): at each frame. place: what places the
    touched object, which stands.
    """

    traces: Mapping[str, Trace]
    time_s: np.ndarray
    motor_rad: np.ndarray
    place: ObjectPlace

    @classmethod
    def with_points(
        cls,
        traces: Mapping[str, Trace],
        time_s: np.ndarray,
        motor_rad: np.ndarray,
        points: Mapping[str, Trace],
    ) -> Self:
        """Return a trial whose bar is placed by tracked points, see `TrackedObject`."""
        return cls(traces, time_s, motor_rad, TrackedObject(points))

    @classmethod
    def with_place(
        cls,
        traces: Mapping[str, Trace],
        time_s: np.ndarray,
        motor_rad: np.ndarray,
        axis: Axis,
        sigma: np.ndarray,
    ) -> Self:
        """Return a trial whose object stands where it is stated. sigma (4,): two shifts, mm, two tilts, rad."""
        return cls(traces, time_s, motor_rad, PlacedObject(AxisPrior(axis, sigma)))

    def observe(
        self,
        whisks: Sequence[slice],
        cameras: Cameras,
        rods: Rods,
        settings: VisionSettings = _USUAL,
    ) -> TrialTruth:
        """Measure the truth from the traces: first touch, contact and slip in each whisk.

        whisks: slices of frame indices, one a forward stroke. What keeps a whisk from having a truth
        is its status.
        """
        try:
            seen = list(_prepare_whisks(self, whisks, cameras, rods, settings))
        except Refused as reason:
            return nothing_seen(whisks, reason.reason)
        rows: list[WhiskTruth] = []
        for whisk in seen:
            row, _ = see_whisk(whisk, partial(_explain, self), fitted_truth)
            rows.append(replace(row, overlay={}))  # there is no picture to draw on
        axis = seen[0].bar.axis.as_bar()
        return TrialTruth(axis.point_mm, axis.direction, tuple(rows))


def _prepare_whisks(
    recording: TrialTraces,
    whisks: Sequence[slice],
    cameras: Cameras,
    rods: Rods,
    settings: VisionSettings,
) -> Iterator[WhiskPictures]:
    """Yield the whisks with all that is known before a wire is fitted.

    Raises Refused where the object is not placed.
    """
    facing, left_out = cameras_facing(cameras, rods.wire, recording.motor_rad)
    frames = {name: np.unique(trace.frame) for name, trace in recording.traces.items()}
    names = [name for name in facing.names if len(frames.get(name, ())) >= _FEWEST_FRAMES]
    if not names:
        raise Refused("no camera has traces in three frames or more", code="no_camera_with_frames")
    used = facing.subset(names)
    views = tuple(blank_view(camera, frames[camera.name].tolist()) for camera in used)
    axis = recording.place.axis(used, rods)
    make_lines = partial(TracesAlone, traces=recording.traces, place=recording.place)
    strokes = strokes_of(whisks, len(recording.time_s), settings.every_frame)
    for number, stroke in enumerate(strokes):
        yield WhiskPictures(
            number=number,
            indices=stroke,
            time_s=recording.time_s,
            motor_rad=recording.motor_rad,
            views=views,
            cameras=used,
            rods=rods,
            bar=SeenBar(axis, {}),
            settings=replace(settings, picture_scale=1),
            left_out=tuple(left_out),
            make_lines=make_lines,
            stated_place=recording.place.prior(),
        )


def _explain(recording: TrialTraces, whisk: WhiskPictures) -> Explanation:
    """Fit a whisk's traces. Raises Refused where they determine no touch."""
    traces = recording.traces
    axis = whisk.bar.axis
    free = np.array(whisk.frames)[early(whisk.angles_rad)]
    rest_mm = find_traced_rest(traces, whisk.cameras, whisk.rods, whisk.during(free.tolist()).motor)
    bends_rad = follow_traced_bends(traces, whisk.cameras, whisk.rods, axis, rest_mm, whisk.motor)
    touch = _touch(whisk.cameras, axis)
    begun, expected = expect_by_bends(whisk, touch, rest_mm, bends_rad)
    lines = begun.make_lines(begun, recording.place.reader(begun.cameras))
    fitted = fit_lines(begun, lines, expected, touch)
    _require_one_place(fitted)
    return Explanation(whisk, fitted)


def _require_one_place(fitted: FittedWhisk) -> None:
    """Raise Refused where the whisker touches elsewhere than the object's points or its stated place are."""
    problem = fitted.problem
    over_sigma = residuals(problem, fitted.state)
    of_object = [fitted.state.vector[problem.blocks.bar_axis.slice] / problem.axis_sigma]
    of_object += [over_sigma[rows] for seen, rows in point_rows(problem) if not seen.on_wire]
    farthest = float(np.max(np.abs(np.concatenate(of_object))))
    if farthest > _MOST_APART:
        found = f"the whisker touches {farthest:.0f} sigmas from where the object is said to be"
        raise Refused(f"{found}: are both of one trial?", code="object_points_elsewhere")


def _touch(cameras: Cameras, axis: Axis) -> Touch:
    """Return how touch is found: by clearance where two cameras place the wire in space."""
    if isinstance(axis, BarAxis) and seen_from_one_side(cameras, axis):
        return TouchByOnset()
    return TouchByClearance(fewest_cameras=2)
