"""The pixels near a predicted silhouette: its two sides, and pieces of them as rows of pixels.

Only those parts count outside of which nothing else of the object lies, and that are clear of the
wire.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from vision.geometry.camera import Camera
from vision.geometry.polyline import at_lengths, lengths_px, tangents_by
from vision.geometry.rounded import RoundedAxis
from vision.geometry.rows import Rows
from vision.pictures.view import SATURATED, View
from vision.touched.object_view import ObjectView
from vision.touched.patches import FULL_SCALE
from vision.touched.profiles import OUTSIDE_PX
from vision.wire.bands import Pieces
from vision.wire.pixel_table import PixelTable
from vision.wire.points import LinePoints

# [px] Depth inside an edge that is read: that of a thick bar, and one pixel more. Stated.
_INSIDE_PX = 9.0
# [px] Least half width: what is thinner has both edges in one. Stated.
_LEAST_HALF_PX = 5.0
# [px] Largest half width in the model: the light of what is wider changes no faster near its
# edge, and profiles grow no longer. Stated.
_LARGEST_HALF_PX = 40.0
# [px] Distance outside an edge within which nothing else of the object may lie: where the
# background is read. Stated.
_CLEAR_PX = 5.0
# [points] Of each side of a silhouette: some pixels apart at most. A layout.
_STATIONS = 400
# [px] From a wire beyond half a piece, within which pixels may show it. Stated.
_BESIDE_WIRE_PX = 5.0
# [px] Between points of a wire's line, where pixels near it are searched for. A layout.
_DENSE_PX = 2.0


@dataclass(frozen=True)
class OutlineSide:
    """One side of a predicted outline as n stations, about a pixel apart.

    px, normal (n, 2): in the picture, normals outwards. distance_mm (n,): from the camera. is_clear
    (n,): whether only background lies outside. half_px (n,): half the object's width.
    """

    px: np.ndarray
    normal: np.ndarray
    distance_mm: np.ndarray
    is_clear: np.ndarray
    half_px: np.ndarray

    @property
    def arc_px(self) -> np.ndarray:
        """Return the length (n,) along the side up to each station."""
        return lengths_px(self.px)

    @property
    def tangent(self) -> np.ndarray:
        """Return unit tangents (n, 2) at right angles to the normals, in the stations' order."""
        tangent = tangents_by(self.normal)
        to_next = np.gradient(self.px, axis=0)
        return tangent * np.sign(np.sum(tangent * to_next, axis=1, keepdims=True))

    @property
    def model_half_px(self) -> float:
        """Return half the object's width in the model of its pixels."""
        return min(float(np.median(self.half_px[self.is_clear])), _LARGEST_HALF_PX)

    def station_at(self, along_px: np.ndarray) -> np.ndarray:
        """Return the stations (n,) at places (n,) along the side."""
        arc_px = self.arc_px
        return np.clip(np.searchsorted(arc_px, along_px), 0, len(arc_px) - 1)

    def points(
        self, station: np.ndarray, outside_px: np.ndarray, sigma_px: np.ndarray
    ) -> LinePoints:
        """Return line points (k,) so far outside of stations (k,)."""
        normal = self.normal[station]
        px = self.px[station] + outside_px[:, None] * normal
        return LinePoints(px, normal, sigma_px, self.distance_mm[station])


def predict_sides(view: ObjectView, axis: RoundedAxis) -> list[OutlineSide]:
    """Predict both sides of the outline, a station every pixel or so; none where a part is not
    before the camera."""
    camera = view.camera
    radius_mm = view.radius_mm
    reach_mm = view.settings.bar_reach_mm
    points, normals = axis.silhouette(camera.centre_mm, radius_mm, reach_mm, _STATIONS)
    px = camera.project(points)
    if not np.all(np.isfinite(px)):
        return []
    half_px = 0.5 * np.linalg.norm(px[0] - px[1], axis=1)
    is_wide = half_px > _LEAST_HALF_PX
    sides = []
    for points_mm, outwards, side_px in zip(points, normals, px):
        normal, px_per_mm = _normals_in_picture(camera, points_mm, outwards)
        outside_mm = points_mm + _CLEAR_PX / px_per_mm * outwards
        is_hidden = axis.hides_itself(camera.centre_mm, outside_mm, radius_mm)
        distance_mm = np.linalg.norm(points_mm - camera.centre_mm, axis=1)
        sides.append(OutlineSide(side_px, normal, distance_mm, is_wide & ~is_hidden, half_px))
    return sides


def _normals_in_picture(
    camera: Camera, points_mm: np.ndarray, normals: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Project normals (n, 3) of a surface at points (n, 3): unit (n, 2), and px per mm (n, 1)."""
    _, by_point, _ = camera.project_with_jacobians(points_mm)
    normal_px = np.einsum("nij,nj->ni", by_point, normals)
    px_per_mm = np.linalg.norm(normal_px, axis=1, keepdims=True)
    return normal_px / px_per_mm, px_per_mm


@dataclass(frozen=True)
class _SidePixels(Rows):
    """Pixels near one side of a silhouette.

    pixels (n, 2): whole, x and y. station (n,): the nearest one. offset_px, along_px (n,): across
    the side outwards, and along it.
    """

    pixels: np.ndarray
    station: np.ndarray
    offset_px: np.ndarray
    along_px: np.ndarray

    @classmethod
    def of(cls, side: OutlineSide, pixels: np.ndarray) -> "_SidePixels":
        """Return pixels (n, 2) with their places near a side."""
        _, nearest = cKDTree(side.px).query(pixels)
        displacement = pixels - side.px[nearest]
        offset_px = np.sum(displacement * side.normal[nearest], axis=1)
        past_station_px = np.sum(displacement * side.tangent[nearest], axis=1)
        return cls(pixels, nearest, offset_px, side.arc_px[nearest] + past_station_px)


def read_pieces(view: ObjectView, side: OutlineSide, reach_px: float) -> Pieces:
    """Read the pixels near one side that lie clear of the wires, as pieces along it."""
    length_px = view.settings.bar_piece_px
    inside_px = reach_px + _INSIDE_PX
    outside_px = reach_px + OUTSIDE_PX + 1.0
    pixels = _pixels_near(view.pictures.mean.shape, side, inside_px, outside_px)
    if not len(pixels):
        return Pieces.none()
    found = _SidePixels.of(side, pixels)
    keep = side.is_clear[found.station] & (found.offset_px < outside_px)
    keep &= found.offset_px > -np.minimum(inside_px, side.half_px[found.station])
    keep &= (found.along_px >= 0.0) & (found.along_px <= side.arc_px[-1])
    if len(view.crossing_px):
        keep &= _is_clear_of(view.crossing_px, pixels, length_px / 2 + _BESIDE_WIRE_PX)
    return _as_rows(view.pictures, side, found.select(keep), length_px)


def _is_clear_of(
    wires_px: Sequence[np.ndarray], pixels: np.ndarray, margin_px: float
) -> np.ndarray:
    """Return which pixels (n, 2) lie farther than a margin from all wires' lines."""
    lines = np.concatenate([_dense(line) for line in wires_px])
    distance, _ = cKDTree(lines).query(pixels, distance_upper_bound=margin_px)
    return ~np.isfinite(distance)


def _dense(line: np.ndarray) -> np.ndarray:
    """Return a line (m, 2) sampled every `_DENSE_PX`, without points that are not finite."""
    line = line[np.all(np.isfinite(line), axis=1)]
    if len(line) < 2:
        return line
    length_px = lengths_px(line)
    return at_lengths(np.arange(0.0, length_px[-1], _DENSE_PX), length_px, line)


def _pixels_near(
    shape: tuple[int, int], side: OutlineSide, inside_px: float, outside_px: float
) -> np.ndarray:
    """Return the whole pixels (n, 2), x and y, up to inside_px within and outside_px beyond the
    stations."""
    height, width = shape
    steps = np.arange(-inside_px, outside_px + 0.5, 0.5)
    near = np.round(side.px[:, None] + steps[:, None] * side.normal[:, None])
    near = near.astype(int).reshape(-1, 2)
    is_within = np.all((near >= 0) & (near < np.array([width, height])), axis=1)
    index = np.unique(near[is_within, 1] * width + near[is_within, 0])
    return np.stack([index % width, index // width], axis=1).astype(float)


@dataclass(frozen=True)
class _PixelLight:
    """The light of n pixels near one side of a silhouette, in grey levels of `FULL_SCALE`.

    grey, background (n,): with the object and without it. slope (n,): of the background across the
    side outwards, per px. weight (n,): one over the noise of the grey value. What is not known is 0.
    """

    grey: np.ndarray
    background: np.ndarray
    slope: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(cls, view: View, side: OutlineSide, found: _SidePixels) -> "_PixelLight":
        """Return the light of pixels in a view."""
        column, row = found.pixels.astype(int).T
        grey = view.mean[row, column]
        background = view.background[row, column]
        scale = FULL_SCALE / view.full_scale
        across = side.normal[side.station_at(found.along_px)]
        slope = np.sum(_gradient(view.background, row, column) * across, axis=1)
        weight = _weights(view, grey, background)
        known = np.nan_to_num([grey * scale, background * scale, slope * scale])
        return cls(*known, weight / scale)


def _as_rows(view: View, side: OutlineSide, found: _SidePixels, length_px: int) -> Pieces:
    """Return pieces of length_px along the side, with their pixels as rows, filled up with pixels
    of no weight.

    `place` of a piece is along it, px; `source` is its station.
    """
    number = (found.along_px // length_px).astype(int)
    numbers, piece = np.unique(number, return_inverse=True)
    if not len(numbers):
        return Pieces.none()
    table = PixelTable.by_segment(piece, found.offset_px, len(numbers))
    light = _PixelLight.of(view, side, found)
    half_px = side.model_half_px
    middle = (numbers + 0.5) * length_px
    station = side.station_at(middle)
    return Pieces(
        offset_px=table.filled(found.offset_px + half_px),
        grey=table.filled(light.grey),
        background=table.filled(light.background),
        slope=table.filled(light.slope),
        curvature=np.zeros(table.shape),
        weight=table.filled(light.weight),
        place=middle,
        radius_px=np.full(len(numbers), half_px),
        foot_px=side.px[station],
        normal=side.normal[station],
        source=station,
        noise_behind=np.full(len(numbers), 1.0 / view.mean_share),
    )


def _weights(view: View, grey: np.ndarray, background: np.ndarray) -> np.ndarray:
    """Return one over the noise (n,) of grey values (n,), 0 where one of both is unknown or full."""
    is_known = np.isfinite(grey) & np.isfinite(background)
    is_used = is_known & (grey < SATURATED * view.full_scale)
    sigma = view.noise.times(view.mean_share).sigma(np.where(is_used, grey, 0.0))
    return np.where(is_used, 1.0 / sigma, 0.0)


def _gradient(picture: np.ndarray, row: np.ndarray, column: np.ndarray) -> np.ndarray:
    """Return the central differences (n, 2) of a picture by x and y at whole pixels."""
    last_row = picture.shape[0] - 1
    last_column = picture.shape[1] - 1
    right = picture[row, np.minimum(column + 1, last_column)]
    left = picture[row, np.maximum(column - 1, 0)]
    below = picture[np.minimum(row + 1, last_row), column]
    above = picture[np.maximum(row - 1, 0), column]
    return 0.5 * np.stack([right - left, below - above], axis=1)
