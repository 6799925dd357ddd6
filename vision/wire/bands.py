"""The pixels near a predicted rod: bands along it, cut into short segments.

A wire or bar is a cylinder that hides its background. What is seen across it is the background
outside the two edges and the rod's own shading between them, both blurred by the lens. The
background is known (a picture without the rod), the width is known (diameter and distance), and the
shading is smooth along the rod and over the frames. So one shading for all frames of a camera
(`shading.py`) is solved together with the positions of all short segments (`joint.py`).

Where the background is bright behind one segment and dark behind the next, both edges are seen
somewhere, and a dark rim or a highlight no longer pulls the position to one side.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.ndimage import correlate1d

from vision.geometry.optics import light_of
from vision.geometry.rows import Rows
from vision.pictures.pixel_noise import Noise

# [1] Twelve times the first derivative by five points. A formula, no threshold.
_FIRST_DIFFERENCE = (1.0, -8.0, 0.0, 8.0, -1.0)
# [1] Twelve times the second derivative by five points. A formula, no threshold.
_SECOND_DIFFERENCE = (-1.0, 16.0, -30.0, 16.0, -1.0)


@dataclass(frozen=True)
class Band(Rows):
    """The pixels near a predicted curve: n steps along it, k pixels across.

    offset_px (n, k): signed distance of each pixel along the curve's normal from the middle between
    the rod's edges on its row of pixels.
    grey, background (n, k): grey levels of the frame and of the picture without rods; pixels
    outside the picture, or hidden, are NaN.
    foot_px (n, 2): the curve. normal (n, 2): its unit normal. place (n,): the curve's parameter, mm.
    radius_px (n,): half the width that the rod has in the picture.
    static (n, k): a second background, of what stands still; (n, 0) where it was not read.
    """

    offset_px: np.ndarray
    grey: np.ndarray
    background: np.ndarray
    foot_px: np.ndarray
    normal: np.ndarray
    place: np.ndarray
    radius_px: np.ndarray
    static: np.ndarray | None = None

    def __post_init__(self):
        if self.static is None:
            object.__setattr__(self, "static", np.zeros((len(self.place), 0)))


def read_band(
    grey: np.ndarray,
    background: np.ndarray,
    curve_px: np.ndarray,
    place: np.ndarray,
    radius_px: np.ndarray,
    half_width_px: int,
    hidden: np.ndarray | None = None,
    static: np.ndarray | None = None,
) -> Band:
    """Read the pixels within half_width_px of a curve (m, 2), one step a pixel of the axis it runs
    along.

    hidden (h, w) bool: pixels that show something else. static (h, w): a second background.
    No pixel is interpolated and none is read twice, so that their noise stays independent. Normals
    point to the same side of the direction in which `place` grows, however that lies in the picture.
    """
    path = _Path.along_curve(curve_px, place, radius_px, grey.shape)
    line = path.lines(half_width_px)
    pixels = _BandPixels.of(path, line, grey.shape)
    across_px = line - path.middle[:, None]
    cosine = 1.0 / np.hypot(1.0, path.slope)
    offset_px = across_px * cosine[:, None] - path.between_edges_px[:, None]
    return Band(
        offset_px=path.side * offset_px,
        grey=pixels.unhidden_values(grey, hidden),
        background=pixels.values(background),
        foot_px=path.as_xy(path.step, path.middle),
        normal=path.side * path.as_xy(-path.slope * cosine, cosine),
        place=path.place,
        radius_px=path.radius_px,
        static=None if static is None else pixels.values(static),
    )


@dataclass(frozen=True)
class _Path:
    """A curve at n whole pixels of the axis of the picture that it runs along.

    along: 0 where that axis is x, 1 where it is y. step (n,): pixels on that axis. middle (n,): the
    curve on the other axis, px. place, radius_px (n,): as of `Band`.
    """

    along: int
    step: np.ndarray
    middle: np.ndarray
    place: np.ndarray
    radius_px: np.ndarray

    @staticmethod
    def along_curve(
        curve_px: np.ndarray, place: np.ndarray, radius_px: np.ndarray, shape: tuple[int, ...]
    ) -> "_Path":
        """Return the path of a curve (m, 2) within a picture of this shape (h, w)."""
        along = 0 if np.ptp(curve_px[:, 0]) >= np.ptp(curve_px[:, 1]) else 1
        order = np.argsort(curve_px[:, along])
        knots = curve_px[order, along]
        first, last = np.clip(np.round(knots[[0, -1]]), 0, shape[1 - along] - 1).astype(int)
        step = np.arange(first, last + 1)

        def at_steps(values: np.ndarray) -> np.ndarray:
            """Return values (m,) of the curve's points at the steps (n,)."""
            return np.interp(step, knots, np.asarray(values)[order])

        middle = at_steps(curve_px[:, 1 - along])
        return _Path(along, step, middle, at_steps(place), at_steps(radius_px))

    @cached_property
    def slope(self) -> np.ndarray:
        """Return the slope (n,) of the curve against the axis."""
        return np.gradient(self.middle) if len(self.step) > 1 else np.zeros(len(self.step))

    @property
    def between_edges_px(self) -> np.ndarray:
        """Return how far (n,) from the curve a row of pixels lies midway between the rod's edges, px
        along the normal.

        Rows run across at the angle of the slope. So a rod that widens in the picture has one edge
        on a row where it is wider, the other where it is narrower: r (1 ± r′ sin) from the curve.
        """
        if len(self.step) < 2:
            return np.zeros(len(self.step))
        sine = self.slope / np.hypot(1.0, self.slope)
        return self.radius_px * np.gradient(self.radius_px) * sine

    @property
    def side(self) -> float:
        """Return 1 where the axis's own normals point to the side that a band's do, else -1."""
        return 1.0 if (self.along == 0) == (self.place[-1] >= self.place[0]) else -1.0

    def as_xy(self, along: np.ndarray, across: np.ndarray) -> np.ndarray:
        """Return vectors (n, 2) in x and y of their parts (n,) along the axis and across it."""
        parts = (along, across) if self.along == 0 else (across, along)
        return np.stack(parts, axis=1)

    def lines(self, half_width_px: int) -> np.ndarray:
        """Return the pixels (n, k) within so many of the curve, on the other axis."""
        across = np.arange(-half_width_px, half_width_px + 1)
        return np.round(self.middle).astype(int)[:, None] + across


@dataclass(frozen=True)
class _BandPixels:
    """Pixels (n, k) of a band in pictures of one size.

    row, column: of each, within the picture; they broadcast to (n, k). is_outside (n, k) bool:
    which of them have been moved to the picture's border.
    """

    row: np.ndarray
    column: np.ndarray
    is_outside: np.ndarray

    @staticmethod
    def of(path: _Path, line: np.ndarray, shape: tuple[int, ...]) -> "_BandPixels":
        """Return the pixels along a path in pictures of a shape (h, w); line (n, k): across it."""
        within = np.clip(line, 0, shape[path.along] - 1)
        step = path.step[:, None]
        row, column = (within, step) if path.along == 0 else (step, within)
        return _BandPixels(row, column, within != line)

    def values(self, picture: np.ndarray) -> np.ndarray:
        """Return the values (n, k) of a picture at the pixels; NaN outside it."""
        values = picture[self.row, self.column].astype(float)
        values[self.is_outside] = np.nan
        return values

    def unhidden_values(self, picture: np.ndarray, hidden: np.ndarray | None) -> np.ndarray:
        """Return the values (n, k) of a picture at the pixels; NaN outside it, and where it shows
        something else, hidden (h, w) bool.
        """
        values = self.values(picture)
        if hidden is not None:
            values[self.values(hidden) > 0] = np.nan
        return values


@dataclass(frozen=True)
class Pieces(Rows):
    """Short segments of bands, all of one size: s segments of p pixels each.

    offset_px, grey, background (s, p): as in `Band`.
    slope, curvature (s, p): of the background across the rod, per px and per px².
    weight (s, p): one over the sigma of the noise; 0 where there is no pixel.
    place, radius_px (s,), foot_px, normal (s, 2): of the segment's middle.
    source (s,): the band of each. static (s, p): a second background; (s, 0) where there is none.
    noise_behind (s,): variance of the background's noise over that of grey, 1 where not given.
    """

    offset_px: np.ndarray
    grey: np.ndarray
    background: np.ndarray
    slope: np.ndarray
    curvature: np.ndarray
    weight: np.ndarray
    place: np.ndarray
    radius_px: np.ndarray
    foot_px: np.ndarray
    normal: np.ndarray
    source: np.ndarray
    static: np.ndarray | None = None
    noise_behind: np.ndarray | None = None

    def __post_init__(self):
        if self.static is None:
            object.__setattr__(self, "static", np.zeros((len(self.place), 0)))
        if self.noise_behind is None:
            object.__setattr__(self, "noise_behind", np.ones(len(self.place)))

    @staticmethod
    def none() -> "Pieces":
        """Return no segments."""
        pixels = np.zeros((0, 1))
        values = np.zeros(0)
        vectors = np.zeros((0, 2))
        source = np.zeros(0, dtype=int)
        return Pieces(*[pixels] * 6, values, values, vectors, vectors, source, pixels)

    def __len__(self) -> int:
        return len(self.place)

    @property
    def freedom(self) -> np.ndarray:
        """Return the degrees of freedom (s,): pixels less position, and background's gain and
        offset.
        """
        return np.maximum((self.weight > 0).sum(axis=1) - 3, 1)

    @property
    def relative_radius(self) -> np.ndarray:
        """Return the half-width (s,) over the mean of all segments.

        By it a common shift is multiplied: light that hides an edge hides a share of the width.
        """
        return self.radius_px / np.mean(self.radius_px)

    def columns(self, keep: np.ndarray | slice) -> "Pieces":
        """Return the segments with those of their pixels where keep (p,) holds, or of a slice."""
        names = ("offset_px", "grey", "background", "slope", "curvature", "weight")
        return replace(self, **{name: getattr(self, name)[:, keep] for name in names})

    def thinned(self, most: int) -> "Pieces":
        """Return every k-th segment, with the least k that leaves `most` or fewer."""
        return self.select(slice(None, None, 1 + len(self) // most))

    def show_rod(self, margin_px: float) -> np.ndarray:
        """Return which segments (s,) have all pixels of the expected rod and of a margin to it."""
        needed = np.abs(self.offset_px) <= self.radius_px[:, None] + margin_px
        return ~np.any(needed & (self.weight == 0), axis=1)

    def below(self, grey: float) -> "Pieces":
        """Return the segments with weight 0 for pixels of this grey level or above."""
        return replace(self, weight=np.where(self.grey < grey, self.weight, 0.0))

    def in_light(self, gamma: float, full_scale: float) -> "Pieces":
        """Return the segments with light in place of grey levels, of the same full scale.

        gamma: of the transfer curve, grey = full scale · light^(1 / gamma).
        """
        if gamma == 1.0:
            return self
        light, light_per_grey = light_of(self.grey, full_scale, gamma)
        behind, behind_per_grey = light_of(self.background, full_scale, gamma)
        by_grey = full_scale * light_per_grey
        by_behind = full_scale * behind_per_grey
        by_square = (gamma - 1.0) * by_behind / np.maximum(self.background, 1.0)
        return replace(
            self,
            grey=full_scale * light,
            background=full_scale * behind,
            slope=by_behind * self.slope,
            curvature=by_behind * self.curvature + by_square * self.slope**2,
            weight=self.weight / by_grey,
        )

    def moved(self, shift_px: np.ndarray) -> "Pieces":
        """Return the same pixels seen from curves moved by shift_px (s,) along their normals."""
        return replace(
            self,
            offset_px=self.offset_px - shift_px[:, None],
            foot_px=self.foot_px + shift_px[:, None] * self.normal,
        )


def cut_pieces(bands: Sequence[Band], length_px: int, noise: Noise) -> Pieces:
    """Split bands into segments of length_px steps; what is left over at a band's end is not used.

    Either all bands have a second background (`static`) or none has. Where they have, the pass fits no
    shading, and slopes and curvatures are 0.
    """
    counts = [len(band.place) // length_px for band in bands]
    whole = []
    for band, count in zip(bands, counts):
        if count:
            whole.append(band.select(slice(count * length_px)))
    if not whole:
        return Pieces.none()
    return _cut(Band.join(whole), length_px, noise, np.repeat(np.arange(len(bands)), counts))


def _cut(band: Band, length_px: int, noise: Noise, source: np.ndarray) -> Pieces:
    """Split one band, of a whole number of segments, into segments; source (s,): of each."""
    count = len(source)
    is_known = np.isfinite(band.grey) & np.isfinite(band.background)  # (n, k)
    slope, curvature = _derivatives(band)

    def known(values: np.ndarray) -> np.ndarray:
        """Return values (n, k) by segment (s, p), 0 where a pixel is not known."""
        return np.where(is_known, values, 0.0).reshape(count, -1)

    return Pieces(
        offset_px=band.offset_px.reshape(count, -1),
        grey=known(band.grey),
        background=known(band.background),
        slope=known(slope),
        curvature=known(curvature),
        weight=known(1.0 / noise.sigma(np.where(is_known, band.grey, 0.0))),
        place=_means(band.place, length_px),
        radius_px=_means(band.radius_px, length_px),
        foot_px=_means(band.foot_px, length_px),
        normal=_means(band.normal, length_px),
        source=source,
        static=known(band.static) if band.static.size else None,
    )


def _means(values: np.ndarray, length: int) -> np.ndarray:
    """Return the mean (s, …) of each `length` values (s · length, …) that follow one another."""
    return values.reshape(-1, length, *values.shape[1:]).mean(axis=1)


def _derivatives(band: Band) -> tuple[np.ndarray, np.ndarray]:
    """Return slope and curvature (n, k) of the background across the rod, per px and per px².

    They are 0 throughout a band with a second background. By five points: three would lose a sixth
    of the slope of an edge blurred by a pixel.
    """
    if band.static.size:
        return np.zeros(band.grey.shape), np.zeros(band.grey.shape)
    pitch_px = band.offset_px[:, 1:2] - band.offset_px[:, :1]
    behind = np.nan_to_num(band.background)
    slope = correlate1d(behind, _FIRST_DIFFERENCE, axis=1, mode="nearest")
    curvature = correlate1d(behind, _SECOND_DIFFERENCE, axis=1, mode="nearest")
    return slope / (12.0 * pitch_px), curvature / (12.0 * pitch_px**2)
