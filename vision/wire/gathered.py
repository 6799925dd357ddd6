"""Normal equations of a rod's light at many common shifts, blurs and widths: pixels are gathered by their distance from
the axis once, and each of many models is then asked for at some eighty distances in place of all pixels.

What a piece's normal equations need of its pixels are sums of products: of one, of the background, its slope and
curvature and of what is seen, with each other, times functions of the distance alone. Here such functions are known
where they are asked for, at equal steps of the distance, and between them by the cubic through the nearest four, whose
shares each pixel's products are given to (the adjoint of interpolation). Pieces of nearly one half-width are counted
together, with distances stretched by as little as their half-widths differ (as in `cylinder.shading_basis`).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import csc_array

from vision.wire.bands import Pieces
from vision.wire.cylinder import alike, profiles
from vision.wire.shading import WEAK, Equations

# [px] Between distances at which functions of the distance are known: normal equations are right
# to 7e-4; in one view twice the log evidence is 1699 with 0.2, 1729 with 0.3, 1697 with 0.15.
# Derived.
_STEP_PX = 0.2
# [px, 1] Beyond the edges; of a piece's pixels: of pieces that show none cubics leave negative
# eigenvalues, of such as show half none. Set by eye. Derived.
_BESIDE_PX, _LEAST_BESIDE = 2.0, 0.2
# [1] Of the offset's own square that the gain leaves: a cubic's error. Derived.
_LEAST_ALONE = 1e-4
# [1] Pictures of the background: itself, slope, curvature. Derived.
_BEHIND = 3
_PAIRS = [(i, j) for i in range(_BEHIND) for j in range(i, _BEHIND)]


class Gathered:
    """Pieces with weights hats (s, knots) of the knots of light in each, and robust (s,) of each."""

    def __init__(
        self, pieces: Pieces, hats: np.ndarray, robust: np.ndarray, *, each_pixel: bool = False
    ):
        """each_pixel: nothing is gathered, so that normal matrices have no eigenvalue below 0 whatever is seen."""
        gathers = _shows_enough(pieces) & (not each_pixel)
        here, others = np.flatnonzero(gathers), np.flatnonzero(~gathers)
        together = [here[some] for some in alike(pieces.radius_px[here])] if len(here) else []
        self._groups = [_Alike(pieces.select(some), hats[some], robust[some]) for some in together]
        if len(others):
            self._groups.append(_EachPixel(pieces.select(others), hats[others], robust[others]))

    def normal(
        self, shifts_px: Sequence[float], models: Sequence[tuple[float, float]], terms: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Normal matrices (m, g, size, size) and right sides (m, g, size) of all knots' coefficients, and squares
        (m, g) that the background leaves, of pieces moved by each of m common shifts; models: of g rods how many times
        as thick each is, and blur, px.

        As `shading.Equations.shared`, and `power` by weight.
        """
        parts = [group.normal(shifts_px, models, terms) for group in self._groups]
        left, right, power = (sum(part[1:], part[0]) for part in zip(*parts))
        return left, right, power


def _shows_enough(pieces: Pieces) -> np.ndarray:
    """Which pieces (s,) show so much of the background that what cubics are off by at the edges is nothing beside
    it."""
    beside = np.abs(pieces.offset_px) > pieces.radius_px[:, None] + _BESIDE_PX
    return np.mean(beside & (pieces.weight > 0), axis=1) > _LEAST_BESIDE


class _EachPixel:
    """Pieces of which little of the background is seen, model by model."""

    def __init__(self, pieces: Pieces, hats: np.ndarray, robust: np.ndarray):
        self.pieces, self.hats, self.robust = pieces, hats, robust

    def normal(self, shifts_px, models, terms: int):
        """See `Gathered.normal`."""
        found = []
        for shift in shifts_px:
            moved = self.pieces.moved(np.full(len(self.pieces), shift))
            for wider, blur_px in models:
                equations = Equations(
                    replace(moved, radius_px=wider * moved.radius_px), blur_px, terms
                )
                found.append(
                    (*equations.shared(self.hats, self.robust), self.robust @ equations.power)
                )
        parts = (np.array(part) for part in zip(*found))
        return tuple(part.reshape(len(shifts_px), len(models), *part.shape[1:]) for part in parts)


class _Alike:
    """Pieces of nearly one half-width. Of each, at distances (j,) from the axis, sums of squared weights: one, with
    what is seen, with backgrounds; and of products of backgrounds, with each other and with what is seen."""

    def __init__(self, pieces: Pieces, hats: np.ndarray, robust: np.ndarray):
        self.radius_px = float(np.mean(pieces.radius_px))
        offset = pieces.offset_px * (self.radius_px / pieces.radius_px)[:, None]
        first = np.floor(np.min(offset, initial=0.0) / _STEP_PX) - 1.0
        place = offset / _STEP_PX - first
        count = int(np.max(place, initial=0.0)) + 3
        self.offset_px = (first + np.arange(count)) * _STEP_PX
        behind = (pieces.background, pieces.slope, pieces.curvature)
        values = [
            np.ones_like(offset),
            pieces.grey,
            *behind,
            *(behind[i] * behind[j] for i, j in _PAIRS),
            *(one * pieces.grey for one in behind),
        ]
        values = np.stack(values, axis=-1) * (pieces.weight**2)[..., None]
        sums = (_to_nearest(place, count) @ values.reshape(offset.size, -1)).reshape(
            len(pieces), count, -1
        )
        parts = np.split(sums, np.cumsum([1, 1, _BEHIND, len(_PAIRS)]), axis=2)
        self.one, self.grey, self.behind, self.behind_twice, self.behind_grey = (
            part.transpose(0, 2, 1).reshape(len(pieces), -1) for part in parts
        )
        self.squares = np.sum((pieces.grey * pieces.weight) ** 2, axis=1)
        self.robust, self.hats, self.root_hats = (
            robust,
            hats * robust[:, None],
            hats * np.sqrt(robust)[:, None],
        )
        self.one_shared = (hats[:, :, None] * self.hats[:, None, :]).reshape(
            len(pieces), -1
        ).T @ self.one

    def normal(self, shifts_px, models, terms: int):
        """See `Gathered.normal`."""
        away = self.offset_px - np.asarray(shifts_px)[:, None]
        shapes = np.stack(
            [profiles(away, wider * self.radius_px, blur, terms) for wider, blur in models], axis=2
        )
        blurs_px = np.array([[blur] for _, blur in models])
        return tuple(np.array(part) for part in zip(*(self._at(one, blurs_px) for one in shapes)))

    def _at(self, shapes: np.ndarray, blurs: np.ndarray):
        """The same at one shift, of models of these shapes (j, g, terms + 2) and blurs (g, 1), px."""
        count, (size, knots), terms = len(blurs), self.hats.shape, shapes.shape[2] - 2
        light, left_open = shapes[..., :terms], 1.0 - shapes[..., :1]
        told = np.concatenate([light, left_open], axis=2)
        # the background, as it is, and by its slope and curvature what of it does not leak
        ways = np.concatenate(
            [left_open, blurs * shapes[..., -2:-1], -0.5 * blurs**2 * shapes[..., -1:]], axis=2
        )
        by_behind = (ways.transpose(2, 0, 1)[..., None] * told).reshape(-1, count * (terms + 1))
        twice = np.stack(
            [ways[..., i] * ways[..., j] * (1.0 + (i != j)) for i, j in _PAIRS]
        ).reshape(-1, count)
        by_behind = (self.behind @ by_behind).reshape(size, count, -1)
        by_one = (self.one @ (left_open * told).reshape(len(told), -1)).reshape(size, count, -1)
        seen = (self.grey @ told.reshape(len(told), -1)).reshape(size, count, -1)
        # gain and offset of the background, eliminated by Cholesky's root of their own two equations
        root = np.sqrt(np.maximum(self.behind_twice @ twice, 0.0) + WEAK)[..., None]
        gain = np.empty((size, count, terms + 1))
        gain[..., :terms], between = by_behind[..., :terms] / root, by_behind[..., terms:] / root
        gain[..., terms] = (
            self.behind_grey @ ways.transpose(2, 0, 1).reshape(-1, count) / root[..., 0]
        )
        alone = np.maximum(by_one[..., terms:], 0.0)
        root = np.sqrt(np.maximum(alone - between**2, _LEAST_ALONE * alone) + WEAK)
        offset = np.empty((size, count, terms + 1))
        offset[..., :terms], offset[..., terms:] = by_one[..., :terms], seen[..., terms:]
        offset = (offset - between * gain) / root
        told_of = np.stack([gain, offset]).transpose(2, 0, 1, 3)  # (g, 2, s, terms + 1)
        taken = (self.root_hats[:, :, None] * told_of[..., None, :terms]).reshape(
            count, 2 * size, -1
        )
        left_over = (np.sqrt(self.robust) * told_of[..., terms]).reshape(count, -1, 1)
        taken = taken.transpose(0, 2, 1) @ np.concatenate([taken, left_over], axis=2)
        products = (light[..., :, None] * light[..., None, :]).reshape(len(light), -1)
        left = (
            (self.one_shared @ products)
            .reshape(knots, knots, count, terms, terms)
            .transpose(2, 0, 3, 1, 4)
        )
        right = (
            (self.hats.T @ seen[..., :terms].reshape(size, -1))
            .reshape(knots, count, terms)
            .transpose(1, 0, 2)
        )
        power = self.robust @ self.squares - np.sum(left_over**2, axis=(1, 2))
        return (
            left.reshape(count, knots * terms, -1) - taken[..., :-1],
            right.reshape(count, -1) - taken[..., -1],
            power,
        )


def exactly_if_needed(asked: Callable[[bool], np.ndarray]) -> np.ndarray:
    """What is asked of gathered pixels (False), or of each pixel (True) where these leave no positive definite
    matrix."""
    try:
        return asked(False)
    except np.linalg.LinAlgError:
        return asked(True)


def _to_nearest(place: np.ndarray, count: int) -> csc_array:
    """The matrix (s count, s p) that gives each pixel's value at its place (s, p) to the nearest four of count rows
    of its piece, by the shares that the cubic through their values has there."""
    before = place.astype(np.intp)
    t = (place - before).ravel()
    shares = np.stack(
        [
            -t * (t - 1.0) * (t - 2.0) / 6.0,
            (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
            -(t + 1.0) * t * (t - 2.0) / 2.0,
            (t + 1.0) * t * (t - 1.0) / 6.0,
        ],
        axis=1,
    )
    rows = (before + count * np.arange(len(place))[:, None]).reshape(-1, 1) + np.arange(-1, 3)
    ends = np.arange(0, shares.size + 1, 4)
    return csc_array((shares.ravel(), rows.ravel(), ends), shape=(len(place) * count, place.size))
