"""Lines in a camera's pictures that another program has drawn, and how far they are off the wire."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves
from vision.geometry.grouped import group_means
from vision.geometry.polyline import beside_nodes, lengths_px, normals
from vision.geometry.rotation import unit
from vision.geometry.rows import Rows
from vision.pictures.pyramid import shrunk_px

# [px] From the wire, at most, of a point that is taken to be the wire's: the first of the passes is
# off by a pixel or two, trackers by less than three. Another whisker is farther away. Stated.
NEAR_PX = 6.0
# [px] Least sigma of a traced point or line: files have their numbers to a hundredth. Stated.
LEAST_SIGMA_PX = 0.02
# [mm] Of the wire, straight between two nodes to a hundredth of a pixel. Derived.
_NODE_MM = 1.0


@dataclass(frozen=True)
class Trace(Rows):
    """Points of lines in one camera's pictures.

    frame (n,): index of the frame. px (n, 2). line (n,): number of the line that a point is of, the
    same in all frames where the tracker knows it again. sigma_px (n,): across the line; NaN where it
    is not stated.
    """

    frame: np.ndarray
    px: np.ndarray
    line: np.ndarray
    sigma_px: np.ndarray

    def shrunk(self, scale: int) -> "Trace":
        """Return the points in pictures shrunk by `scale`."""
        if scale == 1:
            return self
        return replace(self, px=shrunk_px(self.px, scale), sigma_px=self.sigma_px / scale)


@dataclass(frozen=True)
class BesideWire(Rows):
    """Points of lines off the wire in one camera.

    frame, line (n,): as of `Trace`. place_mm (n,): along the wire, of the nearest point of its
    curve. offset_px (n,): from there, positive along the curve's normal, which points to the right
    of the way from base to tip in a picture whose v goes down. foot_px, normal (n, 2): of that point.
    along_px (n,): length of the curve's picture up to it. sigma_px (n,): as of `Trace`.
    """

    frame: np.ndarray
    line: np.ndarray
    place_mm: np.ndarray
    offset_px: np.ndarray
    foot_px: np.ndarray
    normal: np.ndarray
    along_px: np.ndarray
    sigma_px: np.ndarray


def beside_wire(trace: Trace, camera: Camera, curves: Mapping[int, Curves]) -> BesideWire:
    """Return how far the points of a trace are off the wire, in the frames that have a curve.

    Points beyond the ends of the wire are left out.
    """
    frames = []
    for frame, curve in curves.items():
        own = trace.select(trace.frame == frame)
        arc_mm = np.arange(0.0, curve.arc_mm[-1] + 0.5 * _NODE_MM, _NODE_MM)
        points_mm, _ = curve.at(np.minimum(arc_mm, curve.arc_mm[-1]))
        frames.append(beside_curve(own, camera.project(points_mm), arc_mm))
    return BesideWire.join(frames)


def beside_curve(trace: Trace, curve_px: np.ndarray, arc_mm: np.ndarray) -> BesideWire:
    """Return how far points of one frame are off a curve of nodes (m, 2) px at arcs (m,) mm."""
    node = _nearest_nodes(trace.px, curve_px)
    normal = normals(curve_px)[node]
    offset_px, on_px = beside_nodes(trace.px - curve_px[node], normal)
    step_px = np.linalg.norm(np.gradient(curve_px, axis=0), axis=1)
    found = BesideWire(
        frame=trace.frame,
        line=trace.line,
        place_mm=arc_mm[node] + on_px * _NODE_MM / step_px[node],
        offset_px=offset_px,
        foot_px=trace.px - offset_px[:, None] * normal,
        normal=normal,
        along_px=lengths_px(curve_px)[node] + on_px,
        sigma_px=trace.sigma_px,
    )
    return found.select((found.place_mm > 0.0) & (found.place_mm < arc_mm[-1]))


def _nearest_nodes(px: np.ndarray, curve_px: np.ndarray) -> np.ndarray:
    """Return for points (n, 2) which of a curve's nodes (m, 2) is the nearest, (n,)."""
    apart = px[:, None] - curve_px  # (n, m, 2)
    return np.argmin(np.sum(apart**2, axis=2), axis=1)


def lines_along_wire(beside: BesideWire) -> dict[int, int]:
    """Return by frame the line with the most points near the wire; frames without any are absent."""
    is_near = np.abs(beside.offset_px) < NEAR_PX
    found = {}
    for frame in np.unique(beside.frame[is_near]).tolist():
        lines = beside.line[is_near & (beside.frame == frame)]
        numbers, counts = np.unique(lines, return_counts=True)
        found[frame] = int(numbers[np.argmax(counts)])
    return found


def points_of_wire(beside: BesideWire) -> BesideWire:
    """Return the points near the wire of the line that is nearest to it in each frame."""
    along = lines_along_wire(beside)
    line = np.array([along.get(frame, np.nan) for frame in beside.frame.tolist()])
    is_near = np.abs(beside.offset_px) < NEAR_PX
    return beside.select(is_near & (beside.line == line))


def closest_lines(beside: BesideWire) -> BesideWire:
    """Return the points of the line with the least median distance from the wire in each frame."""
    is_closest = np.zeros(len(beside.frame), dtype=bool)
    for frame in np.unique(beside.frame).tolist():
        in_frame = beside.frame == frame
        of_lines = [in_frame & (beside.line == line) for line in np.unique(beside.line[in_frame])]
        is_closest |= min(of_lines, key=lambda own: np.median(np.abs(beside.offset_px[own])))
    return beside.select(is_closest)


def distances_px(trace: Trace, camera: Camera, curves: Mapping[int, Curves]) -> np.ndarray:
    """Return for each of the frames with a trace, (n,), the median distance of its points from the
    wire, of the line with the least; infinite where none has a point near the wire.
    """
    closest = closest_lines(beside_wire(trace, camera, curves))
    found = []
    for frame in np.intersect1d(trace.frame, list(curves)).tolist():
        own_px = closest.offset_px[closest.frame == frame]
        found.append(np.median(np.abs(own_px)) if len(own_px) else np.inf)
    return np.array(found)


def averaged(beside: BesideWire, segment_px: float) -> BesideWire:
    """Return one point for each segment of the wire in each frame: the mean of its points.

    Points are taken to err independently of each other where their sigma is stated.
    """
    segment = np.floor(beside.along_px / segment_px).astype(int)
    frame_and_segment = np.stack([beside.frame, segment])
    groups, member = np.unique(frame_and_segment, axis=1, return_inverse=True)
    member = member.ravel()  # NumPy 2.0 returns it as a row
    mean = partial(group_means, member)
    line = np.zeros(groups.shape[1], dtype=int)
    line[member] = beside.line
    count = np.bincount(member)
    return BesideWire(
        frame=groups[0],
        line=line,
        place_mm=mean(beside.place_mm),
        offset_px=mean(beside.offset_px),
        foot_px=mean(beside.foot_px),
        normal=unit(mean(beside.normal)),
        along_px=mean(beside.along_px),
        sigma_px=np.sqrt(mean(beside.sigma_px**2) / count),
    )
