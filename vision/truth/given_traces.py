"""Lines of the wire that another program has drawn into a whisk's pictures.

A tracker gives points of one or several lines in each frame, a point a pixel or a point a joint.
Its errors are smooth along the wire and stay from frame to frame: the points are averaged over
segments as long as those that our own lines are measured in, and their sigma, where none is stated,
is their scatter about the curve of the pass before. What neighbours share is measured by the fit
(`vision.fit.scatter`). What all frames share hides in the rest shape; it has a prior of its own.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves
from vision.geometry.refusals import Refused
from vision.geometry.robust import robust_sigma
from vision.pictures.view import View
from vision.truth.misread_traces import misreadings
from vision.truth.object_places import ObjectPlace
from vision.truth.trace_points import (
    LEAST_SIGMA_PX,
    NEAR_PX,
    BesideWire,
    Trace,
    averaged,
    beside_wire,
    distances_px,
    points_of_wire,
)
from vision.truth.traced_lines import BESIDE_BAR_PX, TracedLines
from vision.truth.whisk_place import WhiskPlace
from vision.wire.points import SHARED, LinePoints, Observed
from vision.wire.trace import NEAR_CLAMP_MM, clear_of_bar, observed

# [1] Of the frames with a trace: where fewer have one near the wire, the trace is of something
# else. Stated.
_LEAST_NEAR = 0.5
# [px] From the wire, of a trace that may be of something else: the first pass is off by a pixel or two. Stated.
_FIRST_PASS_PX = 1.0
# [1] Of a trace's distance from the wire, that of one that is meant otherwise. Stated.
_NEARER = 0.5
# [px] About the fit, at most: a tracker that scatters by more draws no line of one wire. Stated.
_MOST_SCATTER_PX = 3.0
# [1] Of the points' sigma: what a line is off by in all frames alike, in each of SHARED shapes along
# the wire (Legendre's polynomials). Study: given_traces.py.
_LASTING_SHARE = 0.5


@dataclass
class GivenTraces(TracedLines):
    """The wire's lines as another program has drawn them; the object's as the pictures show them.

    traces: by camera; one without gives no line of the wire.
    """

    traces: Mapping[str, Trace] = field(default_factory=dict)

    @property
    def most_scatter_px(self) -> float:
        """Return by how much a camera's points may scatter about a wire, px."""
        return _MOST_SCATTER_PX

    def wire_points(self, place: WhiskPlace, *, last: bool) -> dict[str, list[Observed]]:
        """Return by camera the points of the traces near the wire's curves.

        Raises Refused where a trace is nowhere near the wire.
        """
        found = {}
        for view in self.whisk.views:
            trace = self.traces.get(view.camera.name)
            found[view.camera.name] = [] if trace is None else self._points(view, trace, place)
        return found

    def _points(self, view: View, trace: Trace, place: WhiskPlace) -> list[Observed]:
        """Return the points of one camera's trace."""
        camera = view.camera
        beside = beside_wire(trace, camera, place.curves)
        _require_near(trace, camera, place.curves)
        near = points_of_wire(beside)
        if not len(near.frame):
            return []
        segments = averaged(near, self.whisk.settings.wire_piece_px)
        discs_px = place.axis.covering_discs(camera, place.swept_mm)
        is_clear = clear_of_bar(segments, discs_px, BESIDE_BAR_PX)
        segments = segments.select(is_clear & (segments.place_mm > NEAR_CLAMP_MM))
        if not len(segments.frame):
            return []
        points = _line_points(segments, self.whisk.rods.wire.length_mm)
        number = self.whisk.cameras.names.index(camera.name)
        return observed(points, segments.frame, number, list(place.curves))


@dataclass
class TracesAlone(GivenTraces):
    """The wire's lines as another program has drawn them; the object where `place` has it."""

    place: ObjectPlace | None = None

    def require_rods(self, seen: Sequence[Observed]) -> None:
        """Raise Refused where wire or object is determined by no line."""
        self.place.require_rods(seen)


def traces_as_lines(traces: Mapping[str, Trace]) -> Callable[..., TracedLines]:
    """Return what makes the source of a whisk's lines, by arguments as of `TracedLines`: other
    programs' traces, where there are any, else its pictures.
    """
    return partial(GivenTraces, traces=traces) if traces else TracedLines


def _line_points(segments: BesideWire, length_mm: float) -> LinePoints:
    """Return segments as line points, with a sigma by their scatter where none is stated.

    What all frames share is no scatter: a curve that is elsewhere is no reason to let the line be there.
    """
    share = 2.0 * segments.place_mm / length_mm - 1.0
    shapes = np.polynomial.legendre.legvander(share, SHARED - 1)  # (n, SHARED)
    shared = np.linalg.lstsq(shapes, segments.offset_px, rcond=None)[0]
    scatter_px = max(robust_sigma(segments.offset_px - shapes @ shared), LEAST_SIGMA_PX)
    is_stated = np.isfinite(segments.sigma_px)
    sigma_px = np.where(is_stated, np.maximum(segments.sigma_px, LEAST_SIGMA_PX), scatter_px)
    return LinePoints(
        px=segments.foot_px + segments.offset_px[:, None] * segments.normal,
        normal=segments.normal,
        sigma_px=sigma_px,
        place=segments.place_mm,
        shared_px=_LASTING_SHARE * scatter_px * shapes,
    )


def _require_near(trace: Trace, camera: Camera, curves: Mapping[int, Curves]) -> None:
    """Raise Refused where few of the frames with a trace have a line near the wire, or where the trace
    is nearer once it is meant otherwise.
    """
    apart_px = distances_px(trace, camera, curves)
    if not len(apart_px):
        return
    near = float(np.mean(apart_px < NEAR_PX))
    cause = _misread_as(trace, camera, curves, float(np.median(apart_px)))
    if near >= _LEAST_NEAR and not cause:
        return
    found = (
        f"in {1.0 - near:.0%} of its frames the trace is nowhere within {NEAR_PX:g} px of the wire"
    )
    if near >= _LEAST_NEAR:
        found = f"the trace is {np.median(apart_px):.1f} px from the wire"
    cause = cause or "is it of another trial or another camera?"
    raise Refused(f"camera {camera.name}: {found} in the pictures; {cause}", code="trace_elsewhere")


def _misread_as(trace: Trace, camera: Camera, curves: Mapping[int, Curves], apart_px: float) -> str:
    """Return what makes a trace lie surely nearer to the wire, in words; '' where nothing does.

    apart_px: how far it is from the wire as it is read.
    """
    if apart_px < _FIRST_PASS_PX:
        return ""
    for said, meant in misreadings(trace, camera):
        if np.median(distances_px(meant, camera, curves)) < _NEARER * min(apart_px, NEAR_PX):
            return said
    return ""
