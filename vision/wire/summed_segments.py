"""Normal equations of a rod's shading at many common shifts, blurs and widths, from pixels summed
once.

A segment of the rod is a few hundred pixels. Its normal equations need sums over these pixels of
products such as background × grey level, times functions of the pixel's distance from the axis
alone: the share of the pixel that the rod covers, and the shading functions (`cylinder.profiles`).
Only these functions depend on shift, blur and width.

So the products are summed once, at equal steps of the distance: each pixel gives its products to
the four nearest steps, by the weights of cubic interpolation (the adjoint of interpolation). A
model is then evaluated at some eighty distances in place of all pixels. Segments of nearly one
half-width are taken together, their distances scaled to a common half-width.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_array

from vision.wire.bands import Pieces
from vision.wire.cylinder import profiles
from vision.wire.shading import WEAK

# [px] Step of the distance: normal equations are right to 7e-4; in one view twice the log evidence
# is 1699 with 0.2, 1729 with 0.3, 1697 with 0.15. Derived.
_STEP_PX = 0.2
# [1] Share of the offset's own square that the gain leaves at least: the error of a cubic. Derived.
_LEAST_OFFSET_SHARE = 1e-4
# [1] Pictures of the background: itself, its slope and its curvature. Derived.
_BACKGROUND_TERMS = 3
_BACKGROUND_PAIRS = [(i, j) for i in range(_BACKGROUND_TERMS) for j in range(i, _BACKGROUND_TERMS)]
# [chi²] Added before squares are summed and taken off after, for without pixels they are none. Derived.
_WITHOUT_PIXELS = 1.0


class ShadingEquations(NamedTuple):
    """Normal equations of many models.

    left (…, size, size): matrices. right (…, size): right sides. power (…): the squares that the
    background leaves unexplained.
    """

    left: np.ndarray
    right: np.ndarray
    power: np.ndarray

    def evidences(self, precision: np.ndarray, contrast: np.ndarray) -> np.ndarray:
        """Return minus twice the log evidence (g,) of g models, coefficients integrated out.

        precision (size, size): of their prior, over the contrasts (g,), grey levels. Raises LinAlgError
        where the equations are of no sum of squares.
        """
        models, size = self.right.shape
        bordered = np.empty((models, size + 1, size + 1))
        bordered[:, :size, :size] = self.left + precision / contrast[:, None, None] ** 2
        bordered[:, size, :size] = self.right
        bordered[:, size, size] = self.power + _WITHOUT_PIXELS
        pivots = np.einsum("gii->gi", np.linalg.cholesky(bordered))  # reads the lower triangle
        log_posterior = 2.0 * np.sum(np.log(pivots[:, :size]), axis=1)
        log_prior = np.linalg.slogdet(precision)[1] - 2.0 * size * np.log(contrast)
        unexplained = pivots[:, size] ** 2 - _WITHOUT_PIXELS
        return unexplained + log_posterior - log_prior


class SummedSegments:
    """Segments of nearly one half-width, their products of pixels summed at equal distances.

    All sums are over pixels by their squared weights, at distances (d,) from the axis. With the
    background b, its slope b' and its curvature b'':
    one, grey (s, d): sums of 1 and of the grey level;
    behind (3 s, d → s, 3 d): of b, b', b''; behind_twice: of their products with each other;
    behind_grey: of their products with the grey level.
    """

    def __init__(self, pieces: Pieces, knot_weights: np.ndarray, robust: np.ndarray):
        self._radius_px = float(np.mean(pieces.radius_px))
        self._distance_px, sums = _sums_by_distance(pieces, self._radius_px)
        self._one, self._grey, self._behind, self._behind_twice, self._behind_grey = sums

        squares = np.sum((pieces.grey * pieces.weight) ** 2, axis=1)  # (s,)
        self._power = robust @ squares
        self._root_robust = np.sqrt(robust)
        self._weighted_knots = knot_weights * robust[:, None]
        self._root_weighted_knots = knot_weights * self._root_robust[:, None]
        knot_pairs = knot_weights[:, :, None] * self._weighted_knots[:, None, :]
        by_segment = knot_pairs.reshape(len(pieces), -1)  # (s, knots²)
        self._one_by_knot_pair = by_segment.T @ self._one

    def normal_at(
        self, shifts_px: np.ndarray, models: Sequence[tuple[float, float]], terms: int
    ) -> ShadingEquations:
        """Return the normal equations (shifts · models, …) of the segments moved by each shift.

        A pixel's grey level is modelled as Σ cᵢ lightᵢ + gain · background + offset · uncovered.
        The coefficients c are wanted; gain and offset of each segment are eliminated, by taking
        from the normal equations what each of the two explains.
        """
        distance_px = self._distance_px[:, None] - shifts_px
        shapes = _Shapes.of(distance_px, self._radius_px, models, terms)
        by_grey = self._sum(self._grey, shapes.columns)  # (s, models, terms + 1)
        by_gain = self._explained_by_gain(shapes)
        by_offset = self._explained_by_offset(shapes, by_grey[..., -1:], by_gain)
        explained = self._join(by_gain[..., :-1], by_offset)
        left = self._left(shapes.light)
        right = self._right(by_grey[..., :-1])
        return ShadingEquations(
            left - explained.left, right - explained.right, self._power - explained.power
        )

    def _left(self, light: np.ndarray) -> np.ndarray:
        """Return the matrices (models, size, size) of shading functions light (d, models, terms)."""
        _, models, terms = light.shape
        knots = self._weighted_knots.shape[1]
        pairs = light[..., :, None] * light[..., None, :]
        left = self._one_by_knot_pair @ pairs.reshape(len(light), -1)
        left = left.reshape(knots, knots, models, terms, terms).transpose(2, 0, 3, 1, 4)
        return left.reshape(models, knots * terms, -1)

    def _right(self, by_grey: np.ndarray) -> np.ndarray:
        """Return the right sides (models, size) of the shading's products with grey levels (s,
        models, terms).
        """
        segments, models, terms = by_grey.shape
        right = self._weighted_knots.T @ by_grey.reshape(segments, -1)
        right = right.reshape(-1, models, terms).transpose(1, 0, 2)
        return right.reshape(models, -1)

    def _join(self, by_gain: np.ndarray, by_offset: np.ndarray) -> ShadingEquations:
        """Return the part (models, …) of the normal equations that gain and offset explain.

        by_gain, by_offset (s, models, terms + 1): what each explains of the segments.
        """
        explained = np.stack([by_gain, by_offset]).transpose(2, 0, 1, 3)
        models = len(explained)  # (models, 2, s, terms + 1)
        by_knot = self._root_weighted_knots[:, :, None] * explained[..., None, :-1]
        by_knot = by_knot.reshape(models, 2 * len(self._one), -1)
        by_seen = (self._root_robust * explained[..., -1]).reshape(models, -1, 1)
        products = by_knot.transpose(0, 2, 1) @ np.concatenate([by_knot, by_seen], axis=2)
        return ShadingEquations(
            products[..., :-1], products[..., -1], np.sum(by_seen**2, axis=(1, 2))
        )

    def _explained_by_gain(self, shapes: "_Shapes") -> np.ndarray:
        """Return what the background's gain explains, (s, models, terms + 2).

        For each shading function, the grey level and the background's offset it is their product
        with the background, over the root of the background's square.
        """
        behind = shapes.background.transpose(2, 0, 1)  # (3, d, models)
        models = behind.shape[2]
        crossed = behind[..., None] * shapes.columns
        crossed = crossed.reshape(-1, models * shapes.columns.shape[2])
        by_columns = (self._behind @ crossed).reshape(len(self._one), models, -1)
        by_grey = self._behind_grey @ behind.reshape(-1, models)
        root = np.sqrt(np.maximum(self._squared_background(behind), 0.0) + WEAK)
        products = [by_columns[..., :-1], by_grey[..., None], by_columns[..., -1:]]
        return np.concatenate(products, axis=2) / root[..., None]

    def _squared_background(self, behind: np.ndarray) -> np.ndarray:
        """Return the squares (s, models) of the background that is seen, factors behind (3, d,
        models).
        """
        squares = []
        for i, j in _BACKGROUND_PAIRS:
            squares.append(behind[i] * behind[j] * (1.0 + (i != j)))
        return self._behind_twice @ np.concatenate(squares)

    def _explained_by_offset(
        self, shapes: "_Shapes", offset_by_grey: np.ndarray, by_gain: np.ndarray
    ) -> np.ndarray:
        """Return what the background's offset explains beyond its gain, (s, models, terms + 1).

        offset_by_grey (s, models, 1): products of what the rod leaves open with the grey level.
        by_gain: see `_explained_by_gain`.
        """
        by_one = self._sum(self._one, shapes.uncovered * shapes.columns)
        square = np.maximum(by_one[..., -1:], 0.0)
        of_gain = by_gain[..., -1:]
        left_by_gain = np.maximum(square - of_gain**2, _LEAST_OFFSET_SHARE * square)
        products = np.concatenate([by_one[..., :-1], offset_by_grey], axis=2)
        return (products - of_gain * by_gain[..., :-1]) / np.sqrt(left_by_gain + WEAK)

    def _sum(self, sums: np.ndarray, functions: np.ndarray) -> np.ndarray:
        """Return the sums (s, models, k) over distances of sums (s, d) times functions (d, models,
        k).
        """
        flat = sums @ functions.reshape(len(functions), -1)
        return flat.reshape(len(sums), functions.shape[1], -1)


@dataclass(frozen=True)
class _Shapes:
    """Blurred pictures of a rod under several models, each shift with each width and blur, at d
    distances from its axis.

    light (d, models, terms): of the shading functions. uncovered (d, models, 1): share that the rod
    leaves open. background (d, models, 3): factors of the background, its slope and its curvature.
    The lens blurs what the rod leaves open, the known background was blurred whole: slope and
    curvature correct for light that the rod hides (`shading._hidden_light`).
    """

    light: np.ndarray
    uncovered: np.ndarray
    background: np.ndarray

    @staticmethod
    def of(
        distance_px: np.ndarray,
        radius_px: float,
        models: Sequence[tuple[float, float]],
        terms: int,
    ) -> "_Shapes":
        """Return the pictures at distances (d, shifts) of a rod of a half-width, times as much and
        blurred as each model says.
        """
        count, shifts = distance_px.shape
        shapes = np.empty((count, shifts, len(models), terms + 2))
        for k, (wider, blur_px) in enumerate(models):
            shapes[:, :, k] = profiles(distance_px, wider * radius_px, blur_px, terms)
        shapes = shapes.reshape(count, shifts * len(models), -1)
        blurs_px = np.tile([[blur_px] for _, blur_px in models], (shifts, 1))
        uncovered = 1.0 - shapes[..., :1]
        by_slope = blurs_px * shapes[..., -2:-1]
        by_curvature = -0.5 * blurs_px**2 * shapes[..., -1:]
        background = np.concatenate([uncovered, by_slope, by_curvature], axis=2)
        return _Shapes(shapes[..., :terms], uncovered, background)

    @cached_property
    def columns(self) -> np.ndarray:
        """Return light and what the rod leaves open, (d, models, terms + 1)."""
        return np.concatenate([self.light, self.uncovered], axis=2)


def _sums_by_distance(pieces: Pieces, radius_px: float) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return distances (d,) px from the axis, and the sums of pixels' products there.

    The sums are those of `SummedSegments` in its order. The distances of the segments are scaled to a
    common half-width.
    """
    scaled_px = pieces.offset_px * (radius_px / pieces.radius_px)[:, None]
    first = np.floor(np.min(scaled_px, initial=0.0) / _STEP_PX) - 1.0
    place = scaled_px / _STEP_PX - first
    count = int(np.max(place, initial=0.0)) + 3
    products = _pixel_products(pieces).reshape(scaled_px.size, -1)
    sums = (_spread_to_nearest(place, count) @ products).reshape(len(pieces), count, -1)
    ends = np.cumsum([1, 1, _BACKGROUND_TERMS, len(_BACKGROUND_PAIRS)])
    parts = []
    for part in np.split(sums, ends, axis=2):
        parts.append(part.transpose(0, 2, 1).reshape(len(pieces), -1))
    return (first + np.arange(count)) * _STEP_PX, parts


def _pixel_products(pieces: Pieces) -> np.ndarray:
    """Return of each pixel (s, p, products) the products whose sums are needed, by squared weight."""
    behind = (pieces.background, pieces.slope, pieces.curvature)
    products = [np.ones_like(pieces.grey), pieces.grey, *behind]
    for i, j in _BACKGROUND_PAIRS:
        products.append(behind[i] * behind[j])
    for picture in behind:
        products.append(picture * pieces.grey)
    return np.stack(products, axis=-1) * (pieces.weight**2)[..., None]


def _spread_to_nearest(place: np.ndarray, count: int) -> csc_array:
    """Return the matrix (s count, s p) that gives each pixel's value to the nearest four of count
    rows.

    place (s, p): of each pixel, counted in rows.
    """
    before = place.astype(np.intp)
    weights = _cubic_weights((place - before).ravel())
    first_rows = before + count * np.arange(len(place))[:, None]
    rows = first_rows.reshape(-1, 1) + np.arange(-1, 3)
    ends = np.arange(0, weights.size + 1, 4)
    return csc_array((weights.ravel(), rows.ravel(), ends), shape=(len(place) * count, place.size))


def _cubic_weights(t: np.ndarray) -> np.ndarray:
    """Return the weights (n, 4) by which the cubic through values at -1, 0, 1 and 2 gives that at t
    (n,).
    """
    weights = np.empty((len(t), 4))
    weights[:, 0] = -t * (t - 1.0) * (t - 2.0) / 6.0
    weights[:, 1] = (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0
    weights[:, 2] = -(t + 1.0) * t * (t - 2.0) / 2.0
    weights[:, 3] = (t + 1.0) * t * (t - 1.0) / 6.0
    return weights
