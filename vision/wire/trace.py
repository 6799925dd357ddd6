"""Line points of the wire in every frame, read in narrow bands along its predicted centreline.

`wire_pieces` cuts the pixels along the prediction into segments, `trace` finds where the wire lies in
them, and `to_points` makes line points with sigmas of those that can be trusted.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves
from vision.geometry.optics import UNKNOWN, Optics
from vision.geometry.rods import Wire
from vision.geometry.rotation import unit
from vision.geometry.rows import Rows
from vision.geometry.silhouette import outline
from vision.pictures.others import RodLines, mask_rods
from vision.pictures.view import View
from vision.wire.bands import Pieces, cut_pieces, read_band
from vision.wire.binned import binned, without
from vision.wire.joint import SegmentSolution, place_each_segment, solve_jointly
from vision.wire.points import SHARED, LinePoints, Observed
from vision.wire.shaded_segments import BLUR_SIGMA, ShadedSegments
from vision.wire.shading import Knots

# [mm] Hub and set-screw hide or shade the wire up to here. Stated.
NEAR_CLAMP_MM = 6.0
# [terms] Of the Fourier series round a wire: with eight, a highlight moves it by 0.17 px, for what
# they lack of a highlight passes for blur and for position. Study: lines.py.
WIRE_WAVES = 11
# [px] Prior mean of the lens blur. Narrow: from one too wide the descent can end in a local
# minimum. Study: starts.py.
_BLUR_PX = 0.8
# [px] Bins of the first pass: a third of a lens blur. Study: thresholds.py wire.trace BIN_PX ….
BIN_PX = 0.3
# [segments] Of the first pass, at most. With 150 touch moves by 0.17 sigma in one of ten scenes. Study: wire_scenes.py.
_FIRST_SEGMENTS = 300
# [nodes] Of a curve, a millimetre apart: in between it is straight to a thousandth of a pixel.
# Derived.
_NODES = 81
# [px] Largest sigma of a segment's position that is used. Half or twice it moves nothing on the
# fixtures. Study: thresholds.py wire.trace _WORST_SIGMA_PX ….
_WORST_SIGMA_PX = 0.5
# [1] Largest misfit of a segment, over the median: beyond, it shows something besides the rod. By 4
# a slip moves by 0.4 sigma, by 9 touch by 0.2. Study: thresholds.py wire.trace _WORST_MISFIT ….
_WORST_MISFIT = 6.0
# [1] Least that the median misfit counts as: pictures without noise leave none, and noise leaves 1.
# 0.25 to 0.8 move nothing on the fixtures. Study: thresholds.py wire.trace _LEAST_MEDIAN_MISFIT ….
_LEAST_MEDIAN_MISFIT = 0.5


def wire_pieces(
    view: View,
    curves: Mapping[int, Curves],
    wire: Wire,
    length_px: int,
    margin_px: int,
    static: np.ndarray | None = None,
) -> Pieces:
    """Cut the wire's pixels in all frames of one camera into segments of length_px.

    curves: predicted centreline by frame. margin_px: beyond the wire's edges. static (h, w): a second
    background, for a pass that fits no shading. The segments' source is the frame.
    """
    arc, middles, radii = _outlines(view.camera, curves, wire)
    # one width for all bands: a wire may pass from one whole pixel of radius to the next in a whisk
    half_px = int(np.ceil(np.nanmax(radii))) + margin_px
    bands = []
    for frame, middle, radius in zip(curves, middles, radii):
        hidden = _hidden(view, frame)
        picture = view.frames[frame]
        bands.append(
            read_band(picture, view.background, middle, arc, radius, half_px, hidden, static)
        )
    pieces = cut_pieces(bands, length_px, view.noise)
    frames = np.array(list(curves))
    return replace(pieces, source=frames[pieces.source])


def lines_of(camera: Camera, wire: Wire, curves: Mapping[int, Curves]) -> RodLines:
    """Return where a wire of these centrelines, by frame, lies in a camera's pictures."""
    _, middles, radii = _outlines(camera, curves, wire)
    return RodLines(np.array(list(curves), dtype=int), middles, np.max(radii, axis=1))


def _hidden(view: View, frame: int) -> np.ndarray | None:
    """Return the pixels (h, w) bool of a frame that other rods may cover; None where there are
    none.
    """
    return mask_rods(view.others, frame, view.frames[frame].shape)


def _outlines(
    camera: Camera, curves: Mapping[int, Curves], wire: Wire
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return arc (n,) in mm, and middle (f, n, 2) and half-width (f, n) in px of the wire in f
    frames.
    """
    arc = np.linspace(2.0, wire.length_mm - 1.0, _NODES)
    points, tangents = _joined(curves.values()).at(arc)  # (f, n, 3)
    middle, half_px = outline(camera, points, unit(tangents), wire.radius_mm(arc))
    return arc, middle, half_px


def _joined(curves: Collection[Curves]) -> Curves:
    """Return curves with nodes at the same arcs as one."""
    arc_mm = next(iter(curves)).arc_mm
    points = np.stack([curve.points_mm for curve in curves])
    tangents = np.stack([curve.tangents for curve in curves])
    return Curves(arc_mm, points, tangents)


def clear_of_bar(
    pieces: Pieces, discs_px: tuple[np.ndarray, np.ndarray], margin_px: float
) -> np.ndarray:
    """Return which segments (s,) lie outside the bar's outline by more than a margin.

    discs_px: middles (m, 2) and radii (m,) of discs that cover the bar; NaN where it passes behind
    the camera and hides nothing.
    """
    middle_px, radius_px = discs_px
    x, y = np.moveaxis(pieces.foot_px[:, None] - middle_px, 2, 0)  # (s, m) each
    distance = np.sqrt(x * x + y * y)
    return np.fmin.reduce(distance - radius_px, axis=1, initial=np.inf) > margin_px


@dataclass(frozen=True)
class WireTrace:
    """Segments moved to where the rod is, what is known of each, and the lens blur in px."""

    pieces: Pieces
    solved: SegmentSolution
    blur_px: float

    @property
    def misfit(self) -> float:
        """Return the median chi² per pixel."""
        return float(np.median(self.solved.chi2))

    @property
    def positions(self) -> "SegmentPositions":
        """Return the segments without their pixels."""
        return SegmentPositions(
            px=self.pieces.foot_px,
            normal=self.pieces.normal,
            place=self.pieces.place,
            source=self.pieces.source,
            own_sigma_px=self.solved.own_sigma_px,
            chi2=self.solved.chi2,
            shared_px=self.solved.shared_px,
            widened_px2=self.solved.widened_px2,
        )


def trace(
    pieces: Pieces,
    knots: Knots,
    optics: Optics = UNKNOWN,
    *,
    seen_blur_px: float | None = None,
    last: bool = True,
) -> WireTrace:
    """Find where the rod lies in segments that are a few pixels off at most.

    optics: what is known of the lens blur. seen_blur_px: the blur of an earlier pass that predicted these
    segments, which are then some tenths of a pixel off at most.
    last: this is the last pass. Averaged pixels serve for all but the last step of the last pass.
    """
    if not last:
        pieces = pieces.thinned(_FIRST_SEGMENTS)
    averaged, variance_px2 = binned(pieces, BIN_PX)
    blur_px, blur_sigma = optics.blur_with(_BLUR_PX, BLUR_SIGMA)
    prior_px = float(np.hypot(blur_px, np.sqrt(variance_px2)))
    if seen_blur_px is not None:
        seen_blur_px = float(np.hypot(seen_blur_px, np.sqrt(variance_px2)))
    task = ShadedSegments(averaged, WIRE_WAVES, knots, prior_px, blur_sigma, seen_blur_px)
    solved = solve_jointly(task, last=last)
    blur_px = without(solved.blur_px, variance_px2)
    if last:
        task = ShadedSegments(pieces, WIRE_WAVES, knots, blur_px)
        solved = place_each_segment(task, replace(solved, blur_px=blur_px))
    return WireTrace(pieces.moved(solved.shift_px), solved, blur_px)


@dataclass(frozen=True)
class SegmentPositions(Rows):
    """Where s segments of a wire lie, without their pixels.

    px, normal (s, 2), place (s,): as of `LinePoints`. source (s,): the band of each. own_sigma_px,
    chi2 (s,), shared_px (s, k), widened_px2 (s, 2): as of `vision.wire.joint.SegmentSolution`.
    """

    px: np.ndarray
    normal: np.ndarray
    place: np.ndarray
    source: np.ndarray
    own_sigma_px: np.ndarray
    chi2: np.ndarray
    shared_px: np.ndarray
    widened_px2: np.ndarray


def to_points(traced: WireTrace) -> tuple[LinePoints, np.ndarray]:
    """Return the line points that can be trusted, and the source of each; sigmas hold the misfit."""
    return points_of(traced.positions)


def points_of(segments: SegmentPositions) -> tuple[LinePoints, np.ndarray]:
    """Return the line points of segments that can be trusted, and the source of each."""
    median = float(np.median(segments.chi2))
    most_chi2 = _WORST_MISFIT * max(median, _LEAST_MEDIAN_MISFIT)
    good = (segments.chi2 < most_chi2) & (segments.own_sigma_px < _WORST_SIGMA_PX)
    shared_px, rest_px = _leading_causes(segments.shared_px)
    points = LinePoints(
        px=segments.px,
        normal=segments.normal,
        sigma_px=np.hypot(segments.own_sigma_px, rest_px),
        place=segments.place,
        shared_px=shared_px,
        widened_px2=segments.widened_px2,
    )
    return points.select(good), segments.source[good]


def _leading_causes(shared_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the SHARED causes (s, SHARED) with most of the variance that segments share.

    shared_px (s, k): by all causes. Also returned is the sigma (s,) that the others leave.
    """
    _, _, rotation = np.linalg.svd(shared_px.T @ shared_px)
    causes = shared_px @ rotation.T
    leading = np.zeros((len(causes), SHARED))
    leading[:, : causes.shape[1]] = causes[:, :SHARED]
    return leading, np.linalg.norm(causes[:, SHARED:], axis=1)


def observed(
    points: LinePoints, source: np.ndarray, camera: int, frames: Sequence[int]
) -> list[Observed]:
    """Return one Observed for each frame that has points.

    source (n,): frame of each point. frames: frame index of each position of the whisk.
    """
    found = []
    for position, frame in enumerate(frames):
        mine = source == frame
        if np.any(mine):
            found.append(Observed(position, camera, points.select(mine)))
    return found
