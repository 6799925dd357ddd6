"""Normal equations of a rod's shading at many common shifts, blurs and widths, from pixels summed once.

A segment of the rod is a few hundred pixels. Its normal equations need sums over these pixels of
products such as background × grey level, times functions of the pixel's distance from the axis
alone: the share of the pixel that the rod covers, and the shading functions (`cylinder.profiles`).
Only these functions depend on shift, blur and width.

So the products are summed once, at equal steps of the distance: each pixel gives its products to
the four nearest steps, by the weights of cubic interpolation (the adjoint of interpolation). A
model is then evaluated at some eighty distances in place of all pixels. Segments of nearly one
half-width are taken together, their distances scaled to a common half-width.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import csc_array

from vision.wire.bands import Pieces
from vision.wire.cylinder import alike, profiles
from vision.wire.shading import WEAK, Equations

# [px] Step of the distance: normal equations are right to 7e-4; in one view twice the log evidence
# is 1699 with 0.2, 1729 with 0.3, 1697 with 0.15. Derived.
_STEP_PX = 0.2
# [px] Pixels farther than this from the rod's edges show the background alone. Derived.
_BACKGROUND_MARGIN_PX = 2.0
# [1] Share of a segment's pixels that must show the background alone, else it is not summed:
# without such pixels cubic interpolation leaves negative eigenvalues. Set by eye.
_LEAST_BACKGROUND_SHARE = 0.2
# [1] Share of the offset's own square that the gain leaves at least: the error of a cubic. Derived.
_LEAST_OFFSET_SHARE = 1e-4
# [1] Pictures of the background: itself, its slope and its curvature. Derived.
_BACKGROUND_TERMS = 3
_BACKGROUND_PAIRS = [(i, j) for i in range(_BACKGROUND_TERMS) for j in range(i, _BACKGROUND_TERMS)]

# Normal matrices (models, size, size), right sides (models, size) and squares (models,).
Normal = tuple[np.ndarray, np.ndarray, np.ndarray]


class GatheredEquations:
    """Normal equations of the shading coefficients of all knots, for many shifts and models at once."""

    def __init__(
        self,
        pieces: Pieces,
        knot_weights: np.ndarray,
        robust: np.ndarray,
        *,
        each_pixel: bool = False,
    ):
        """Sum the pixels of the segments.

        knot_weights (s, knots): weight of each knot in the shading of each segment.
        robust (s,): weight of each segment.
        each_pixel: sum nothing beforehand. It is slower, and the matrices are positive semidefinite
        whatever the pixels show.
        """
        gathers = _shows_enough_background(pieces) & (not each_pixel)
        self._groups: list[_SummedSegments | _PixelSegments] = []
        summed = np.flatnonzero(gathers)
        if len(summed):
            for group in alike(pieces.radius_px[summed]):
                some = summed[group]
                self._groups.append(
                    _SummedSegments(pieces.select(some), knot_weights[some], robust[some])
                )
        others = np.flatnonzero(~gathers)
        if len(others):
            self._groups.append(
                _PixelSegments(pieces.select(others), knot_weights[others], robust[others])
            )

    def normal(
        self, shifts_px: Sequence[float], models: Sequence[tuple[float, float]], terms: int
    ) -> Normal:
        """Return the normal equations (shifts, models, …) of segments moved by each common shift.

        models: of each how many times as thick the rod is, and the blur, px.
        terms: number of shading functions.
        Returned are matrices (…, size, size), right sides (…, size) and the squares (…) that the
        background leaves unexplained, with size = knots × terms.
        """
        left, right, power = self._groups[0].normal(shifts_px, models, terms)
        for group in self._groups[1:]:
            more_left, more_right, more_power = group.normal(shifts_px, models, terms)
            left = left + more_left
            right = right + more_right
            power = power + more_power
        return left, right, power


def exactly_if_needed(compute: Callable[[bool], np.ndarray]) -> np.ndarray:
    """Return `compute(False)` from summed pixels, or `compute(True)` from each pixel where that fails.

    Summed pixels may leave a matrix that is not positive definite, which raises LinAlgError.
    """
    try:
        return compute(False)
    except np.linalg.LinAlgError:
        return compute(True)


def _shows_enough_background(pieces: Pieces) -> np.ndarray:
    """Return which segments (s,) show enough background for the error of cubics to be negligible."""
    is_background = np.abs(pieces.offset_px) > pieces.radius_px[:, None] + _BACKGROUND_MARGIN_PX
    is_seen = pieces.weight > 0
    return np.mean(is_background & is_seen, axis=1) > _LEAST_BACKGROUND_SHARE


class _PixelSegments:
    """Segments that show little of the background: each model is evaluated at every pixel."""

    def __init__(self, pieces: Pieces, knot_weights: np.ndarray, robust: np.ndarray):
        self._pieces = pieces
        self._knot_weights = knot_weights
        self._robust = robust

    def normal(
        self, shifts_px: Sequence[float], models: Sequence[tuple[float, float]], terms: int
    ) -> Normal:
        """Return the normal equations as `GatheredEquations.normal` does."""
        lefts = []
        rights = []
        powers = []
        for shift in shifts_px:
            moved = self._pieces.moved(np.full(len(self._pieces), shift))
            for wider, blur_px in models:
                thick = replace(moved, radius_px=wider * moved.radius_px)
                equations = Equations(thick, blur_px, terms)
                left, right = equations.shared(self._knot_weights, self._robust)
                lefts.append(left)
                rights.append(right)
                powers.append(self._robust @ equations.power)
        shape = (len(shifts_px), len(models))
        left = np.array(lefts)
        right = np.array(rights)
        return (
            left.reshape(*shape, *left.shape[1:]),
            right.reshape(*shape, *right.shape[1:]),
            np.array(powers).reshape(shape),
        )


class _SummedSegments:
    """Segments of nearly one half-width, their products of pixels summed at equal distances.

    All sums are over pixels by their squared weights, at distances (d,) from the axis. With the
    background b, its slope b' and its curvature b'':
    one, grey (s, d): sums of 1 and of the grey level;
    behind (3 s, d → s, 3 d): of b, b', b''; behind_twice: of their products with each other;
    behind_grey: of their products with the grey level.
    """

    def __init__(self, pieces: Pieces, knot_weights: np.ndarray, robust: np.ndarray):
        self._radius_px = float(np.mean(pieces.radius_px))
        scaled_px = pieces.offset_px * (self._radius_px / pieces.radius_px)[:, None]
        first = np.floor(np.min(scaled_px, initial=0.0) / _STEP_PX) - 1.0
        place = scaled_px / _STEP_PX - first
        distances = int(np.max(place, initial=0.0)) + 3
        self._distance_px = (first + np.arange(distances)) * _STEP_PX

        products = _pixel_products(pieces)  # (s, p, products)
        flat = products.reshape(scaled_px.size, -1)
        sums = _spread_to_nearest(place, distances) @ flat
        sums = sums.reshape(len(pieces), distances, -1)
        ends = np.cumsum([1, 1, _BACKGROUND_TERMS, len(_BACKGROUND_PAIRS)])
        parts = []
        for part in np.split(sums, ends, axis=2):
            parts.append(part.transpose(0, 2, 1).reshape(len(pieces), -1))
        self._one, self._grey, self._behind, self._behind_twice, self._behind_grey = parts

        self._squares = np.sum((pieces.grey * pieces.weight) ** 2, axis=1)  # (s,)
        self._robust = robust
        self._weighted_knots = knot_weights * robust[:, None]
        self._root_weighted_knots = knot_weights * np.sqrt(robust)[:, None]
        knot_pairs = knot_weights[:, :, None] * self._weighted_knots[:, None, :]
        self._one_by_knot_pair = knot_pairs.reshape(len(pieces), -1).T @ self._one

    def normal(
        self, shifts_px: Sequence[float], models: Sequence[tuple[float, float]], terms: int
    ) -> Normal:
        """Return the normal equations as `GatheredEquations.normal` does."""
        distance_px = self._distance_px - np.asarray(shifts_px)[:, None]  # (shifts, d)
        shapes = []
        for wider, blur_px in models:
            shapes.append(profiles(distance_px, wider * self._radius_px, blur_px, terms))
        shapes = np.stack(shapes, axis=2)  # (shifts, d, models, terms + 2)
        blurs_px = np.array([[blur_px] for _, blur_px in models])
        lefts = []
        rights = []
        powers = []
        for at_one_shift in shapes:
            left, right, power = self._normal_at_one_shift(at_one_shift, blurs_px)
            lefts.append(left)
            rights.append(right)
            powers.append(power)
        return np.array(lefts), np.array(rights), np.array(powers)

    def _normal_at_one_shift(self, shapes: np.ndarray, blurs_px: np.ndarray) -> Normal:
        """Return the normal equations (models, …) of models of these shapes (d, models, terms + 2).

        A pixel's grey level is modelled as Σ cᵢ lightᵢ + gain · background + offset · uncovered.
        The coefficients c are wanted; gain and offset of each segment are eliminated, by taking
        from the normal equations what each of the two explains.
        """
        terms = shapes.shape[2] - 2
        models = len(blurs_px)
        segments, knots = self._weighted_knots.shape
        light = shapes[..., :terms]  # (d, models, terms)
        uncovered = 1.0 - shapes[..., :1]  # (d, models, 1): share that the rod leaves open
        columns = np.concatenate([light, uncovered], axis=2)
        by_grey = self._sum(self._grey, columns)  # (s, models, terms + 1)

        gain, offset = self._eliminated(shapes, uncovered, columns, by_grey, blurs_px)
        explained = np.stack([gain, offset]).transpose(2, 0, 1, 3)  # (models, 2, s, terms + 1)
        by_knot = self._root_weighted_knots[:, :, None] * explained[..., None, :terms]
        by_knot = by_knot.reshape(models, 2 * segments, -1)
        by_seen = (np.sqrt(self._robust) * explained[..., terms]).reshape(models, -1, 1)
        taken = by_knot.transpose(0, 2, 1) @ np.concatenate([by_knot, by_seen], axis=2)

        light_pairs = (light[..., :, None] * light[..., None, :]).reshape(len(light), -1)
        left = self._one_by_knot_pair @ light_pairs
        left = left.reshape(knots, knots, models, terms, terms).transpose(2, 0, 3, 1, 4)
        right = self._weighted_knots.T @ by_grey[..., :terms].reshape(segments, -1)
        right = right.reshape(knots, models, terms).transpose(1, 0, 2)
        return (
            left.reshape(models, knots * terms, -1) - taken[..., :-1],
            right.reshape(models, -1) - taken[..., -1],
            self._robust @ self._squares - np.sum(by_seen**2, axis=(1, 2)),
        )

    def _eliminated(
        self,
        shapes: np.ndarray,
        uncovered: np.ndarray,
        columns: np.ndarray,
        by_grey: np.ndarray,
        blurs_px: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return what gain and offset of the background explain, (s, models, terms + 1) each.

        These are the rows of the Cholesky factor's inverse of their own two equations, times their
        products with the shading functions and, last, with the grey level.
        """
        models = len(blurs_px)
        segments = len(self._one)
        terms = columns.shape[2] - 1
        # The lens blurs what the rod leaves open, the known background was blurred whole: slope and
        # curvature correct for light that the rod hides (`shading._hidden_light`).
        by_slope = blurs_px * shapes[..., -2:-1]
        by_curvature = -0.5 * blurs_px**2 * shapes[..., -1:]
        ways = np.concatenate([uncovered, by_slope, by_curvature], axis=2)  # (d, models, 3)
        ways_first = ways.transpose(2, 0, 1)  # (3, d, models)

        crossed = (ways_first[..., None] * columns).reshape(-1, models * (terms + 1))
        by_background = (self._behind @ crossed).reshape(segments, models, -1)
        squares = [ways[..., i] * ways[..., j] * (1.0 + (i != j)) for i, j in _BACKGROUND_PAIRS]
        gain_square = self._behind_twice @ np.stack(squares).reshape(-1, models)
        root = np.sqrt(np.maximum(gain_square, 0.0) + WEAK)[..., None]
        gain = np.empty((segments, models, terms + 1))
        gain[..., :terms] = by_background[..., :terms] / root
        gain[..., terms] = self._behind_grey @ ways_first.reshape(-1, models) / root[..., 0]
        gain_of_offset = by_background[..., terms:] / root

        by_one = self._sum(self._one, uncovered * columns)
        offset_square = np.maximum(by_one[..., terms:], 0.0)
        left_by_gain = np.maximum(
            offset_square - gain_of_offset**2, _LEAST_OFFSET_SHARE * offset_square
        )
        offset = np.concatenate([by_one[..., :terms], by_grey[..., terms:]], axis=2)
        offset = (offset - gain_of_offset * gain) / np.sqrt(left_by_gain + WEAK)
        return gain, offset

    def _sum(self, sums: np.ndarray, functions: np.ndarray) -> np.ndarray:
        """Return the sums (s, models, k) over distances of sums (s, d) times functions (d, models, k)."""
        flat = sums @ functions.reshape(len(functions), -1)
        return flat.reshape(len(sums), functions.shape[1], -1)


def _pixel_products(pieces: Pieces) -> np.ndarray:
    """Return of each pixel (s, p, products) the products whose sums are needed, by squared weight."""
    behind = (pieces.background, pieces.slope, pieces.curvature)
    products = [np.ones_like(pieces.grey), pieces.grey, *behind]
    products += [behind[i] * behind[j] for i, j in _BACKGROUND_PAIRS]
    products += [one * pieces.grey for one in behind]
    return np.stack(products, axis=-1) * (pieces.weight**2)[..., None]


def _spread_to_nearest(place: np.ndarray, count: int) -> csc_array:
    """Return the matrix (s count, s p) that gives each pixel's value to the nearest four of count rows.

    place (s, p): of each pixel, counted in rows. The weights are those that the cubic through the
    values of the four rows has at the pixel's place.
    """
    before = place.astype(np.intp)
    t = (place - before).ravel()
    weights = [
        -t * (t - 1.0) * (t - 2.0) / 6.0,
        (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
        -(t + 1.0) * t * (t - 2.0) / 2.0,
        (t + 1.0) * t * (t - 1.0) / 6.0,
    ]
    weights = np.stack(weights, axis=1)
    first_rows = before + count * np.arange(len(place))[:, None]
    rows = first_rows.reshape(-1, 1) + np.arange(-1, 3)
    ends = np.arange(0, weights.size + 1, 4)
    return csc_array((weights.ravel(), rows.ravel(), ends), shape=(len(place) * count, place.size))
