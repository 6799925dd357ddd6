"""Lines in a camera's pictures that another program has drawn, and how far they are beside the wire."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves
from vision.geometry.rows import Rows
from vision.geometry.silhouette import normals
from vision.pictures.pyramid import shrunk_px

# [px] From the wire, at most, of a point that is taken to be the wire's: the first of the passes is
# off by a pixel or two, trackers by less than three. Another whisker is farther away. Stated.
NEAR_PX = 6.0
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
    """Points of lines beside the wire in one camera.

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
    """Return where the points of a trace are beside the wire, in the frames that have a curve.

    Points beyond the ends of the wire are left out.
    """
    frames = []
    for frame, curve in curves.items():
        own = trace.select(trace.frame == frame)
        arc_mm = np.arange(0.0, curve.arc_mm[-1] + 0.5 * _NODE_MM, _NODE_MM)
        points_mm, _ = curve.at(np.minimum(arc_mm, curve.arc_mm[-1]))
        frames.append(_beside_curve(own, camera.project(points_mm), arc_mm))
    return BesideWire.join(frames)


def _beside_curve(trace: Trace, curve_px: np.ndarray, arc_mm: np.ndarray) -> BesideWire:
    """Return where points of one frame are beside a curve of nodes (m, 2) px at arcs (m,) mm."""
    normal = normals(curve_px)  # (m, 2)
    tangent = np.stack([normal[:, 1], -normal[:, 0]], axis=1)
    step_px = np.linalg.norm(np.gradient(curve_px, axis=0), axis=1)
    length_px = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(curve_px, axis=0), axis=1)))
    apart = trace.px[:, None] - curve_px  # (n, m, 2)
    node = np.argmin(np.sum(apart**2, axis=2), axis=1)
    from_node = apart[np.arange(len(node)), node]
    on_px = np.sum(from_node * tangent[node], axis=1)
    found = BesideWire(
        frame=trace.frame,
        line=trace.line,
        place_mm=arc_mm[node] + on_px * _NODE_MM / step_px[node],
        offset_px=np.sum(from_node * normal[node], axis=1),
        foot_px=curve_px[node] + on_px[:, None] * tangent[node],
        normal=normal[node],
        along_px=length_px[node] + on_px,
        sigma_px=trace.sigma_px,
    )
    return found.select((found.place_mm > 0.0) & (found.place_mm < arc_mm[-1]))


def nearest_lines(beside: BesideWire) -> dict[int, int]:
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
    nearest = nearest_lines(beside)
    line = np.array([nearest.get(frame, -1) for frame in beside.frame.tolist()])
    is_near = np.abs(beside.offset_px) < NEAR_PX
    has_line = np.isin(beside.frame, list(nearest))
    return beside.select(has_line & is_near & (beside.line == line))


def averaged(beside: BesideWire, segment_px: float) -> BesideWire:
    """Return one point for each segment of the wire in each frame: the mean of its points.

    Points are taken to err independently of each other where their sigma is stated.
    """
    segment = np.floor(beside.along_px / segment_px).astype(int)
    groups, member = np.unique(np.stack([beside.frame, segment]), axis=1, return_inverse=True)
    member = member.ravel()
    count = np.bincount(member)

    def mean(values: np.ndarray) -> np.ndarray:
        """Return the mean (k,) of values (n,) over each segment."""
        return np.bincount(member, values) / count

    line = np.zeros(len(count), dtype=int)
    line[member] = beside.line
    foot_px = np.stack([mean(column) for column in beside.foot_px.T], axis=1)
    normal = np.stack([mean(column) for column in beside.normal.T], axis=1)
    return BesideWire(
        frame=groups[0],
        line=line,
        place_mm=mean(beside.place_mm),
        offset_px=mean(beside.offset_px),
        foot_px=foot_px,
        normal=normal / np.linalg.norm(normal, axis=1, keepdims=True),
        along_px=mean(beside.along_px),
        sigma_px=np.sqrt(mean(beside.sigma_px**2) / count),
    )
