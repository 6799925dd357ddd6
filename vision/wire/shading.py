"""The rod's own shading, shared by all pieces of a camera, and the position of each piece under it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from vision.wire.bands import Pieces
from vision.wire.cylinder import shading_basis, slopes_of

# [px⁻²] Of a piece that does not tell where it is: a sigma of 30 000 px. Derived.
LEAST_POWER = 1e-9
# [1] Keeps a background that a piece cannot tell from making its equations singular. Derived.
WEAK = 1e-6
# [rad] A rod that turned by more is lit otherwise: before a lamp's highlight a fan of 24°, taken
# as lit alike, moved all lines by half a pixel, and by a quarter of one from end to end. Study:
# thresholds.py lines.shading _LIT_ALIKE_RAD ….
_LIT_ALIKE_RAD = np.radians(8.0)
# [blurs] Beyond its edge, where a blurred rod has 3e-6 of its light: pixels farther off tell of
# the background alone. Derived.
_REACH_BLURS = 4.5
# [px] A step of a piece's position: an edge's slope holds for about as long. Half of it moves no
# value of five whisks by more than 0.02 sigma, twice as much touch of one by 0.29 and a slope's
# sigma by 0.5. Study: thresholds.py lines.shading LONGEST_PX ….
LONGEST_PX = 0.7


@dataclass(frozen=True)
class Knots:
    """Between what a rod's shading is linear: places along it (m,), mm, and where it turns far, angles (k,), rad.

    turns: angle of each band (`Pieces.source`), needed where k > 1.
    """

    place_mm: np.ndarray
    turn_rad: np.ndarray = field(default_factory=lambda: np.zeros(1))
    turns: Mapping[int, float] = field(default_factory=dict)

    @staticmethod
    def of_turning(place_mm: np.ndarray, turns: Mapping[int, float]) -> "Knots":
        """Knots of a rod whose bands stand at these angles, rad."""
        angles = np.array(list(turns.values()))
        width = float(np.ptp(angles)) if len(angles) else 0.0
        if width <= _LIT_ALIKE_RAD:
            return Knots(place_mm)
        return Knots(
            place_mm,
            np.linspace(angles.min(), angles.max(), 1 + int(np.ceil(width / _LIT_ALIKE_RAD))),
            turns,
        )

    def __len__(self) -> int:
        return len(self.place_mm) * len(self.turn_rad)

    def weights(self, pieces: Pieces) -> np.ndarray:
        """How much each knot has in the shading of each piece, (s, k m)."""
        along = _hats(pieces.place, self.place_mm)
        if len(self.turn_rad) == 1:
            return along
        turned = _hats(
            np.array([self.turns[band] for band in pieces.source.tolist()]), self.turn_rad
        )
        return (turned[:, :, None] * along[:, None, :]).reshape(len(along), -1)


@dataclass(frozen=True)
class Shading:
    """Radiance round the rod. waves (k m, terms): at each knot the coefficients of 1, sin t, cos t, …, grey levels."""

    knots: Knots
    waves: np.ndarray
    blur_px: float

    def of(self, pieces: Pieces) -> np.ndarray:
        """Coefficients (s, terms) of each piece."""
        return self.knots.weights(pieces) @ self.waves


def _hats(place_mm, knots_mm) -> np.ndarray:
    """Weights (s, m) of linear interpolation between knots, constant outside."""
    if len(knots_mm) == 1:
        return np.ones((len(place_mm), 1))
    position = np.clip(
        np.interp(place_mm, knots_mm, np.arange(len(knots_mm))), 0, len(knots_mm) - 1
    )
    return np.clip(1.0 - np.abs(position[:, None] - np.arange(len(knots_mm))), 0.0, None)


def _not_leaked(pieces: Pieces, bells, blur_px: float) -> np.ndarray:
    """What the blurred known picture holds (s, p) of light that the rod hides, near a border in the background.

    The lens blurs what is left when the rod has hidden its part; the known picture was blurred whole. The blurred
    product of two pictures is the product of the blurred ones, and blur² times that of their slopes, and blur⁴/2
    times that of their curvatures, and so on. bells (s, p, 2): see `rim_bells`.
    """
    return bells[..., 0] * (blur_px * pieces.slope) - bells[..., 1] * (
        (0.5 * blur_px**2) * pieces.curvature
    )


def fit_shading(
    pieces: Pieces,
    blur_px: float,
    terms: int,
    knots: Knots,
    robust: np.ndarray | None = None,
    prior: np.ndarray | None = None,
) -> tuple[Shading, float]:
    """Most probable radiance over all pieces with their positions as they stand; also how badly it fits, per pixel.

    Each piece has its own gain and offset of the background (shadow, drifting light). robust (s,): weight of
    each piece. prior (terms,): sigma of each coefficient in grey levels (see `wave_prior`), which also is nearly the
    same at neighbouring knots; None leaves them free. The misfit is chi², and with a prior minus twice the log
    evidence: what a shift of the rod and a change of its shading explain alike is then not credited to the shading in
    full.
    """
    equations = Equations(pieces, blur_px, terms)
    robust = np.ones(len(pieces)) if robust is None else robust
    left, right = equations.shared(knots.weights(pieces), robust)
    stiff = (
        1e-6 * np.trace(left) / len(left) * np.eye(len(left))
        if prior is None
        else stiffness(prior, knots)
    )
    factors = lu_factor(left + stiff, check_finite=False)
    waves = lu_solve(factors, right, check_finite=False)
    misfit = float(robust @ equations.power - 2.0 * right @ waves + waves @ left @ waves)
    if prior is not None:
        misfit += float(waves @ stiff @ waves + np.sum(np.log(np.abs(np.diag(factors[0])))))
    pixels = float((pieces.weight > 0).sum(axis=1) @ robust)
    shading = Shading(knots, waves.reshape(len(knots), terms), blur_px)
    return shading, misfit / max(1.0, pixels)


class Equations:
    """Each piece's normal equations for its shading, the background's gain and offset eliminated.

    gram (s, terms, terms), moment (s, terms), and the squares power (s,) that the background leaves.
    """

    def __init__(self, pieces: Pieces, blur_px: float, terms: int):
        self.pieces, self.blur_px = pieces, blur_px
        self._near, self._far = _parted(pieces, blur_px)
        pieces, weight = self._near, self._near.weight
        # of each pixel the light, the background by gain and offset, what is seen
        columns = shading_basis(
            pieces.offset_px, pieces.radius_px[:, None], blur_px, terms, weight, 1
        )
        leaked, open_share = (
            _not_leaked(pieces, columns[..., -3:-1], blur_px),
            weight - columns[..., 0],
        )
        columns[..., -3] = open_share * pieces.background + leaked
        columns[..., -2] = open_share
        columns[..., -1] = pieces.grey * weight
        self._columns, normal = columns, columns.transpose(0, 2, 1) @ columns
        normal[:, -3:, -3:] += self._far
        self._around = normal[:, -3:-1]
        self._inverse = _inverse_of_two(self._around[:, :, -3:-1] + WEAK * np.eye(2))
        normal = normal - self._around.transpose(0, 2, 1) @ (self._inverse @ self._around)
        self.gram, self.moment, self.power = (
            normal[:, :terms, :terms],
            normal[:, :terms, -1],
            normal[:, -1, -1],
        )

    def shared(self, hats: np.ndarray, robust: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Normal matrix (size, size) and right side (size,) of all knots' coefficients, the pieces' positions kept.

        hats (s, knots): weight of each knot in each piece; robust (s,): weight of each piece.
        """
        knots, terms = hats.shape[1], self.moment.shape[1]
        size = knots * terms
        pairs = (hats[:, :, None] * hats[:, None, :] * robust[:, None, None]).reshape(len(hats), -1)
        left = (pairs.T @ self.gram.reshape(len(hats), -1)).reshape(knots, knots, terms, terms)
        return (
            left.transpose(0, 2, 1, 3).reshape(size, size),
            ((hats * robust[:, None]).T @ self.moment).reshape(size),
        )

    def chi2(self, waves: np.ndarray) -> np.ndarray:
        """What pieces of this shading, waves (s, terms), leave (s,)."""
        return self.power + np.einsum(
            "st,st->s", waves, (self.gram @ waves[..., None])[..., 0] - 2.0 * self.moment
        )

    def linearised(self, waves: np.ndarray) -> "Slopes":
        """How pieces of this shading, waves (s, terms), change with position and blur; what leaks is taken to stay."""
        pieces, pixels, terms = self._near, self._columns, waves.shape[1]
        seen, behind = pixels[..., -1], pixels[..., -3:-1]
        left = seen - (pixels[..., :terms] @ waves[..., None])[..., 0]
        beyond = self._far[:, :2, 2:]  # where nothing is lit, so that all that is seen is left
        explained = self._inverse @ (
            behind.transpose(0, 2, 1) @ left[..., None] + beyond
        )  # gain and constant
        by_cover = -(explained[:, 0] * pieces.background + explained[:, 1])
        slopes, curvatures = slopes_of(pieces.offset_px, pieces.radius_px, self.blur_px, waves)
        columns = np.empty((len(pieces), 3, left.shape[1]))
        columns[:, 0] = -(slopes[0] + slopes[1] * by_cover)
        # a normal density of variance v changes with v by half its second derivative
        columns[:, 1] = self.blur_px**2 * (curvatures[0] + curvatures[1] * by_cover)
        columns[:, :2] *= pieces.weight[:, None]
        columns[:, 2] = left
        mixed, gram = columns @ pixels, columns @ columns.transpose(0, 2, 1)
        mixed[:, 2, -3:] += self._far[:, 2]
        gram[:, 2, 2] += self._far[:, 2, 2]
        reduced = mixed[..., -3:-1] @ self._inverse
        gram -= reduced @ mixed[..., -3:-1].transpose(0, 2, 1)
        rod = (mixed - reduced @ self._around)[:, :2, :terms]
        covered = left - seen - pixels[..., 0] * by_cover
        return Slopes(rod, gram, np.sqrt(np.sum(covered**2, axis=1)))


@dataclass(frozen=True)
class Slopes:
    """Products of each piece's derivatives by position (px) and by the logarithm of the blur, the background's gain and
    offset eliminated: with those by its shading, rod (s, 2, terms); gram (s, 3, 3): with each other and with what is
    left. contrast (s,): see `Located`."""

    rod: np.ndarray
    gram: np.ndarray
    contrast: np.ndarray

    @property
    def power(self) -> np.ndarray:
        """What each piece by itself tells of its position (s,), 1/px²."""
        return np.maximum(self.gram[:, 0, 0], LEAST_POWER)

    @property
    def step_px(self) -> np.ndarray:
        """Gauss–Newton's step of each piece by itself (s,)."""
        return np.clip(self.gram[:, 0, 2] / self.power, -LONGEST_PX, LONGEST_PX)

    def own_sigma_px(self, chi2: np.ndarray) -> np.ndarray:
        """Sigma of each piece's position by itself (s,), where it leaves chi2 (s,) per pixel."""
        return np.sqrt(np.maximum(chi2, 1.0) / self.power)


def _parted(pieces: Pieces, blur_px: float) -> tuple[Pieces, np.ndarray]:
    """The pieces without pixels at their two ends that no light of a rod reaches, and these pixels' products
    (s, 3, 3) of background, 1 and what is seen with each other."""
    near = np.abs(pieces.offset_px) < pieces.radius_px[:, None] + _REACH_BLURS * blur_px
    near &= pieces.weight > 0
    first, last = np.flatnonzero(np.any(near, axis=0))[[0, -1]] if np.any(near) else (0, -1)
    ends = (slice(None, first), slice(last + 1, None))
    background, seen, weight = (
        np.concatenate([part[:, end] for end in ends], axis=1)
        for part in (pieces.background, pieces.grey, pieces.weight)
    )
    far = np.stack([background * weight, weight, seen * weight], axis=1)
    return pieces.columns(slice(first, last + 1)), far @ far.transpose(0, 2, 1)


def _inverse_of_two(matrices) -> np.ndarray:
    """Inverses of symmetric matrices (s, 2, 2)."""
    a, b, d = matrices[:, 0, 0], matrices[:, 0, 1], matrices[:, 1, 1]
    return np.stack([d, -b, -b, a], axis=1).reshape(-1, 2, 2) / (a * d - b * b)[:, None, None]


# [1] Prior sigma of each wave round a thin, lit rod beside its contrast: diffuse light fills the
# first three, a highlight a quarter of the rod wide reaches the eleventh (its Fourier series).
# Study: lines.py.
WAVE_SHARE = np.array([2.0, 0.6, 0.6, 0.4, 0.4, 0.3, 0.3, 0.2, 0.2, 0.1, 0.1])
# [1] What of it changes from knot to knot: light and finish are much the same a centimetre
# farther on. Free at every knot, shading bends the line of a wire before an even floor by up to a
# pixel. Study: thresholds.py lines.shading _CHANGE_SHARE ….
_CHANGE_SHARE = 0.1
# [1] The same from turn to turn of `_LIT_ALIKE_RAD`: light and rod keep, the angle at which they
# meet does not. Set by eye. Study: thresholds.py lines.shading _TURNED_SHARE ….
_TURNED_SHARE = 0.3


def stiffness(prior: np.ndarray, knots: Knots) -> np.ndarray:
    """Inverse covariance (size, size) of all coefficients of waves with these priors (terms,): each knot's own, and its
    differences to its neighbours."""
    return np.kron(between_knots(knots), np.diag(prior**-2.0))


def between_knots(knots: Knots) -> np.ndarray:
    """Inverse covariance (knots, knots) of one wave's coefficients over its own variance."""
    return _between(len(knots.turn_rad), len(knots.place_mm))


@lru_cache
def _between(turns: int, places: int) -> np.ndarray:
    along, turned = (
        steps.T @ steps for steps in (np.diff(np.eye(count), axis=0) for count in (places, turns))
    )
    return (
        np.eye(turns * places)
        + np.kron(np.eye(turns), along) / _CHANGE_SHARE**2
        + np.kron(turned, np.eye(places)) / _TURNED_SHARE**2
    )


def contrast_of(pieces: Pieces) -> float:
    """By how much the rod differs from its background in these pieces, RMS, grey levels; one at least."""
    inside = (np.abs(pieces.offset_px) < pieces.radius_px[:, None]) & (pieces.weight > 0)
    contrast = (
        np.sqrt(np.mean((pieces.grey - pieces.background)[inside] ** 2)) if np.any(inside) else 1.0
    )
    return max(float(contrast), 1.0)


def wave_prior(pieces: Pieces, terms: int) -> np.ndarray:
    """Sigma (terms,) of the shading's coefficients in grey levels, from the rod's contrast in these pieces."""
    return contrast_of(pieces) * WAVE_SHARE[:terms]


@dataclass(frozen=True)
class Located:
    """Where each piece lies: shift_px, sigma_px (s,) along the normal; chi2 (s,) per pixel; contrast (s,).

    contrast: signal of the rod against its background over the noise, over the whole piece. shared_px (s, k): by how
    much each moves with what all share, light and lens, by one sigma of each of k independent causes; beside sigma_px.
    widened_px2 (s, 2): by how much its blur² is above that of all, and sigma.
    """

    shift_px: np.ndarray
    sigma_px: np.ndarray
    chi2: np.ndarray
    contrast: np.ndarray
    shared_px: np.ndarray | None = None
    widened_px2: np.ndarray | None = None


def locate(pieces: Pieces, shading: Shading, rounds: int = 3, limit_px: float = 1.5) -> Located:
    """Gauss–Newton on the position of each piece with the rod's shading known, background gain and offset free.

    Sigma, misfit and contrast are those of the last round, before its step.
    """
    waves, shift = shading.of(pieces), np.zeros(len(pieces))
    for _ in range(rounds):
        slopes = Equations(pieces.moved(shift), shading.blur_px, waves.shape[1]).linearised(waves)
        shift = np.clip(shift + slopes.step_px, -limit_px, limit_px)
    chi2 = slopes.gram[:, 2, 2] / pieces.freedom
    return Located(shift, slopes.own_sigma_px(chi2), chi2, slopes.contrast)
