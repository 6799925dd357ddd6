"""A curved dark or light line followed through one picture between two given points: a whisker, a wire, a cable.

    ridge of the picture → cheapest path → profile fit of short pieces beside it → points with sigma

Nothing is known beforehand but the two ends: not the width (which may change along the line, down to a part of a
pixel), not the contrast, not the background. So the background is made from both sides of the line, and width and
blur are those under which the shared shading explains the pieces best.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.interpolate import UnivariateSpline
from scipy.ndimage import convolve, gaussian_filter
from scipy.optimize import minimize
from skimage.graph import route_through_array

from vision.geometry.refusals import Refused
from vision.geometry.robust import robust_sigma
from vision.pictures.pixel_noise import Noise, noise_by_level
from vision.wire.bands import Pieces, cut_pieces, read_band
from vision.wire.points import LinePoints
from vision.wire.shading import Knots, fit_shading, locate, wave_prior
from vision.wire.trace import to_points, trace

# [px] A line bends no farther than this out of the rectangle of its ends. Set by eye. Study:
# tests/studies/real/whiskers.py.
_AROUND_PX = 25
# [px] The given ends are taken from a screen by hand. Stated.
_SNAP_PX = 3
# [px] Blur of the second derivatives that show a ridge: that of a line 3 px wide. Set by eye.
# Study: tests/studies/real/whiskers.py.
_RIDGE_PX = 1.5
# [1] Share of pixels less curved than one that plainly shows a line. Set by eye. Study:
# tests/studies/real/whiskers.py.
_PLAIN = 0.9
# [1] A pixel that shows no line costs one over this, twenty times a plain one's. Set by eye.
# Study: tests/studies/real/whiskers.py.
_LEAST_RIDGE = 0.05
# [px] Background read on either side of the edges. Set by eye. Study:
# tests/studies/real/whiskers.py.
_BESIDE_PX = 5
# [px] Between knots of the shading along the line. Origin not known. Study:
# tests/studies/real/whiskers.py.
_KNOT_PX = 25.0
# [1] Half-widths over blur from which what is behind the axis is hidden. Set by eye. Study:
# tests/studies/real/whiskers.py.
_HIDES = 1.5
# [px] Half-widths that the fit starts from, from that of a fine tip to that of a thick base.
# Stated.
_FIRST_RADII_PX = (0.6, 1.2, 2.4, 4.0)
# [1] Of the blur's logarithm: it is found with the width, which it would stand in for. Study:
# tests/vision/wire/test_follow.py.
_BLUR_SIGMA = 0.02
# [functions] One brightness across: where neither width nor background is known, more would stand
# in for a shift. Derived.
_EVEN = 1
# [rounds] Of placing pieces and fitting widths. Origin not known. Study:
# tests/studies/real/whiskers.py.
_ROUNDS = 3
# [px] A path goes from pixel to pixel. Derived.
_PATH_SIGMA_PX = 0.5
# [px] Of a point when a curve is laid through, so that it does not follow every one. Set by eye.
# Study: tests/studies/real/whiskers.py.
# of a point when a curve is laid through, so that it does not follow every one
_LEAST_SIGMA_PX = 0.05
# [px] Limits of half-width and blur: thinner shows nothing, sharper is a pixel's edge. Stated.
_RADII_PX, _BLURS_PX = (0.3, 12.0), (0.4, 4.0)
# [pieces] Fewer are no line. Origin not known. Study: tests/vision/wire/test_follow.py.
_FEWEST = 5
# [sigma] Of a piece, over its noise. Set by eye. Study: tests/studies/real/whiskers.py.
_LEAST_CONTRAST = 3.0
# [px] Half-widths and blur before any is known: they are fitted. Set by eye.
_FIRST_PX = 0.8
# [px] Over which the grey level is taken that a pixel's noise is told of. Set by eye.
_LEVEL_BLUR_PX = 1.5
# [blurs] Beyond a line's edge, from where its own light has ended to a fifteenth. Derived.
_CLEAR_BLURS = 1.5


@dataclass(frozen=True)
class Followed:
    """A line between two points.

    points: n points in order from the start, their `place` the arc length in px; radius_px (n,) half the width;
    blur_px; chi2: median misfit per pixel; scatter: see `scatter_of`, by which the sigmas are widened where it is
    above 1. Of a line thinner than its blur only width times contrast is told.
    """

    points: LinePoints
    radius_px: np.ndarray
    blur_px: float
    chi2: float
    scatter: float


@dataclass(frozen=True)
class _Width:
    """Half-widths at the two ends and blur, px."""

    start_px: float
    end_px: float
    blur_px: float

    def radius(self, place, length) -> np.ndarray:
        """Half-width (n,) at places along a line of this length."""
        return self.start_px + (self.end_px - self.start_px) * np.clip(
            np.asarray(place) / length, 0.0, 1.0
        )

    @property
    def hides(self) -> bool:
        """Whether the line is so thick that its middle shows nothing of the background."""
        return min(self.start_px, self.end_px) > _HIDES * self.blur_px


def follow(
    grey: np.ndarray,
    start_px: Sequence[float],
    end_px: Sequence[float],
    *,
    dark: bool = True,
    noise: Noise | None = None,
    piece_px: int = 8,
) -> Followed:
    """Points of a line in `grey` (rows, columns) from near start_px (x, y) to near end_px.

    dark: darker than what is behind it. noise: of a pixel; measured in the picture where None. piece_px: length of
    the pieces, each of which gives one point. Raises Refused where an end lies outside the picture or no line that
    stands out of the noise joins the ends.
    """
    grey = np.asarray(grey, dtype=float)
    noise = noise_of(grey) if noise is None else noise
    path = _cheapest_path(-grey if dark else grey, start_px, end_px)
    curve, width = (
        _smooth(path, np.full(len(path), _PATH_SIGMA_PX)),
        _Width(_FIRST_PX, _FIRST_PX, 1.0),
    )
    for _ in range(_ROUNDS):
        width = _best_width(_pieces(grey, curve, width, piece_px, noise), width)
        pieces = _pieces(grey, curve, width, piece_px, noise)
        traced = trace(pieces, _knots(pieces), width.blur_px, _BLUR_SIGMA, _EVEN)
        points, _ = to_points(traced)
        contrast = np.median(traced.located.contrast) / np.sqrt(max(traced.misfit, 1.0))
        _refuse_nothing(len(points), contrast, start_px, end_px)
        points = points.select(np.argsort(points.place))
        curve = _smooth(points.px, np.maximum(points.sigma_px, _LEAST_SIGMA_PX), curve)
    scatter = scatter_of(points)
    points = replace(points, sigma_px=points.sigma_px * max(scatter, 1.0))
    return Followed(
        points, width.radius(points.place, _arc(curve)[-1]), width.blur_px, traced.misfit, scatter
    )


def scatter_of(points: LinePoints) -> float:
    """How far neighbouring points scatter in their sigmas: 1 where the noise of the pixels is white and as measured.

    A line is a parabola over four points, so that what remains of their third difference is noise. Median, so that
    a few bad points do not count. Video codecs leave noise that pixels share, which no single pixel tells.
    """
    across = np.lib.stride_tricks.sliding_window_view(points.px, 4, axis=0).transpose(0, 2, 1)
    normal = points.normal[1:-2] + points.normal[2:-1]
    off = np.einsum(
        "nij,nj->ni", across - across[:, :1], normal / np.linalg.norm(normal, axis=1, keepdims=True)
    )
    place = np.lib.stride_tricks.sliding_window_view(points.place, 4)
    apart = place[:, :, None] - place[:, None, :] + np.eye(4)
    share = 1.0 / np.prod(apart, axis=2)  # weights of the third divided difference
    sigma = np.lib.stride_tricks.sliding_window_view(points.sigma_px, 4)
    z = np.sum(share * off, axis=1) / np.sqrt(np.sum((share * sigma) ** 2, axis=1))
    return robust_sigma(z)


def noise_of(grey: np.ndarray) -> Noise:
    """Noise of a single picture from its second differences along both axes, which smooth scenes do not have.

    Medians in classes of equal grey, so that edges and lines do not count (Immerkær's filter, 1996).
    """
    ripple = np.abs(convolve(grey, np.outer([1, -2, 1], [1, -2, 1]) / 6.0))
    return noise_by_level(gaussian_filter(grey, _LEVEL_BLUR_PX)[1:-1, 1:-1], ripple[1:-1, 1:-1])


def _refuse_nothing(count: int, contrast: float, start_px, end_px) -> None:
    where = f"between ({start_px[0]:.0f}, {start_px[1]:.0f}) and ({end_px[0]:.0f}, {end_px[1]:.0f})"
    if count < _FEWEST:
        raise Refused(
            f"{count} pieces of a line are seen {where}, {_FEWEST} are needed", code="no_line_seen"
        )
    if contrast < _LEAST_CONTRAST:
        raise Refused(
            f"no line stands out {where}: {contrast:.1f} times the noise, {_LEAST_CONTRAST:.0f} are needed",
            code="no_line_seen",
        )


def _cheapest_path(grey, start_px, end_px) -> np.ndarray:
    """Pixels (n, 2) of the path along the ridge of a light line between two points."""
    ends = np.array([start_px, end_px], dtype=float)
    size = np.array(grey.shape[::-1])
    if np.any(ends < 0) or np.any(ends > size - 1):
        raise Refused(
            f"an end of the line lies outside the picture of {size[0]} x {size[1]} px: {ends.tolist()}",
            code="line_outside_picture",
        )
    low = np.maximum(np.floor(ends.min(axis=0)) - _AROUND_PX, 0).astype(int)
    high = np.minimum(np.ceil(ends.max(axis=0)) + _AROUND_PX + 1, size).astype(int)
    ridge = _ridge(grey[low[1] : high[1], low[0] : high[0]])
    plain = np.minimum(
        ridge / max(np.quantile(ridge, _PLAIN), 1e-9), 1.0
    )  # a darker neighbour is not a better one
    cost = 1.0 / (plain + _LEAST_RIDGE)
    first, last = (_snap(ridge, end - low) for end in ends)
    path, _ = route_through_array(cost, first, last, fully_connected=True, geometric=True)
    return np.array(path)[:, ::-1] + low


def _ridge(grey) -> np.ndarray:
    """How much a picture is curved downwards across its steepest direction (Steger 1998), never below 0."""
    xx, yy, xy = (
        gaussian_filter(grey, _RIDGE_PX, order=order) for order in ((0, 2), (2, 0), (1, 1))
    )
    return np.maximum(0.5 * (np.hypot(xx - yy, 2.0 * xy) - xx - yy), 0.0)


def _snap(ridge, px) -> tuple[int, int]:
    """Row and column of the strongest ridge near a point (x, y)."""
    column, row = np.round(px).astype(int)
    top, left = max(row - _SNAP_PX, 0), max(column - _SNAP_PX, 0)
    near = ridge[top : row + _SNAP_PX + 1, left : column + _SNAP_PX + 1]
    down, right = np.unravel_index(np.argmax(near), near.shape)
    return top + int(down), left + int(right)


def _arc(curve) -> np.ndarray:
    """Arc length (n,) along a curve (n, 2)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])


def _smooth(px, sigma_px, along=None) -> np.ndarray:
    """A curve, a point each pixel, through points (n, 2) as closely as their sigmas ask.

    along: an earlier curve; its two ends are held where the points do not reach them.
    """
    if along is not None:
        px = np.concatenate([along[:1], px, along[-1:]])
        sigma_px = np.concatenate([[1.0], sigma_px, [1.0]])
    keep = np.concatenate([[True], np.diff(_arc(px)) > 1e-6])
    px, sigma_px = px[keep], sigma_px[keep]
    arc = _arc(px)
    order = min(3, len(arc) - 1)
    at = np.linspace(0.0, arc[-1], max(int(np.ceil(arc[-1])), 2))
    return np.stack(
        [UnivariateSpline(arc, px[:, k], w=1.0 / sigma_px, k=order)(at) for k in range(2)], axis=1
    )


def _pieces(grey, curve, width: _Width, piece_px: int, noise: Noise) -> Pieces:
    """Pieces along a curve, with a background made from both sides of each."""
    arc = _arc(curve)
    radius = width.radius(arc, arc[-1])
    half = int(np.ceil(radius.max() + width.blur_px)) + _BESIDE_PX
    dark = np.zeros_like(grey)
    bands = [
        read_band(grey, dark, curve[part], arc[part], radius[part], half)
        for part in _by_direction(curve)
    ]
    pieces = cut_pieces(bands, piece_px, noise)
    on_curve = np.stack([np.interp(pieces.place, arc, curve[:, k]) for k in range(2)], axis=1)
    return _from_sides(
        replace(pieces, foot_px=on_curve), width
    )  # the mean of a bent piece lies inside the bend


def _by_direction(curve) -> list[slice]:
    """Stretches of a curve that run along one axis of the picture more than along the other."""
    tangent = np.abs(np.gradient(curve, axis=0))
    changes = np.flatnonzero(np.diff((tangent[:, 0] >= tangent[:, 1]).astype(int))) + 1
    ends = [0, *changes.tolist(), len(curve)]
    return [slice(a, b) for a, b in pairwise(ends) if b - a > 1]


def _from_sides(pieces: Pieces, width: _Width) -> Pieces:
    """Pieces whose background is a ramp across, and behind a thick line a step too, fitted to their two sides."""
    outside = np.abs(pieces.offset_px) > pieces.radius_px[:, None] + _CLEAR_BLURS * width.blur_px
    columns = [np.ones_like(pieces.offset_px), pieces.offset_px]
    if width.hides:
        columns.append(np.sign(pieces.offset_px))
    columns = np.stack(columns, axis=-1)
    weighted = columns * (pieces.weight * outside)[..., None]
    turned = weighted.transpose(0, 2, 1)
    normal = turned @ weighted + 1e-6 * np.eye(columns.shape[-1])
    solution = np.linalg.solve(normal, turned @ (pieces.grey * pieces.weight)[..., None])
    return replace(pieces, background=(columns @ solution)[..., 0])


def _knots(pieces: Pieces) -> Knots:
    """Places between which the shading changes linearly."""
    first, last = pieces.place.min(), pieces.place.max()
    return Knots(np.linspace(first, last, max(2, round((last - first) / _KNOT_PX))))


def _best_width(pieces: Pieces, begin: _Width) -> _Width:
    """Half-widths and blur under which the pieces are explained best."""
    if len(pieces) < _FEWEST:
        return begin
    share = (pieces.place - pieces.place.min()) / max(np.ptp(pieces.place), 1e-9)
    knots = _knots(pieces)

    def misfit(logs) -> float:
        start, end, blur = np.exp(logs)
        wide = replace(pieces, radius_px=start + (end - start) * share)
        shading, _ = fit_shading(wide, blur, _EVEN, knots, prior=wave_prior(wide, _EVEN))
        return float(
            np.mean(np.log(locate(wide, shading, rounds=1).chi2))
        )  # what crosses a few pieces counts little

    starts = [
        (begin.start_px, begin.end_px, begin.blur_px),
        *((radius, radius, 1.0) for radius in _FIRST_RADII_PX),
    ]
    middle = min(
        (np.log(start) for start in starts), key=misfit
    )  # a thick line and a blurred one are two minima
    bounds = [np.log(_RADII_PX)] * 2 + [np.log(_BLURS_PX)]
    solution = minimize(
        misfit,
        middle,
        method="Nelder-Mead",
        bounds=bounds,
        options={"initial_simplex": middle + 0.4 * np.eye(4, 3, -1), "xatol": 0.03, "maxfev": 60},
    )
    return _Width(*(float(v) for v in np.exp(solution.x)))
