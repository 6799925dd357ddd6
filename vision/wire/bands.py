"""Where a round, lit rod lies in a picture: its axis to a small part of a pixel, with a sigma.

A wire or bar is a cylinder that hides its background. What is seen across it is the background outside the two
edges, the rod's own shading between them, both blurred by the lens. The background is known (a picture without
the rod), the width is known (diameter and distance), the shading is smooth along the rod and over the frames.
So the shading is estimated once for all frames of a camera, and only then the position of each short piece.
Where the background is bright on one piece and dark on the next, both edges are seen somewhere, and a dark rim
or a highlight no longer pulls the position to one side.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.pictures.pixel_noise import Noise


@dataclass(frozen=True)
class Band:
    """The pixels beside a predicted curve: n steps along it, k pixels across.

    offset_px (n, k): signed distance of each pixel from the curve along its normal; grey, background (n, k);
    foot_px (n, 2): the curve; normal (n, 2): its unit normal; place (n,): the curve's own parameter (mm);
    radius_px (n,): half the width that the rod has in the picture. still (n, k), or (n, 0) where it was not asked for:
    another background, of what stands still. Pixels outside the picture, or hidden, are NaN.
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
    """Pixels within `half_width_px` of a curve (m, 2), stepping one pixel along the axis it runs along. hidden (h, w):
    those that show something else, bool; still (h, w): another background.

    No pixel is interpolated and none is read twice, so that their noise stays independent. Normals point to the same
    hand of the way along which `place` grows, whichever way that is in the picture.
    """
    along = 0 if np.ptp(curve_px[:, 0]) >= np.ptp(curve_px[:, 1]) else 1
    order = np.argsort(curve_px[:, along])
    curve, place, radius = curve_px[order], np.asarray(place)[order], np.asarray(radius_px)[order]
    first, last = np.clip(np.round(curve[[0, -1], along]), 0, grey.shape[1 - along] - 1).astype(int)
    step = np.arange(first, last + 1)
    across = np.interp(step, curve[:, along], curve[:, 1 - along])
    slope = np.gradient(across) if len(step) > 1 else np.zeros(len(step))
    cosine = 1.0 / np.hypot(1.0, slope)
    line = np.round(across).astype(int)[:, None] + np.arange(-half_width_px, half_width_px + 1)
    offset = (line - across[:, None]) * cosine[:, None]
    foot, normal = np.empty((len(step), 2)), np.empty((len(step), 2))
    foot[:, along], foot[:, 1 - along] = step, across
    normal[:, along], normal[:, 1 - along] = -slope * cosine, cosine
    pictures = [picture for picture in (grey, background, still) if picture is not None]
    pixels = _pick(pictures, step, line, along)
    if hidden is not None:
        pixels[0][_pick([hidden], step, line, along)[0] > 0] = np.nan
    at = [np.interp(step, curve[:, along], values) for values in (place, radius)]
    left = 1.0 if (along == 0) == (place[-1] >= place[0]) else -1.0
    return Band(left * offset, *pixels[:2], foot, left * normal, *at, *pixels[2:])


def _pick(pictures, step, line, along) -> list[np.ndarray]:
    """Values (n, k) of pictures of one size at the band's pixels; NaN outside them."""
    size = pictures[0].shape[along]
    outside = (line < 0) | (line >= size)
    line = np.clip(line, 0, size - 1)
    at = (line, step[:, None]) if along == 0 else (step[:, None], line)
    values = [picture[at].astype(float) for picture in pictures]
    if np.any(outside):
        for one in values:
            one[outside] = np.nan
    return values


@dataclass(frozen=True)
class Pieces:
    """Short pieces of bands, all of one size: p pixels each, s pieces.

    offset_px, grey, background, weight (s, p): weight is one over the noise's sigma, 0 where there is no pixel;
    slope, curvature (s, p): of the background across the rod, per px and px²;
    place, radius_px (s,); foot_px, normal (s, 2) at the middle; source (s,) which band; still (s, p) or
    (s, 0): another background, of bands that have one.
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
        """Pixels (s,) less the position and the background's gain and offset that each piece has of its own."""
        return np.maximum((self.weight > 0).sum(axis=1) - 3, 1)

    def select(self, keep: np.ndarray | slice) -> "Pieces":
        """The pieces where `keep` (s,) holds, or of a slice."""
        return Pieces(*(getattr(self, name)[keep] for name in self.__dataclass_fields__))

    def columns(self, keep: np.ndarray | slice) -> "Pieces":
        """The same pieces with those of their pixels where `keep` (p,) holds, or of a slice."""
        names = ("offset_px", "grey", "background", "slope", "curvature", "weight")
        return replace(self, **{name: getattr(self, name)[:, keep] for name in names})

    def show_rod(self, margin_px: float) -> np.ndarray:
        """Which pieces (s,) lack no pixel of the rod, where it is expected, nor within a margin beside it."""
        needed = np.abs(self.offset_px) <= self.radius_px[:, None] + margin_px
        return ~np.any(needed & (self.weight == 0), axis=1)

    def below(self, grey: float) -> "Pieces":
        """The same pieces; pixels of this grey level or above weigh nothing."""
        return replace(self, weight=np.where(self.grey < grey, self.weight, 0.0))

    def moved(self, shift_px: np.ndarray) -> "Pieces":
        """The same pixels seen from curves moved by shift_px (s,) along their normals."""
        return replace(
            self,
            offset_px=self.offset_px - shift_px[:, None],
            foot_px=self.foot_px + shift_px[:, None] * self.normal,
        )


def cut_pieces(bands: Sequence[Band], length_px: int, noise: Noise) -> Pieces:
    """All bands cut into pieces of `length_px` steps; what is left over at the end is not used.

    Bands with another background, as all have or none, are for a look that asks for no light: their slopes and
    curvatures are 0.
    """
    counts = [len(band.place) // length_px for band in bands]
    if not any(counts):
        return Pieces(
            *[np.zeros((0, 1))] * 6,
            np.zeros(0),
            np.zeros(0),
            np.zeros((0, 2)),
            np.zeros((0, 2)),
            np.zeros(0, dtype=int),
            np.zeros((0, 1)),
        )
    used = [(band, count * length_px) for band, count in zip(bands, counts) if count]
    whole = Band(
        *(
            np.concatenate([getattr(band, name)[:end] for band, end in used])
            for name in Band.__dataclass_fields__
        )
    )
    return Pieces(*_cut(whole, length_px, noise, np.repeat(np.arange(len(bands)), counts)))


def _cut(band: Band, length_px: int, noise: Noise, source: np.ndarray):
    count = len(source)
    flat = [a.reshape(count, -1) for a in (band.offset_px, band.grey, band.background)]
    still = band.still.reshape(count, -1)
    flat += (
        [np.zeros(flat[0].shape)] * 2
        if still.size
        else [a.reshape(count, -1) for a in _changes(band)]
    )
    in_picture = np.isfinite(flat[1]) & np.isfinite(flat[2])
    weight = np.where(in_picture, 1.0 / noise.sigma(np.where(in_picture, flat[1], 0.0)), 0.0)
    flat[1:] = [np.where(in_picture, values, 0.0) for values in flat[1:]]
    means = [a.reshape(count, length_px, -1).mean(axis=1) for a in (band.foot_px, band.normal)]
    singles = [a.reshape(count, length_px).mean(axis=1) for a in (band.place, band.radius_px)]
    if still.size:
        still = np.where(in_picture, still, 0.0)
    return (*flat, weight, singles[0], singles[1], *means, source, still)


def _changes(band: Band) -> list[np.ndarray]:
    """Slope and curvature (n, k) each of the background across the rod, per px and per px²; 0 at the band's rims.

    By five points: three would lose a sixth of the slope of an edge blurred by a pixel.
    """
    pitch = band.offset_px[:, 1:2] - band.offset_px[:, :1]
    behind, width = np.nan_to_num(band.background), band.background.shape[1]
    wide = np.concatenate([behind[:, :1]] * 2 + [behind] + [behind[:, -1:]] * 2, axis=1)
    two_before, before, after, two_after = (wide[:, k : k + width] for k in (0, 1, 3, 4))
    return [
        (8.0 * (after - before) - (two_after - two_before)) / (12.0 * pitch),
        (16.0 * (after + before) - (two_after + two_before) - 30.0 * behind) / (12.0 * pitch**2),
    ]
