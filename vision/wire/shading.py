"""The rod's own shading, shared by all segments of a camera, and the position of each segment under
it.

The rod is a lit cylinder. Its radiance round the rod is a short Fourier series (`cylinder.py`)
whose coefficients vary slowly along the rod and as it turns: they are known at knots, and between
knots they are interpolated linearly. Each segment of the picture has, of its own, its position
across the rod and a gain and an offset of the background (shadow, drifting light).

All but position and blur is linear. `SegmentEquations` holds each segment's normal equations with gain
and offset eliminated; `fit_shading` solves them for the coefficients of all knots together.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from vision.wire.bands import Pieces
from vision.wire.cylinder import shading_basis, slopes_of

# [px⁻²] Information of a segment that does not say where it is: a sigma of 30 000 px. Derived.
LEAST_POWER = 1e-9
# [1] Keeps a background that does not vary in a segment from making its equations singular. Derived.
WEAK = 1e-6
# [rad] A rod that turned by more is lit otherwise: before a lamp's highlight a fan of 24°, taken
# as lit alike, moved all lines by half a pixel, and by a quarter of one from end to end. Study:
# thresholds.py wire.shading LIT_ALIKE_RAD ….
LIT_ALIKE_RAD = np.radians(8.0)
# [blurs] Beyond its edge, where a blurred rod has 3e-6 of its light: pixels farther off show the
# background alone. Derived.
_REACH_BLURS = 4.5
# [px] Longest step of a segment's position: an edge's slope holds for about as long. Half of it
# moves no value of five whisks by more than 0.02 sigma, twice as much touch of one by 0.29 and a
# slope's sigma by 0.5. Study: thresholds.py wire.shading LONGEST_PX ….
LONGEST_PX = 0.7
# [1] Added to the normal matrix over its mean diagonal where there is no prior. Derived.
_RIDGE = 1e-6


@dataclass(frozen=True)
class Knots:
    """The places between which a rod's shading is interpolated linearly.

    place_mm (m,): along the rod. turn_rad (k,): angles of the rod, where it turns far.
    turns: angle of each band (`Pieces.source`), rad; needed where k > 1.
    """

    place_mm: np.ndarray
    turn_rad: np.ndarray = field(default_factory=lambda: np.zeros(1))
    turns: Mapping[int, float] = field(default_factory=dict)

    @staticmethod
    def of_turning(place_mm: np.ndarray, turns: Mapping[int, float]) -> "Knots":
        """Return the knots of a rod whose bands stand at these angles, rad."""
        angles = np.array(list(turns.values()))
        width = float(np.ptp(angles)) if len(angles) else 0.0
        if width <= LIT_ALIKE_RAD:
            return Knots(place_mm)
        count = 1 + int(np.ceil(width / LIT_ALIKE_RAD))
        return Knots(place_mm, np.linspace(angles.min(), angles.max(), count), turns)

    def __len__(self) -> int:
        return len(self.place_mm) * len(self.turn_rad)

    def weights(self, pieces: Pieces) -> np.ndarray:
        """Return the weight (s, k m) of each knot in the shading of each segment."""
        along = _linear_weights(pieces.place, self.place_mm)
        if len(self.turn_rad) == 1:
            return along
        turns = np.array([self.turns[band] for band in pieces.source.tolist()])
        turned = _linear_weights(turns, self.turn_rad)
        return (turned[:, :, None] * along[:, None, :]).reshape(len(along), -1)


@dataclass(frozen=True)
class Shading:
    """The radiance round the rod.

    coefficients (k m, terms): at each knot, of 1, sin t, cos t, …, in grey levels. blur_px: of the
    lens.
    """

    knots: Knots
    coefficients: np.ndarray
    blur_px: float

    def misfit(self, pieces: Pieces) -> np.ndarray:
        """Return the chi² per degree of freedom (s,) that segments leave where they lie."""
        equations = SegmentEquations(pieces, self.blur_px, self.coefficients.shape[1])
        return equations.chi2(self.knots.weights(pieces) @ self.coefficients) / pieces.freedom


def _linear_weights(place: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Return the weights (s, m) of linear interpolation between knots (m,), constant outside."""
    if len(knots) == 1:
        return np.ones((len(place), 1))
    last = len(knots) - 1
    position = np.clip(np.interp(place, knots, np.arange(len(knots))), 0, last)
    distance = np.abs(position[:, None] - np.arange(len(knots)))
    return np.clip(1.0 - distance, 0.0, None)


def _hidden_light(pieces: Pieces, bells: np.ndarray, blur_px: float) -> np.ndarray:
    """Return the light (s, p) that the blurred background holds of what the rod hides.

    The lens blurs what the rod leaves open; the known picture of the background was blurred whole.
    The blurred product of two pictures is the product of the blurred ones, plus blur² times that of
    their slopes, plus blur⁴/2 times that of their curvatures, and so on.
    bells (s, p, 2): slope and curvature of the covered share, see `cylinder.rim_bells`.
    """
    by_slope = bells[..., 0] * (blur_px * pieces.slope)
    by_curvature = bells[..., 1] * ((0.5 * blur_px**2) * pieces.curvature)
    return by_slope - by_curvature


def fit_shading(pieces: Pieces, blur_px: float, terms: int, knots: Knots) -> tuple[Shading, float]:
    """Fit the radiance of segments where they lie; also return chi² per pixel, infinite where no pixel shows them."""
    equations = SegmentEquations(pieces, blur_px, terms)
    all_alike = np.ones(len(pieces))
    left, right = equations.shared(knots.weights(pieces), all_alike)
    ridge = _RIDGE * np.mean(np.diag(left))
    if ridge == 0.0:
        return Shading(knots, np.zeros((len(knots), terms)), blur_px), np.inf
    factor = lu_factor(left + ridge * np.eye(len(left)), check_finite=False)
    found = lu_solve(factor, right, check_finite=False)
    explained = 2.0 * right @ found
    of_model = found @ left @ found
    chi2 = float(np.sum(equations.power) - explained + of_model)
    pixels = max(1, np.count_nonzero(pieces.weight))
    coefficients = found.reshape(len(knots), terms)
    return Shading(knots, coefficients, blur_px), chi2 / pixels


class SegmentEquations:
    """Normal equations of each segment for its shading, the background's gain and offset
    eliminated.

    gram (s, terms, terms), moment (s, terms): matrix and right side.
    power (s,): the squares that the background leaves unexplained.
    """

    def __init__(self, pieces: Pieces, blur_px: float, terms: int):
        self.pieces = pieces
        self.blur_px = blur_px
        self._near, self._far = _split_off_background(pieces, blur_px)
        self._columns = _weighted_columns(self._near, blur_px, terms)

        normal = self._columns.transpose(0, 2, 1) @ self._columns
        normal[:, -3:, -3:] += self._far
        self._by_background = normal[:, -3:-1].copy()  # (s, 2, terms + 3): gain and offset with all
        self._inverse = _inverse_of_two(self._by_background[:, :, -3:-1] + WEAK * np.eye(2))
        explained = self._by_background.transpose(0, 2, 1) @ (self._inverse @ self._by_background)
        normal -= explained
        self.gram = normal[:, :terms, :terms]
        self.moment = normal[:, :terms, -1]
        self.power = normal[:, -1, -1]

    def shared(self, knot_weights: np.ndarray, robust: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the normal matrix (size, size) and right side (size,) of all knots' coefficients.

        The segments keep their positions. knot_weights (s, knots): of each knot in each segment;
        robust (s,): weight of each segment; size = knots × terms.
        """
        count, knots = knot_weights.shape
        terms = self.moment.shape[1]
        size = knots * terms
        weighted_knots = knot_weights * robust[:, None]
        knot_pairs = weighted_knots[:, :, None] * knot_weights[:, None, :]
        left = knot_pairs.reshape(count, -1).T @ self.gram.reshape(count, -1)
        left = left.reshape(knots, knots, terms, terms).transpose(0, 2, 1, 3)
        right = weighted_knots.T @ self.moment
        return left.reshape(size, size), right.reshape(size)

    def chi2(self, coefficients: np.ndarray) -> np.ndarray:
        """Return the chi² (s,) that segments of this shading, coefficients (s, terms), leave."""
        predicted = (self.gram @ coefficients[..., None])[..., 0]
        return self.power + np.einsum("st,st->s", coefficients, predicted - 2.0 * self.moment)

    def linearised(self, coefficients: np.ndarray) -> "PositionEquations":
        """Return how segments of this shading, coefficients (s, terms), depend on position and blur.

        Light that the rod hides near a border of the background (`_hidden_light`) is held fixed.
        """
        terms = coefficients.shape[1]
        seen = self._columns[..., -1]
        residual = seen - (self._columns[..., :terms] @ coefficients[..., None])[..., 0]
        by_cover = self._gain_by_cover(residual)
        derivatives = self._derivatives(coefficients, by_cover, residual)
        mixed, gram = self._products(derivatives)
        covered = residual - seen - self._columns[..., 0] * by_cover
        contrast = np.sqrt(np.sum(covered**2, axis=1))
        return PositionEquations(mixed[:, :2, :terms], gram, contrast)

    def _products(self, derivatives: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the products of derivatives (s, 3, p) with the columns, and with each other.

        The pixels far off are added to those of the residual, the last of the three; the background's
        gain and offset are eliminated.
        """
        mixed = derivatives @ self._columns
        gram = derivatives @ derivatives.transpose(0, 2, 1)
        mixed[:, 2, -3:] += self._far[:, 2]
        gram[:, 2, 2] += self._far[:, 2, 2]
        by_background = mixed[..., -3:-1]
        reduced = by_background @ self._inverse
        gram -= reduced @ by_background.transpose(0, 2, 1)
        return mixed - reduced @ self._by_background, gram

    def _gain_by_cover(self, residual: np.ndarray) -> np.ndarray:
        """Return the change (s, p) of each pixel's grey level as the rod covers all of it: that of
        the fitted background, negated.

        residual (s, p): what the rod's light leaves of the grey level, by weight.
        """
        behind = self._columns[..., -3:-1]
        far_residual = self._far[:, :2, 2:]  # no light of the rod there
        by_behind = behind.transpose(0, 2, 1) @ residual[..., None] + far_residual
        gain_offset = self._inverse @ by_behind  # (s, 2, 1)
        return -(gain_offset[:, 0] * self._near.background + gain_offset[:, 1])

    def _derivatives(
        self, coefficients: np.ndarray, by_cover: np.ndarray, residual: np.ndarray
    ) -> np.ndarray:
        """Return the derivatives (s, 3, p) by position and by the blur's logarithm, and the
        residual.
        """
        near = self._near
        slopes, curvatures = slopes_of(near.offset_px, near.radius_px, self.blur_px, coefficients)
        derivatives = np.empty((len(near), 3, residual.shape[1]))
        derivatives[:, 0] = -(slopes[0] + slopes[1] * by_cover)
        # a normal density of variance v changes with v by half its second derivative
        derivatives[:, 1] = self.blur_px**2 * (curvatures[0] + curvatures[1] * by_cover)
        derivatives[:, :2] *= near.weight[:, None]
        derivatives[:, 2] = residual
        return derivatives


@dataclass(frozen=True)
class PositionEquations:
    """The normal equations of each segment for its position (px) and the blur's logarithm.

    Gain and offset of the background are eliminated.
    rod (s, 2, terms): products of the two derivatives with those by the shading's coefficients.
    gram (s, 3, 3): products of the two derivatives and the residual with each other.
    contrast (s,): signal of the rod against its background over the noise, over the whole segment.
    """

    rod: np.ndarray
    gram: np.ndarray
    contrast: np.ndarray

    @property
    def power(self) -> np.ndarray:
        """Return the information (s,) of each segment by itself about its position, 1/px²."""
        return np.maximum(self.gram[:, 0, 0], LEAST_POWER)

    @property
    def step_px(self) -> np.ndarray:
        """Return Gauss–Newton's step (s,) of each segment by itself, px."""
        return np.clip(self.gram[:, 0, 2] / self.power, -LONGEST_PX, LONGEST_PX)

    def own_sigma_px(self, chi2: np.ndarray) -> np.ndarray:
        """Return the sigma (s,) of each segment's position by itself, where it leaves chi2 (s,) per
        pixel.
        """
        return np.sqrt(np.maximum(chi2, 1.0) / self.power)


def _weighted_columns(pieces: Pieces, blur_px: float, terms: int) -> np.ndarray:
    """Return what segments are made of, (s, p, terms + 3), times the weight of each pixel.

    The columns are the shading functions, what the rod leaves open of the background and of 1, and
    the grey level.
    """
    columns = shading_basis(
        pieces.offset_px, pieces.radius_px[:, None], blur_px, terms, pieces.weight, 1
    )
    hidden = _hidden_light(pieces, columns[..., -3:-1], blur_px)
    uncovered = pieces.weight - columns[..., 0]
    columns[..., -3] = uncovered * pieces.background + hidden
    columns[..., -2] = uncovered
    columns[..., -1] = pieces.grey * pieces.weight
    return columns


def _split_off_background(pieces: Pieces, blur_px: float) -> tuple[Pieces, np.ndarray]:
    """Return the segments without the columns of pixels at both ends that no light of the rod
    reaches.

    Also returned are the products (s, 3, 3) of these pixels' background, 1 and grey level with each
    other, by squared weight.
    """
    reach_px = pieces.radius_px[:, None] + _REACH_BLURS * blur_px
    is_near = (np.abs(pieces.offset_px) < reach_px) & (pieces.weight > 0)
    columns = np.flatnonzero(np.any(is_near, axis=0))
    near = slice(columns[0], columns[-1] + 1) if len(columns) else slice(0, 0)
    background = _both_ends(pieces.background, near)
    grey = _both_ends(pieces.grey, near)
    weight = _both_ends(pieces.weight, near)
    far = np.stack([background * weight, weight, grey * weight], axis=1)
    return pieces.columns(near), far @ far.transpose(0, 2, 1)


def _both_ends(values: np.ndarray, middle: slice) -> np.ndarray:
    """Return the columns of values (s, p) before and after those in the middle."""
    return np.concatenate([values[:, : middle.start], values[:, middle.stop :]], axis=1)


def _inverse_of_two(matrices: np.ndarray) -> np.ndarray:
    """Return the inverses of symmetric matrices (s, 2, 2)."""
    a = matrices[:, 0, 0]
    b = matrices[:, 0, 1]
    d = matrices[:, 1, 1]
    adjugate = np.stack([d, -b, -b, a], axis=1).reshape(-1, 2, 2)
    return adjugate / (a * d - b * b)[:, None, None]


def contrast_of(pieces: Pieces) -> float:
    """Return the RMS difference of the rod from its background in grey levels; one at least."""
    inside = (np.abs(pieces.offset_px) < pieces.radius_px[:, None]) & (pieces.weight > 0)
    if not np.any(inside):
        return 1.0
    difference = (pieces.grey - pieces.background)[inside]
    return max(float(np.sqrt(np.mean(difference**2))), 1.0)
