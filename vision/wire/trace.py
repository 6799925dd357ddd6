"""Line points of the wire in every frame, read in narrow bands beside where it is expected."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves
from vision.geometry.rods import Wire
from vision.geometry.silhouette import edges, normals
from vision.pictures.others import RodLines, covered
from vision.pictures.view import View
from vision.wire.bands import Pieces, cut_pieces, read_band
from vision.wire.binned import binned, without
from vision.wire.joint import BLUR_SIGMA, ShadedSegments, settled, solve_jointly
from vision.wire.points import SHARED, LinePoints, Observed
from vision.wire.shading import Knots, Located

# [mm] Hub and set-screw hide or shade the wire up to here. Stated.
NEAR_CLAMP_MM = 6.0
# [waves] Round a wire: with eight, a highlight moves it by 0.17 px. Study: lines.py.
# round a wire: with fewer, what they lack of a highlight passes for blur and for position
WIRE_WAVES = 11
# [px] Narrow: one too wide can be the best nearby. Study: starts.py.
_BLUR_PX = 0.8
# [px] Of the first look: a third of a lens blur. Study: thresholds.py lines.trace BIN_PX ….
BIN_PX = 0.3
# [nodes] Of a curve, a millimetre apart: in between it is straight to a thousandth of a pixel.
# Derived.
_NODES = 81
# [px] A piece that is known less well is left out. Set by eye. Study: thresholds.py lines.trace
# _WORST_SIGMA_PX ….
_WORST_SIGMA_PX = 0.5
# [1] A piece whose misfit is this many times the median piece's is no picture of the rod alone.
# Set by eye. Study: thresholds.py lines.trace _WORST_MISFIT ….
_WORST_MISFIT = 6.0


def wire_pieces(
    view: View,
    curves: Mapping[int, Curves],
    wire: Wire,
    length_px: int,
    margin_px: int,
    still: np.ndarray | None = None,
) -> Pieces:
    """Pieces of the wire in all frames of one camera; curves: predicted centreline of each frame. still (h, w): another
    background, for a look that asks for no light."""
    arc, middles, radii = _outlines(view.camera, curves, wire)
    # one width for all bands: a wire may pass from one whole pixel of radius to the next within a whisk
    half = int(np.ceil(np.nanmax(radii))) + margin_px
    bands = [
        read_band(
            view.frames[frame],
            view.background,
            middle,
            arc,
            radius,
            half,
            _hidden(view, frame),
            still,
        )
        for frame, middle, radius in zip(curves, middles, radii)
    ]
    pieces = cut_pieces(bands, length_px, view.noise)
    return replace(
        pieces, source=np.array(list(curves))[pieces.source]
    )  # the frame's index, not the band's number


def lines_of(camera: Camera, wire: Wire, curves: Mapping[int, Curves]) -> RodLines:
    """What a wire of these centrelines, by frame, is in a camera's pictures."""
    _, middles, radii = _outlines(camera, curves, wire)
    return RodLines(np.array(list(curves), dtype=int), middles, np.max(radii, axis=1))


def _hidden(view: View, frame: int) -> np.ndarray | None:
    """Pixels (h, w), bool, of a frame that other rods may have covered; None where there are none."""
    return covered(view.others, frame, view.frames[frame].shape)


def _outlines(
    camera: Camera, curves: Mapping[int, Curves], wire: Wire
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arc (n,) in mm, middle (f, n, 2) and half-width (f, n) in px of the wire in each of f frames."""
    every = list(curves.values())
    arc = np.linspace(2.0, wire.length_mm - 1.0, _NODES)
    points, tangents = Curves(
        every[0].arc_mm,
        *(np.stack(part) for part in zip(*((curve.points_mm, curve.tangents) for curve in every))),
    ).at(arc)
    directions = tangents / np.linalg.norm(tangents, axis=-1, keepdims=True)
    one, other = (
        edge.reshape(len(every), _NODES, 2)
        for edge in edges(
            camera,
            points.reshape(-1, 3),
            directions.reshape(-1, 3),
            np.tile(wire.radius_mm(arc), len(every)),
        )
    )
    middle = 0.5 * (one + other)
    half_px = 0.5 * np.abs(np.sum((one - other) * normals(middle), axis=-1))
    return arc, middle, half_px


def clear_of_bar(
    pieces: Pieces, middle_px: np.ndarray, radius_px: np.ndarray, margin_px: float
) -> np.ndarray:
    """Which pieces (s,) lie outside the bar's outline, given by its middle (m, 2) and half-width (m,); NaN where it
    passes behind the camera and hides nothing."""
    away = np.linalg.norm(pieces.foot_px[:, None] - middle_px[None], axis=2)
    return np.fmin.reduce(away - radius_px[None], axis=1, initial=np.inf) > margin_px


@dataclass(frozen=True)
class Traced:
    """Pieces brought to where the rod is, with what is known of each, and the lens blur in px."""

    pieces: Pieces
    located: Located
    blur_px: float

    @property
    def misfit(self) -> float:
        """Median chi² per pixel."""
        return float(np.median(self.located.chi2))


def trace(
    pieces: Pieces,
    knots: Knots,
    blur_px: float = _BLUR_PX,
    blur_sigma: float = BLUR_SIGMA,
    terms: int = WIRE_WAVES,
    *,
    seen_blur_px: float | None = None,
    last: bool = True,
) -> Traced:
    """Where the rod is that shows in these pieces, a few pixels off at most.

    blur_px: what the lens blur is believed to be, to blur_sigma of its logarithm; seen_blur_px: what it was in an
    earlier look that told where these pieces are expected, which are then some tenths of a pixel off at most. All steps
    are taken with averaged pixels, but for the last where this is the last look.
    """
    rough, blurred = binned(pieces, BIN_PX)
    believed, seen = (
        one and float(np.hypot(one, np.sqrt(blurred))) for one in (blur_px, seen_blur_px)
    )
    solved = solve_jointly(
        ShadedSegments(rough, terms, knots, believed, blur_sigma, seen), last=last
    )
    blur_px = without(solved.blur_px, blurred)
    if last:
        solved = settled(
            ShadedSegments(pieces, terms, knots, blur_px, blur_sigma),
            replace(solved, blur_px=blur_px),
        )
    located = Located(
        np.zeros(len(pieces)),
        solved.own_sigma_px,
        solved.chi2,
        solved.contrast,
        solved.shared_px,
        solved.widened_px2,
    )
    return Traced(pieces.moved(solved.shift_px), located, blur_px)


def to_points(traced: Traced) -> tuple[LinePoints, np.ndarray]:
    """Trusted line points and the source of each, with sigmas that hold the misfit."""
    pieces, located = traced.pieces, traced.located
    good = (located.chi2 < _WORST_MISFIT * max(traced.misfit, 0.5)) & (
        located.sigma_px < _WORST_SIGMA_PX
    )
    shared, rest = _leading(located.shared_px)
    points = LinePoints(
        pieces.foot_px,
        pieces.normal,
        np.hypot(located.sigma_px, rest),
        pieces.place,
        shared,
        located.widened_px2,
    )
    return points.select(good), pieces.source[good]


def _leading(shared_px) -> tuple[np.ndarray, np.ndarray]:
    """The SHARED causes (s, SHARED) that make the most of what pieces share (s, k), and what others leave (s,)."""
    _, _, turned = np.linalg.svd(shared_px.T @ shared_px)
    causes = shared_px @ turned.T
    most = np.zeros((len(causes), SHARED))
    most[:, : causes.shape[1]] = causes[:, :SHARED]
    return most, np.linalg.norm(causes[:, SHARED:], axis=1)


def observed(
    points: LinePoints, source: np.ndarray, camera: int, frames: Sequence[int]
) -> list[Observed]:
    """One Observed per frame that has points; frames: the frame index of each position of the whisk."""
    return [
        Observed(position, camera, points.select(source == frame))
        for position, frame in enumerate(frames)
        if np.any(source == frame)
    ]
