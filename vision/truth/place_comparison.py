"""Does another place of the bar explain the pictures better than the fitted one?

Nothing here knows how the bar was found; the bar as it was fitted is called the drawn one. A bar
changes what a camera sees: inside its silhouette the picture is another one than that without
rods, outside it is the same up to smooth light. So of all strips as wide as the bar, its
silhouette covers most of what has changed, of whatever colour. In each camera the pixels along
the drawn silhouette are straightened into a band that reaches two diameters beyond it to either
side. The wire is left out. How much of the silhouette's area has changed is then known at every
shift and tilt, and summed over the cameras for every axis nearby in space.

The number that decides is a share of area: by how much more of the bar's width has changed under
another strip than under the drawn one, summed over the cameras. Its standard error is that of the
mean over segments along the bar. Rims as dark as the background, shadows next to the bar and
hidden pixels make many strips alike and are evidence for none. The blur of the lens widens what
has changed by a pixel or two: a strip as near as that is no other place. A bar that moves, and an
object that is no straight bar, are left out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import cv2
import numpy as np
from scipy.ndimage import map_coordinates

from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves
from vision.geometry.contact import BarAxis, axis_frame
from vision.geometry.polyline import at_lengths, lengths_px, normals, tangents_by
from vision.geometry.rods import Rods
from vision.geometry.sampling import grid_points
from vision.geometry.silhouette import outline
from vision.pictures.others import mask_rods
from vision.pictures.view import View

# [mm] To either side of the contact: what is compared. Bars are clamped farther out. Stated.
_REACH_MM = 30.0
# [radii] Half the band's width: two diameters beyond the silhouette. Stated.
_BAND_RADII = 5.0
# [samples] In a radius, at most: the lens blurs more. Study: last_question.py.
_PER_RADIUS = 10.0
# [samples] Along the bar, at most. Study: last_question.py.
_ALONG = 128
# [frames] Whose median is a picture without what moves. Study: last_question.py.
FRAMES = 5
# [segments] Along the bar in each camera: each is one observation. Study: last_question.py.
_SEGMENTS = 16
# [px] Beside the wire, where the lens mixes it with what is behind. Stated.
_BESIDE_WIRE_PX = 3.0
# [samples] Along the bar, over which differences are averaged. Study: last_question.py.
_AVERAGED = 5
# [sigmas] A difference up to here is none. Study: last_question.py.
_NOISE_SIGMAS = 2.5
# [sigmas] By so much more it is certain. Study: last_question.py.
_SURE_SIGMAS = 4.0
# [grey levels] Least standard deviation of a difference: rounding. Derived.
_LEAST_SIGMA = 0.4
# [1] Share of the pixels by which noise is measured: a hub may change more than half of a band.
# Study: last_question.py.
_QUIET_SHARE = 0.35
# [1] That quantile of the size of a standard normal deviate. Derived.
_QUIET_DEVIATE = 0.454
# [classes] Of grey levels without rods, each with its noise. Study: last_question.py.
_CLASSES = 6
# [iterations] Of the weights with which the light is fitted. Stated.
_ITERATIONS = 6
# [1] Prior weight of unchanged light, over the number of pixels. Stated.
_SAME_LIGHT = 1e-3
# [1] A hidden sample has changed or not, with this probability. Derived.
_UNKNOWN = 0.5
# [1] Share of hidden samples above which a camera is not used: it looks past the bar. Stated.
_MOST_HIDDEN = 0.5
# [radii] Farthest shift in space: two diameters. Stated.
_FARTHEST_RADII = 4.0
# [radii] Largest displacement by a tilt where the band ends: 8 deg of a bar of 6 mm. Stated.
_MOST_TILT_RADII = 1.5
# [radii] First step of the search in space, and of the ends of strips in a camera. Derived.
_COARSE_RADII = 0.5
# [radii] Next steps, about the best places and then the best one. Derived.
_FINE_RADII = (0.25, 0.12, 0.06, 0.03)
# [places] Of the first step that go on. Study: last_question.py.
_KEPT = 8


@dataclass(frozen=True)
class _Line:
    """The middle of the drawn silhouette in a picture, straight to a fraction of a pixel.

    foot_px (m, 2), normal (m, 2): at m places along it. radius_px (m,): half its width there.
    """

    foot_px: np.ndarray
    normal: np.ndarray
    radius_px: np.ndarray

    @classmethod
    def of(cls, camera: Camera, axis: BarAxis, radius_mm: float) -> Self:
        """Return the line of a bar in a camera, in equal steps of a pixel or more.

        Raises Refused where no part of it lies before the camera.
        """
        _, middle_px, half_px = axis.outline_before(camera, radius_mm, _REACH_MM, _ALONG)
        length_px = lengths_px(middle_px)
        count = int(np.clip(length_px[-1], _SEGMENTS, _ALONG))
        place_px = np.linspace(0.0, length_px[-1], count)
        foot_px = at_lengths(place_px, length_px, middle_px)
        return cls(foot_px, normals(foot_px), np.interp(place_px, length_px, half_px))

    @property
    def width_radius_px(self) -> float:
        """Return half the width in the middle of the line."""
        return float(np.median(self.radius_px))

    @property
    def is_strip(self) -> bool:
        """Return whether the silhouette is longer than it may be shifted.

        Where a camera sees the bar end on it is shorter, and changes that end near it count as much as
        those that follow it.
        """
        length_px = np.linalg.norm(self.foot_px[-1] - self.foot_px[0])
        return bool(length_px > _FARTHEST_RADII * self.width_radius_px)

    def offsets(self, px: np.ndarray) -> np.ndarray:
        """Return how far lines through two points (..., 2, 2) px are from this one at its ends.

        Returns (..., 2) in radii, along the normal in its middle.
        """
        middle = len(self.foot_px) // 2
        normal = self.normal[middle]
        tangent = tangents_by(normal)
        away_px = px - self.foot_px[middle]
        along = away_px @ tangent  # (..., 2)
        across = away_px @ normal
        ends = (self.foot_px[[0, -1]] - self.foot_px[middle]) @ tangent
        slope = (across[..., 1] - across[..., 0]) / (along[..., 1] - along[..., 0])
        at_ends = across[..., :1] + slope[..., None] * (ends - along[..., :1])
        return at_ends / self.width_radius_px


@dataclass(frozen=True, eq=False)
class _Band:
    """The pixels of one camera, straightened along the drawn silhouette.

    changed (m, k): the confidence, 0 to 1, that a sample is not as without rods; m places along the
    line, k across it, from −_BAND_RADII to _BAND_RADII. drawn: where the drawn axis passes, as
    `_Line.offsets` has it.
    """

    camera: Camera
    line: _Line
    changed: np.ndarray
    drawn: np.ndarray

    def offsets(self, axes: BarAxis) -> np.ndarray:
        """Return by how many radii (..., 2) axes (..., 3) pass the drawn one at the ends."""
        return self.line.offsets(_projected(self.camera, axes)) - self.drawn

    def covered(self, offsets: np.ndarray) -> np.ndarray:
        """Return the share (n, m) of the width of strips that has changed, place by place.

        offsets (n, 2): of the strips' middles at both ends, in radii.
        """
        share = np.linspace(0.0, 1.0, len(self.changed))
        middle = offsets[:, :1] * (1.0 - share) + offsets[:, 1:] * share
        return 0.5 * (self._sum_to(middle + 1.0) - self._sum_to(middle - 1.0))

    @cached_property
    def _sums(self) -> np.ndarray:
        """Return the integral (m, k + 1) of the change across the band, in radii."""
        step = 2.0 * _BAND_RADII / self.changed.shape[1]
        return np.pad(np.cumsum(self.changed, axis=1), ((0, 0), (1, 0))) * step

    def _sum_to(self, radii: np.ndarray) -> np.ndarray:
        """Return the integral of the change up to lateral positions (n, m), in radii."""
        last = self.changed.shape[1]
        position = np.clip((radii / _BAND_RADII + 1.0) * 0.5 * last, 0.0, last)
        before = np.minimum(position.astype(int), last - 1)
        part = position - before
        rows = np.arange(len(self.changed))
        sum_before = self._sums[rows, before]
        sum_after = self._sums[rows, before + 1]
        return sum_before + part * (sum_after - sum_before)

    def coarsely_covered(self, offsets: np.ndarray) -> np.ndarray:
        """Return the mean share (n,) covered by strips, interpolated between steps of their ends."""
        ends = _steps(_FARTHEST_RADII + _MOST_TILT_RADII, _COARSE_RADII)
        share = np.mean(self.covered(grid_points(ends, ends)), axis=1).reshape(len(ends), -1)
        position = (offsets - ends[0]).T / _COARSE_RADII
        return map_coordinates(share, position, order=1, mode="nearest")


def _projected(camera: Camera, axes: BarAxis) -> np.ndarray:
    """Return two points (..., 2, 2) px of axes (..., 3) in a camera, as far apart as a band is long."""
    return camera.project(axes.points_at([-_REACH_MM, _REACH_MM]))


class PlaceComparison:
    """Compares places of a bar near a drawn axis by how well they explain the pictures."""

    def __init__(
        self,
        views: Sequence[View],
        curves: Mapping[int, Curves],
        axis: BarAxis,
        rods: Rods,
    ):
        """Straighten the pictures along the drawn bar, of each camera that shows it from a side.

        curves: by frame, of the wire, which is left out; the frames whose pictures are used.
        """
        self.axis = axis
        self.radius_mm = rods.bar.radius_mm
        self.bands = []
        for view in views:
            line = _Line.of(view.camera, axis, self.radius_mm)
            if not line.is_strip:
                continue
            changed = _change(*_straightened(view, line, curves, rods))
            if np.mean(changed == _UNKNOWN) > _MOST_HIDDEN:
                continue
            drawn = line.offsets(_projected(view.camera, axis))
            self.bands.append(_Band(view.camera, line, changed, drawn))

    @cached_property
    def best(self) -> BarAxis:
        """Return the axis nearby that covers most of the change in all cameras together."""
        across = axis_frame(self.axis.direction)
        scale = self.radius_mm * np.array([1.0, 1.0, 1.0 / _REACH_MM, 1.0 / _REACH_MM])
        moved = self.axis.shifted(across, np.diag(scale))
        slopes = [band.offsets(moved) for band in self.bands]  # (4, 2) each
        shift = _steps(_FARTHEST_RADII, _COARSE_RADII)
        tilt = _steps(_MOST_TILT_RADII, _COARSE_RADII)
        vectors = grid_points(shift, shift, tilt, tilt)
        total = sum(
            band.coarsely_covered(vectors @ slope) for band, slope in zip(self.bands, slopes)
        )
        vectors = vectors[np.argsort(-total, kind="stable")[:_KEPT]]
        for step in _FINE_RADII:
            vectors = _around(vectors, step)
            vectors = vectors[[np.argmax(self._covered(vectors, slopes))]]
        return self.axis.shifted(across, vectors[0] * scale)

    def _covered(self, vectors: np.ndarray, slopes: Sequence[np.ndarray]) -> np.ndarray:
        """Return the share of the change (n,) that each axis covers, the sum over cameras.

        vectors (n, 4): shifts and tilts of the axis. slopes: of each camera, the offsets (4, 2) by them.
        """
        total = np.zeros(len(vectors))
        for band, slope in zip(self.bands, slopes):
            total += np.mean(band.covered(vectors @ slope), axis=1)
        return total

    def gain(self, place: BarAxis, other: BarAxis) -> tuple[float, float]:
        """Return how much more of the change a place covers than another one, and its sigma."""
        total = variance = 0.0
        for band in self.bands:
            offsets = np.array([band.offsets(place), band.offsets(other)])
            more = np.subtract(*band.covered(offsets))
            parts = np.array([np.mean(part) for part in np.array_split(more, _SEGMENTS)])
            total += np.mean(parts)
            variance += np.var(parts, ddof=1) / _SEGMENTS
        return float(total), float(np.sqrt(variance))

    def apart_px(self, place: BarAxis, other: BarAxis) -> float:
        """Return how far apart two places are at most in any camera, px."""
        most = 0.0
        for band in self.bands:
            offsets = band.offsets(place) - band.offsets(other)
            most = max(most, float(np.max(np.abs(offsets))) * band.line.width_radius_px)
        return most


def _steps(farthest: float, step: float) -> np.ndarray:
    """Return steps (n,) from −farthest to farthest, 0 among them."""
    count = round(farthest / step)
    return step * np.arange(-count, count + 1)


def _around(vectors: np.ndarray, step: float) -> np.ndarray:
    """Return vectors (81 n, 4) on a grid of one step about each of n, itself in the middle."""
    near = _steps(step, step)
    return (vectors[:, None] + grid_points(near, near, near, near)).reshape(-1, vectors.shape[1])


def _straightened(
    view: View, line: _Line, curves: Mapping[int, Curves], rods: Rods
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the picture with the bar, that without rods, and which samples show them, (m, k)."""
    px = _samples_px(line)
    pictures = [_grey_at(px, view.frames[frame]) for frame in curves]
    static = np.median(pictures, axis=0)
    empty = _grey_at(px, view.background)
    is_free = _grey_at(px, _hidden_by_rods(view, curves, rods)) == 0.0
    return static, empty, np.isfinite(static) & np.isfinite(empty) & is_free


def _samples_px(line: _Line) -> np.ndarray:
    """Return points (m, k, 2), px, in a strip along the line, k across it."""
    per_radius = min(_PER_RADIUS, line.width_radius_px)
    count = 2 * int(np.ceil(_BAND_RADII * per_radius))
    share = (np.arange(count) + 0.5) / count  # of the band's width
    lateral_radii = _BAND_RADII * (2.0 * share - 1.0)
    offset_px = np.outer(line.radius_px, lateral_radii)  # (m, k)
    px = line.foot_px[:, None] + offset_px[..., None] * line.normal[:, None]
    return px.astype(np.float32)


def _grey_at(px: np.ndarray, picture: np.ndarray) -> np.ndarray:
    """Return a picture's grey (m, k) at points (m, k, 2) px, interpolated linearly; NaN outside."""
    grey = np.asarray(picture, dtype=np.float32)
    nan = float("nan")
    border = cv2.BORDER_CONSTANT
    return cv2.remap(grey, px, None, cv2.INTER_LINEAR, borderMode=border, borderValue=nan)


def _hidden_by_rods(view: View, curves: Mapping[int, Curves], rods: Rods) -> np.ndarray:
    """Return the pixels (h, w) that the wire or other rods cover in any frame: not 0."""
    hidden = np.zeros(view.background.shape, dtype=np.uint8)
    for frame, curve in curves.items():
        _hide_wire(hidden, view.camera, curve, rods)
        others = mask_rods(view.others, frame, hidden.shape)
        if others is not None:
            hidden |= others.astype(np.uint8)
    return hidden


def _hide_wire(hidden: np.ndarray, camera: Camera, curve: Curves, rods: Rods) -> None:
    """Mark the pixels (h, w) of a wire and around it."""
    points_mm = curve.points_mm
    radius_mm = rods.wire.radius_mm(curve.arc_mm)
    middle_px, half_px = outline(camera, points_mm, curve.tangents, radius_mm)
    seen = np.all(np.isfinite(middle_px), axis=1)
    width = int(np.ceil(2.0 * (np.max(half_px[seen], initial=0.0) + _BESIDE_WIRE_PX)))
    nodes = np.round(middle_px[seen]).astype(np.int32)
    cv2.polylines(hidden, [nodes], False, 1, thickness=width)


def _change(static: np.ndarray, empty: np.ndarray, shows: np.ndarray) -> np.ndarray:
    """Return the confidence (m, k) that samples are not as without rods; _UNKNOWN where hidden."""
    share = _averaged(shows)
    seen = shows & (share > 0.5)
    if not np.any(seen):
        return np.full(static.shape, _UNKNOWN)
    difference = np.where(shows, static - _relit(static, empty, shows), 0.0)
    mean = _averaged(difference) / np.maximum(share, 0.5)
    level = _averaged(np.where(shows, empty, 0.0)) / np.maximum(share, 0.5)
    z = np.abs(mean) / _noise(mean, level, seen)
    changed = np.clip((z - _NOISE_SIGMAS) / _SURE_SIGMAS, 0.0, 1.0)
    return np.where(seen, changed, _UNKNOWN)


def _averaged(samples: np.ndarray) -> np.ndarray:
    """Return samples (m, k) averaged along the bar."""
    across_along = (1, _AVERAGED)  # OpenCV's order
    return cv2.blur(samples.astype(np.float32), across_along)


def _light_design(empty: np.ndarray) -> np.ndarray:
    """Return the design (m, k, 4) of a picture (m, k) with a gain that is linear both ways, and an offset."""
    along = np.linspace(-1.0, 1.0, len(empty))[:, None]
    across = np.linspace(-1.0, 1.0, empty.shape[1])
    return np.stack([empty, empty * along, empty * across, np.ones_like(empty)], axis=-1)


def _relit(static: np.ndarray, empty: np.ndarray, shows: np.ndarray) -> np.ndarray:
    """Return the picture (m, k) without rods in the light of that with them.

    Its gain is linear in both directions of the band, by weights that leave out what has changed.
    """
    design = _light_design(empty)
    rows = design[shows].astype(float)
    grey = static[shows].astype(float)
    unchanged = np.array([1.0, 0.0, 0.0, 0.0])
    prior = _SAME_LIGHT * len(grey)
    light = unchanged
    for _ in range(_ITERATIONS):
        residual = grey - rows @ light
        scale = 2.0 * max(_quiet_sigma(residual), _LEAST_SIGMA)
        weighted = rows / ((1.0 + (residual / scale) ** 2) ** 2)[:, None]
        normal = weighted.T @ rows + prior * np.eye(4)
        light = np.linalg.solve(normal, weighted.T @ grey + prior * unchanged)
    return design @ light


def _quiet_sigma(deviations: np.ndarray) -> float:
    """Return the standard deviation of the least deviations' normal distribution."""
    return float(np.quantile(np.abs(deviations), _QUIET_SHARE)) / _QUIET_DEVIATE


def _noise(mean: np.ndarray, level: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Return the standard deviation (m, k) of differences, by the grey level without rods."""
    bounds = np.quantile(level[seen], np.linspace(0.0, 1.0, _CLASSES + 1))[1:-1]
    classes = np.digitize(level, bounds)
    sigma = np.ones_like(mean)
    for k in range(_CLASSES):
        members = classes == k
        own = mean[members & seen]
        if len(own):
            sigma[members] = max(_quiet_sigma(own), _LEAST_SIGMA)
    return sigma
