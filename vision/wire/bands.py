"""The pixels near a predicted rod: bands along it, cut into short segments.

A wire or bar is a cylinder that hides its background. What is seen across it is the background
outside the two edges and the rod's own shading between them, both blurred by the lens. The
background is known (a picture without the rod), the width is known (diameter and distance), and the
shading is smooth along the rod and over the frames. So the shading is estimated once for all frames
of a camera (`shading.py`), and only then the position of each short segment (`joint.py`).

Where the background is bright behind one segment and dark behind the next, both edges are seen
somewhere, and a dark rim or a highlight no longer pulls the position to one side.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.pictures.pixel_noise import Noise


@dataclass(frozen=True)
class Band:
    """Hold the pixels near a predicted curve: n steps along it, k pixels across.

    offset_px (n, k): signed distance of each pixel from the curve along its normal.
    grey, background (n, k): grey levels of the frame and of the picture without rods; pixels
    outside the picture, or hidden, are NaN.
    foot_px (n, 2): the curve. normal (n, 2): its unit normal. place (n,): the curve's parameter, mm.
    radius_px (n,): half the width that the rod has in the picture.
    still (n, k): another background, of what stands still; (n, 0) where it was not read.
    """

    offset_px: np.ndarray
    grey: np.ndarray
    background: np.ndarray
    foot_px: np.ndarray
    normal: np.ndarray
    place: np.ndarray
    radius_px: np.ndarray
    still: np.ndarray | None = None

    def __post_init__(self):
        if self.still is None:
            object.__setattr__(self, "still", np.zeros((len(self.place), 0)))


def read_band(
    grey: np.ndarray,
    background: np.ndarray,
    curve_px: np.ndarray,
    place: np.ndarray,
    radius_px: np.ndarray,
    half_width_px: int,
    hidden: np.ndarray | None = None,
    still: np.ndarray | None = None,
) -> Band:
    """Read the pixels within half_width_px of a curve (m, 2), one step a pixel of the axis it runs along.

    hidden (h, w) bool: pixels that show something else. still (h, w): another background.
    No pixel is interpolated and none is read twice, so that their noise stays independent. Normals
    point to the same side of the direction in which `place` grows, however that lies in the picture.
    """
    along = 0 if np.ptp(curve_px[:, 0]) >= np.ptp(curve_px[:, 1]) else 1
    order = np.argsort(curve_px[:, along])
    curve = curve_px[order]
    knots = curve[:, along]
    step = _steps_between(knots[0], knots[-1], grey.shape[1 - along])
    middle = np.interp(step, knots, curve[:, 1 - along])
    line = np.round(middle).astype(int)[:, None] + np.arange(-half_width_px, half_width_px + 1)

    pixels = _BandPixels(along, step, line)
    levels = pixels.values(grey)
    if hidden is not None:
        levels[pixels.values(hidden) > 0] = np.nan

    slope = np.gradient(middle) if len(step) > 1 else np.zeros(len(step))
    cosine = 1.0 / np.hypot(1.0, slope)
    place = np.asarray(place)[order]
    side = 1.0 if (along == 0) == (place[-1] >= place[0]) else -1.0
    return Band(
        offset_px=side * (line - middle[:, None]) * cosine[:, None],
        grey=levels,
        background=pixels.values(background),
        foot_px=pixels.as_xy(step, middle),
        normal=side * pixels.as_xy(-slope * cosine, cosine),
        place=np.interp(step, knots, place),
        radius_px=np.interp(step, knots, np.asarray(radius_px)[order]),
        still=None if still is None else pixels.values(still),
    )


def _steps_between(first: float, last: float, size: int) -> np.ndarray:
    """Return the whole pixels (n,) from first to last along an axis of so many pixels."""
    ends = np.clip(np.round([first, last]), 0, size - 1).astype(int)
    return np.arange(ends[0], ends[1] + 1)


@dataclass(frozen=True)
class _BandPixels:
    """Pixels of a band: at n steps along one axis of the picture, k pixels along the other.

    along: 0 where the band runs along x, 1 along y. step (n,), line (n, k): pixels on the two axes.
    """

    along: int
    step: np.ndarray
    line: np.ndarray

    def values(self, picture: np.ndarray) -> np.ndarray:
        """Return the values (n, k) of a picture at the pixels; NaN outside it."""
        size = picture.shape[self.along]
        line = np.clip(self.line, 0, size - 1)
        step = self.step[:, None]
        at = (line, step) if self.along == 0 else (step, line)
        values = picture[at].astype(float)
        values[line != self.line] = np.nan
        return values

    def as_xy(self, along: np.ndarray, across: np.ndarray) -> np.ndarray:
        """Return vectors (n, 2) in x and y of their parts (n,) along the band's axis and across it."""
        parts = (along, across) if self.along == 0 else (across, along)
        return np.stack(parts, axis=1)




@dataclass(frozen=True)
class Pieces:
    """Hold short segments of bands, all of one size: s segments of p pixels each.

    offset_px, grey, background (s, p): as in `Band`.
    slope, curvature (s, p): of the background across the rod, per px and per px².
    weight (s, p): one over the sigma of the noise; 0 where there is no pixel.
    place, radius_px (s,), foot_px, normal (s, 2): of the segment's middle.
    source (s,): the band of each. still (s, p): another background; (s, 0) where there is none.
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
    still: np.ndarray | None = None

    def __post_init__(self):
        if self.still is None:
            object.__setattr__(self, "still", np.zeros((len(self.place), 0)))

    def __len__(self) -> int:
        return len(self.place)

    @property
    def freedom(self) -> np.ndarray:
        """Return the degrees of freedom (s,): pixels less position, and background's gain and offset."""
        return np.maximum((self.weight > 0).sum(axis=1) - 3, 1)

    def select(self, keep: np.ndarray | slice) -> "Pieces":
        """Return the segments where keep (s,) holds, at these indices, or of a slice."""
        return Pieces(*(getattr(self, name)[keep] for name in self.__dataclass_fields__))

    def columns(self, keep: np.ndarray | slice) -> "Pieces":
        """Return the segments with those of their pixels where keep (p,) holds, or of a slice."""
        names = ("offset_px", "grey", "background", "slope", "curvature", "weight")
        return replace(self, **{name: getattr(self, name)[:, keep] for name in names})

    def show_rod(self, margin_px: float) -> np.ndarray:
        """Return which segments (s,) lack no pixel of the expected rod, nor within a margin of it."""
        needed = np.abs(self.offset_px) <= self.radius_px[:, None] + margin_px
        return ~np.any(needed & (self.weight == 0), axis=1)

    def below(self, grey: float) -> "Pieces":
        """Return the segments with weight 0 for pixels of this grey level or above."""
        return replace(self, weight=np.where(self.grey < grey, self.weight, 0.0))

    def moved(self, shift_px: np.ndarray) -> "Pieces":
        """Return the same pixels seen from curves moved by shift_px (s,) along their normals."""
        return replace(
            self,
            offset_px=self.offset_px - shift_px[:, None],
            foot_px=self.foot_px + shift_px[:, None] * self.normal,
        )


def cut_pieces(bands: Sequence[Band], length_px: int, noise: Noise) -> Pieces:
    """Cut bands into segments of length_px steps; what is left over at a band's end is not used.

    Either all bands have a second background (`still`) or none has. Where they have, the pass fits no
    shading, and slopes and curvatures are 0.
    """
    counts = [len(band.place) // length_px for band in bands]
    if not any(counts):
        return _no_pieces()
    joined = {}
    for name in Band.__dataclass_fields__:
        parts = []
        for band, count in zip(bands, counts):
            if count:
                parts.append(getattr(band, name)[: count * length_px])
        joined[name] = np.concatenate(parts)
    return _cut(Band(**joined), length_px, noise, np.repeat(np.arange(len(bands)), counts))


def _no_pieces() -> Pieces:
    """Return no segments."""
    pixels = np.zeros((0, 1))
    return Pieces(
        offset_px=pixels,
        grey=pixels,
        background=pixels,
        slope=pixels,
        curvature=pixels,
        weight=pixels,
        place=np.zeros(0),
        radius_px=np.zeros(0),
        foot_px=np.zeros((0, 2)),
        normal=np.zeros((0, 2)),
        source=np.zeros(0, dtype=int),
        still=pixels,
    )


def _cut(band: Band, length_px: int, noise: Noise, source: np.ndarray) -> Pieces:
    """Cut one band, of a whole number of segments, into segments; source (s,): of each."""
    count = len(source)
    is_known = np.isfinite(band.grey) & np.isfinite(band.background)  # (n, k)
    if band.still.size:
        slope = np.zeros(is_known.shape)
        curvature = np.zeros(is_known.shape)
        still = np.where(is_known, band.still, 0.0).reshape(count, -1)
    else:
        slope, curvature = _derivatives(band)
        still = None

    def known(values: np.ndarray) -> np.ndarray:
        """Return values (n, k) by segment (s, p), 0 where a pixel is not known."""
        return np.where(is_known, values, 0.0).reshape(count, -1)

    def middle(values: np.ndarray) -> np.ndarray:
        """Return the mean (s, …) over each segment of values (n, …)."""
        return values.reshape(count, length_px, *values.shape[1:]).mean(axis=1)

    return Pieces(
        offset_px=band.offset_px.reshape(count, -1),
        grey=known(band.grey),
        background=known(band.background),
        slope=known(slope),
        curvature=known(curvature),
        weight=known(1.0 / noise.sigma(np.where(is_known, band.grey, 0.0))),
        place=middle(band.place),
        radius_px=middle(band.radius_px),
        foot_px=middle(band.foot_px),
        normal=middle(band.normal),
        source=source,
        still=still,
    )


def _derivatives(band: Band) -> tuple[np.ndarray, np.ndarray]:
    """Return slope and curvature (n, k) of the background across the rod, per px and per px².

    They are 0 at the band's borders. By five points: three would lose a sixth of the slope of an
    edge blurred by a pixel.
    """
    pitch = band.offset_px[:, 1:2] - band.offset_px[:, :1]
    behind = np.nan_to_num(band.background)
    width = behind.shape[1]
    wide = np.pad(behind, ((0, 0), (2, 2)), mode="edge")
    two_before = wide[:, :width]
    before = wide[:, 1 : 1 + width]
    after = wide[:, 3 : 3 + width]
    two_after = wide[:, 4 : 4 + width]
    slope = (8.0 * (after - before) - (two_after - two_before)) / (12.0 * pitch)
    curvature = 16.0 * (after + before) - (two_after + two_before) - 30.0 * behind
    return slope, curvature / (12.0 * pitch**2)
