"""What places the touched object in whisks of which there are traces and no pictures.

Either another program has tracked points of it, on the middle of its outline or on both of its edges
(`TrackedObject`), or its place is stated, with sigmas (`PlacedObject`). A fit is given the points as
the object's lines, or the place as a prior.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vision.geometry.camera import Camera, Cameras
from vision.geometry.contact import BarAxis
from vision.geometry.newton import cauchy_weights
from vision.geometry.planes import fit_plane, meet_planes, nearest_along_mm
from vision.geometry.polyline import normals
from vision.geometry.refusals import Refused
from vision.geometry.robust import robust_sigma
from vision.geometry.rods import Bar, Rods
from vision.geometry.rotation import unit
from vision.geometry.rows import Rows
from vision.geometry.silhouette import outline
from vision.geometry.touched import Axis
from vision.touched.one_view import seen_from_one_side
from vision.truth.line_source import require_wire
from vision.truth.readers import ObjectReader, ReadLine
from vision.truth.trace_points import LEAST_SIGMA_PX, Trace, beside_curve
from vision.truth.whisk_pictures import AxisPrior
from vision.truth.whisk_place import WhiskPlace
from vision.wire.points import LinePoints, Observed

# [mm] Of a bar to either side of its point, on which its points may be. Stated.
_REACH_MM = 200.0
# [nodes] Fewer of a picture of it have no direction. Derived.
_FEWEST_NODES = 2
# [px] Scale of the Cauchy weights of points about their plane: trackers scatter by less. Stated.
_SCATTER_PX = 2.0
# [1] By how much the distance of two tracked edges may differ from the object's width. Stated.
_MOST_UNLIKE_WIDTH = 0.3
# [mm] From a place of an axis: itself and to either side, for the normal there. A layout.
_NEAR_MM = np.array([-1.0, 0.0, 1.0])
# [lines] Of a bar of which both edges are tracked. Derived.
_EDGES = 2


class ObjectPlace(ABC):
    """What places the touched object without a picture of it."""

    @abstractmethod
    def axis(self, cameras: Cameras, rods: Rods) -> Axis:
        """Return where the object stands, coarsely. Raises Refused where that is not determined."""

    @abstractmethod
    def prior(self) -> AxisPrior | None:
        """Return what is believed of its place before a line of it is seen; None for nothing."""

    @abstractmethod
    def reader(self, cameras: Cameras) -> ObjectReader:
        """Return what reads the object's lines."""

    @abstractmethod
    def require_rods(self, seen: Sequence[Observed]) -> None:
        """Raise Refused where wire or object is determined by no line."""


@dataclass(frozen=True, eq=False)
class PlacedObject(ObjectPlace):
    """An object whose place a stage states, or a board on it shows."""

    known: AxisPrior

    def axis(self, cameras: Cameras, rods: Rods) -> Axis:
        """Return the stated axis."""
        return self.known.axis

    def prior(self) -> AxisPrior:
        """Return the stated place with its sigmas."""
        return self.known

    def reader(self, cameras: Cameras) -> ObjectReader:
        """Return a reader that has no line."""
        return _NoLines()

    def require_rods(self, seen: Sequence[Observed]) -> None:
        """Raise Refused where the wire is seen in no camera."""
        require_wire(seen)


class _NoLines(ObjectReader):
    """The reader of an object whose place is stated."""

    def read(self, place: WhiskPlace, *, last: bool) -> dict[str, list[ReadLine]]:
        """Return no line."""
        return {}


@dataclass(frozen=True, eq=False)
class TrackedObject(ObjectPlace):
    """A straight bar that stands, with points that another program has tracked.

    points: by camera, of one line, on the middle of the bar's outline, or of two lines, on its edges.
    """

    points: Mapping[str, Trace]

    def axis(self, cameras: Cameras, rods: Rods) -> BarAxis:
        """Return the axis in which the planes of sight through the points meet.

        Raises Refused where the points are of no bar, at one spot, or seen from one side.
        """
        _require_straight_bar(rods)
        seeing = [camera for camera in cameras if camera.name in self.points]
        if len(seeing) < 2:
            raise _from_one_side()
        planes = np.array([_plane(self.points[camera.name], camera) for camera in seeing])
        centres_mm = np.array([camera.centre_mm for camera in seeing])
        axis = BarAxis(*meet_planes(planes, centres_mm)).upward()
        if seen_from_one_side(Cameras(tuple(seeing)), axis):
            raise _from_one_side()
        axis = _opposite_points(axis, self.points[seeing[0].name], seeing[0])
        for camera in seeing:
            _require_bar(self.points[camera.name], camera, axis, rods.bar)
        return axis

    def prior(self) -> None:
        """Return nothing: the points say where the object is."""
        return None

    def reader(self, cameras: Cameras) -> ObjectReader:
        """Return what reads the points as the bar's middle."""
        return _TrackedMiddle(self.points, cameras)

    def require_rods(self, seen: Sequence[Observed]) -> None:
        """Raise Refused where wire or object is seen in no camera."""
        require_wire(seen)
        if all(one.on_wire for one in seen):
            raise Refused("no camera has points of the object", code="rod_hidden")


@dataclass(frozen=True, eq=False)
class _TrackedMiddle(ObjectReader):
    """The middle of a bar's outline by tracked points, as two points of a line in each camera."""

    points: Mapping[str, Trace]
    cameras: Cameras

    def read(self, place: WhiskPlace, *, last: bool) -> dict[str, list[ReadLine]]:
        """Return by camera the two points."""
        found = {}
        for camera in self.cameras:
            if camera.name in self.points:
                line = _middle(self.points[camera.name], camera, place.axis)
                found[camera.name] = [ReadLine(line, 0)]
        return found


@dataclass(frozen=True, eq=False)
class _BesideAxis(Rows):
    """Points off the picture of an axis.

    place_mm (n,): along the axis, from its point. offset_px (n,): across its picture. line (n,): of each point.
    sigma_px (n,): as stated.
    """

    place_mm: np.ndarray
    offset_px: np.ndarray
    line: np.ndarray
    sigma_px: np.ndarray


def _beside_axis(points: Trace, camera: Camera, axis: BarAxis) -> _BesideAxis:
    """Return how far tracked points are off the picture of an axis; those beyond its reach are left out.

    Raises Refused where the axis is behind the camera.
    """
    along_mm = np.arange(0.0, 2.0 * _REACH_MM + 1.0)
    curve_px = camera.project(axis.points_at(along_mm - _REACH_MM))
    is_before = np.all(np.isfinite(curve_px), axis=1)
    if np.sum(is_before) < _FEWEST_NODES:
        found = "points of all cameras together have the object behind it"
        raise _elsewhere(camera, f"{found}; are they of this trial and camera?")
    beside = beside_curve(points, curve_px[is_before], along_mm[is_before])
    return _BesideAxis(beside.place_mm - _REACH_MM, beside.offset_px, beside.line, beside.sigma_px)


def _middle(points: Trace, camera: Camera, axis: BarAxis) -> LinePoints:
    """Return tracked points as two points of the middle of a bar's outline.

    Straight lines through the points of one line, or of each of two edges, are averaged at two places: a
    standard deviation of the places to either side of their mean, where errors of a line are independent. What a
    tracker errs by in all frames alike does not show where it tracks few places: the sigma does not fall with
    the number of points.
    """
    beside = _beside_axis(points, camera, axis)
    place_mm = np.mean(beside.place_mm) + np.std(beside.place_mm) * np.array([-1.0, 1.0])
    offsets_px = []
    scatters_px = []
    for line in np.unique(beside.line):
        offset_px, scatter_px = _straight_line(beside.select(beside.line == line), place_mm)
        offsets_px.append(offset_px)
        scatters_px.append(scatter_px)
    sigma_px = _sigma_px(beside.sigma_px, scatters_px) / np.sqrt(len(offsets_px))
    foot_px, normal = _at_places(camera, axis, place_mm)
    return LinePoints(
        px=foot_px + np.mean(offsets_px, axis=0)[:, None] * normal,
        normal=normal,
        sigma_px=np.full(len(place_mm), sigma_px),
        place=place_mm,
    )


def _sigma_px(stated_px: np.ndarray, scatters_px: Sequence[float]) -> float:
    """Return the sigma of one line: the mean of its points' (n,), or their scatter about the lines where
    none is stated (NaN).
    """
    sigma_px = float(np.mean(stated_px))
    if not np.isfinite(sigma_px):
        sigma_px = float(np.sqrt(np.mean(np.square(scatters_px))))
    return max(sigma_px, LEAST_SIGMA_PX)


def _straight_line(beside: _BesideAxis, place_mm: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the offsets (k,) px, at places (k,), of the straight line through points of one line, and
    the points' scatter about it.

    Points count by how far they are off their median, with Cauchy's weights.
    """
    weight = cauchy_weights(beside.offset_px - np.median(beside.offset_px), _SCATTER_PX)
    by_place = np.polynomial.Polynomial.fit(beside.place_mm, beside.offset_px, 1, w=np.sqrt(weight))
    return by_place(place_mm), robust_sigma(beside.offset_px - by_place(beside.place_mm))


def _at_places(
    camera: Camera, axis: BarAxis, place_mm: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the picture (n, 2) of an axis at places (n,), and its unit normals (n, 2) there."""
    near_px = camera.project(axis.points_at(place_mm[:, None] + _NEAR_MM))  # (n, 3, 2)
    return near_px[:, 1], normals(near_px)[:, 1]


def _plane(points: Trace, camera: Camera) -> np.ndarray:
    """Return the unit normal (3,) of a camera's plane of sight through tracked points of a bar.

    Of two edges it is the plane between both.
    """
    found: list[np.ndarray] = []
    for line in np.unique(points.line):
        rays = camera.rays(points.px[points.line == line])
        normal, _ = fit_plane(rays, camera.lens[0], _SCATTER_PX)
        found.append(normal if not found or normal @ found[0] > 0 else -normal)
    return unit(np.sum(found, axis=0))


def _opposite_points(axis: BarAxis, points: Trace, camera: Camera) -> BarAxis:
    """Return an axis whose point is in the middle of a camera's tracked points."""
    ray = unit(np.mean(camera.rays(points.px), axis=0))
    along_mm = nearest_along_mm(axis.point_mm, axis.direction, camera.centre_mm, ray)
    return BarAxis(axis.point_mm + along_mm * axis.direction, axis.direction)


def _require_bar(points: Trace, camera: Camera, axis: BarAxis, bar: Bar) -> None:
    """Raise Refused where points are no line along a bar, or no two edges of it."""
    beside = _beside_axis(points, camera, axis)
    lines = np.unique(beside.line)
    if not len(lines) or np.ptp(beside.place_mm) < bar.diameter_mm:
        found = "all points of the object are at one spot"
        raise _elsewhere(camera, f"{found}; track two places of it, a diameter apart or more")
    if len(lines) > _EDGES:
        found = f"points of the object are on {len(lines)} lines"
        raise _elsewhere(camera, f"{found}; one is its middle, two are its edges")
    if len(lines) == _EDGES:
        middles_px = [np.median(beside.offset_px[beside.line == line]) for line in lines]
        found_px = float(abs(middles_px[1] - middles_px[0]))
        width_px = 2.0 * _half_width_px(camera, axis, bar)
        if abs(found_px / width_px - 1.0) > _MOST_UNLIKE_WIDTH:
            found = f"the object's two lines are {found_px:.1f} px apart, its width is {width_px:.1f} px"
            raise _elsewhere(
                camera, f"{found}; two lines are its edges, give its middle as one line"
            )


def _half_width_px(camera: Camera, axis: BarAxis, bar: Bar) -> float:
    """Return half the width of a bar's outline at the axis's point."""
    _, half_px = outline(camera, axis.points_at(_NEAR_MM), axis.direction, bar.radius_mm)
    return float(half_px[1])


def _require_straight_bar(rods: Rods) -> None:
    """Raise Refused where the touched object is no straight bar."""
    if not isinstance(rods.bar, Bar):
        raise Refused(
            f"points place a straight bar, and the object is a {rods.bar.name}: "
            'state its place ([truth] source = "stage")',
            code="object_points_elsewhere",
        )


def _elsewhere(camera: Camera, found: str) -> Refused:
    """Return the refusal of one camera's points."""
    return Refused(f"camera {camera.name}: {found}", code="object_points_elsewhere")


def _from_one_side() -> Refused:
    """Return the refusal of points that determine no place in space."""
    return Refused(
        "points of the object are seen from one side; track it in two cameras or more, "
        'or state its place ([truth] source = "stage")',
        code="object_from_one_side",
    )
