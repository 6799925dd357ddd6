"""A lit rod of known width before its surroundings, seen across: how well each position of its axis explains the light.

Outside either edge the picture is nearly linear, or follows the picture without rods; between the edges it is the
radiance of a cylinder, a smooth but otherwise free function of the angle round it. The lens blurs both. Light adds up
before the sensor's transfer curve, grey = 255 · light^(1/gamma), so that all but position, blur and gamma is linear; it
has wide Gaussian priors and is integrated out (marginal likelihood; MacKay, Neural Computation 4, 415, 1992). What
light does inside the bar, highlights and dark rims, then cannot pull its axis: free radiance explains it anywhere.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.interpolate import BSpline
from scipy.special import ndtr

from vision.lines.bands import Pieces
from vision.lines.binned import sums
from vision.pictures.view import SATURATED

FULL_SCALE = 255.0
_BIN_PX = 0.35  # a third of a lens blur
_RIM_PX = 8.0  # of a thick bar so much inside either edge is looked at
_OUTSIDE_PX = 6.0  # beyond either edge, wherever it is looked for: a shadow's border is seldom as near
_SPLINES = 36  # round the rod: finer than the blur, so that a highlight is explained wherever the axis is taken to be
# What the light on neighbouring splines may differ by, one sigma: this share of what it varies by inside the bar, and
# of a part of the whole contrast (a rim may be another than what is seen farther in). Smaller shares take a bright
# bar's shaded rim for its edge (tests/ladder/bar_scenes.py).
_STEP_SHARE, _RIM_SHARE = 0.3, 0.2
_RIM_BLURRED_PX = 2.0
_SLOPE_SHARE = 0.3  # of the contrast: by so much the background changes over _OUTSIDE_PX
_MODEL_SHARE = 0.004  # of the contrast: what no such model explains
_SHARES = np.linspace(0.0, 1.0, 9)  # of the background that may be seen beside an edge
_ANGLES = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 241)
_TABLE_PX = 0.1
_AT_ONCE = 5  # shifts: arrays that stay in the processor's cache


@dataclass(frozen=True)
class Profile:
    """A stretch of the bar, seen across. offset_px (b,): of bins from where its middle is expected; light, sigma,
    behind (b,): light in parts of full scale, its sigma, and the light of the picture without rods; by_grey (b,): the
    light's derivative by grey; place_mm: of the stretch along the bar; radius_px: half its width."""

    offset_px: np.ndarray
    light: np.ndarray
    sigma: np.ndarray
    behind: np.ndarray
    by_grey: np.ndarray
    place_mm: float
    radius_px: float

    @cached_property
    def contrast(self) -> float:
        """What the light varies by."""
        return _range(self.light)

    @cached_property
    def weight(self) -> np.ndarray:
        """One over the sigma (b,) of what a model leaves."""
        return 1.0 / np.hypot(self.sigma, _MODEL_SHARE * self.contrast)

    @cached_property
    def behind_weighted(self) -> np.ndarray:
        """The picture without rods (b,), about its median, weighted."""
        return self.weight * (self.behind - np.median(self.behind))

    @cached_property
    def in_grey(self) -> float:
        """What makes minus twice the log evidence that of a density of grey levels, whatever the transfer curve."""
        return float(-2.0 * np.sum(np.log(self.weight * self.by_grey)))

    @cached_property
    def _level(self) -> float:
        """One sigma of how bright anything is."""
        return 3.0 * self.contrast + float(np.median(self.light))

    @cached_property
    def _inside(self) -> float:
        """What the light varies by on the bar, rims apart; of one too thin for that, over all of the profile."""
        inner = np.abs(self.offset_px) < self.radius_px - _RIM_BLURRED_PX
        return _range(self.light[inner]) if np.sum(inner) >= 5 else self.contrast

    @cached_property
    def of_outside(self) -> np.ndarray:
        """Inverse prior covariance (3, 3) of level, slope and share of the background beyond an edge."""
        return np.diag(np.array([self._level, _SLOPE_SHARE * self.contrast, 1.0]) ** -2.0)

    @cached_property
    def prior(self) -> np.ndarray:
        """Inverse prior covariance (splines + 6, splines + 6) of the light on the rod and beyond both edges."""
        steps = np.diff(np.eye(_SPLINES), axis=0) / (_STEP_SHARE * np.hypot(self._inside, _RIM_SHARE * self.contrast))
        prior = np.zeros((_SPLINES + 6, _SPLINES + 6))
        prior[:_SPLINES, :_SPLINES] = steps.T @ steps + np.eye(_SPLINES) / self._level**2
        prior[_SPLINES:-3, _SPLINES:-3] = prior[-3:, -3:] = self.of_outside
        return prior

    @cached_property
    def of_none(self) -> tuple[float, float]:
        """Minus twice the log evidence that there is no rod, and the misfit per bin then."""
        columns = [self.weight, self.weight * self.offset_px / _OUTSIDE_PX, self.behind_weighted,
                   self.weight * self.light]
        value, left = _marginal(_normal(np.stack(columns, axis=-1)[None]), self, self.of_outside)
        return float(value[0]), float(left[0] / len(self.weight))


def profiles(pieces: Pieces, count: int, reach_px: float, gamma: float) -> list[Profile]:
    """So many stretches of the bar, or fewer where there are few pieces, for middles up to reach_px off."""
    radius = float(np.median(pieces.radius_px))
    stretched = pieces.offset_px * (radius / pieces.radius_px)[:, None]
    half = radius + reach_px + _OUTSIDE_PX
    bins = np.floor((stretched + half) / _BIN_PX).astype(int)
    size = int(np.ceil(2.0 * half / _BIN_PX))
    seen = (bins >= 0) & (bins < size) & (pieces.grey < SATURATED * FULL_SCALE)
    seen &= np.abs(stretched) > radius - reach_px - _RIM_PX
    light, slope = _light(pieces.grey, gamma)
    weight = np.where(seen, (pieces.weight / slope) ** 2, 0.0)
    behind, _ = _light(pieces.background, gamma)
    place = np.clip(bins, 0, size - 1) + size * np.arange(len(pieces))[:, None]
    added = [sums(weight * values, place, size) for values in (np.ones_like(light), light, behind, stretched, slope)]
    order = np.argsort(pieces.place)
    stretches = np.array_split(order, max(1, min(count, len(pieces) // 2)))
    return [_profile([part[some] for part in added], float(pieces.place[some].mean()), radius)
            for some in stretches if np.any(added[0][some])]


def _light(grey, gamma: float):
    """Light in parts of full scale, and its derivative by grey."""
    share = np.maximum(grey, 1.0) / FULL_SCALE
    return share**gamma, gamma / FULL_SCALE * share ** (gamma - 1.0)


def _profile(added, place_mm: float, radius_px: float) -> Profile:
    """Of sums (5, s, b) over the pieces of a stretch: weights, and weighted light, light behind, offset and slope.

    What differs from piece to piece beyond noise, when the share of the picture without rods that is seen there has
    been taken off, is texture of the bench.
    """
    total = added[0].sum(axis=0)
    use = total > 0
    own, total = added[0][:, use], total[use]
    light, behind, offset, by_grey = (part[:, use].sum(axis=0) / total for part in added[1:])
    there = own > 0
    number = there.sum(axis=0)
    spread = np.inf
    for share in _SHARES:
        values = (added[1] - share * added[2])[:, use]
        away = np.where(there, values / np.maximum(own, 1e-300) - values.sum(axis=0) / total, 0.0)
        spread = np.minimum(spread, np.sum(away**2, axis=0) / np.maximum(number - 1, 1) / number)
    sigma = np.sqrt(1.0 / total + spread)
    return Profile(offset, light, sigma, behind, by_grey, place_mm, radius_px)


@dataclass(frozen=True)
class Evidence:
    """Minus twice the log evidence (k, g) of each profile's middle at each shift, the misfit (k,) per bin at its best,
    and both, (k,) each, of there being no bar."""

    shift_px: np.ndarray
    of_bar: np.ndarray
    misfit: np.ndarray
    of_none: np.ndarray
    misfit_of_none: np.ndarray


def evidence(seen: Sequence[Profile], shift_px, blur_px: float) -> Evidence:
    """Evidence of the bar's middle at shifts (g,) px, in each profile."""
    of_bar, misfit = zip(*(_of_bar(profile, shift_px, blur_px) for profile in seen))
    of_none = np.array([one.of_none for one in seen]).T
    return Evidence(np.asarray(shift_px), np.array(of_bar), np.array(misfit), *of_none)


def _of_bar(profile: Profile, shift_px, blur_px: float) -> tuple[np.ndarray, float]:
    groups = np.array_split(shift_px, -(-len(shift_px) // _AT_ONCE))
    normal = np.concatenate([_normal(_columns(profile, some, blur_px)) for some in groups])
    value, left = _marginal(normal, profile, profile.prior)
    return value, float(left[np.argmin(value)] / len(profile.weight))


def _range(light) -> float:
    """From dark to bright, but for the outermost twentieths; a grey level at least."""
    return max(float(np.ptp(np.quantile(light, [0.05, 0.95]))), 1.0 / FULL_SCALE)


def _normal(columns) -> np.ndarray:
    """Products (g, n, n) of columns (g, b, n)."""
    return np.swapaxes(columns, -1, -2) @ columns


def _marginal(normal, profile: Profile, prior) -> tuple[np.ndarray, np.ndarray]:
    """Minus twice the log evidence (g,), and chi² (g,), of models with these products (g, n, n) of their weighted
    columns, the light the last of them, and a Gaussian prior with this inverse covariance (n - 1, n - 1).

    The light's own place in the root of the bordered normal equations is what the others leave of it.
    """
    normal[:, :-1, :-1] += prior
    normal[:, -1, -1] += 1.0  # where nothing is left, a root yet
    root = np.diagonal(np.linalg.cholesky(normal), axis1=-2, axis2=-1)
    chi2 = root[:, -1] ** 2 - 1.0
    widths = 2.0 * np.sum(np.log(root[:, :-1]), axis=-1)
    return chi2 + widths - np.linalg.slogdet(prior)[1] + profile.in_grey, chi2


def _columns(profile: Profile, shift_px, blur_px: float) -> np.ndarray:
    """Blurred pictures (g, b, splines + 7) of what the light is made of, for middles at these shifts (g,), and the
    light; weighted."""
    radius, weight = profile.radius_px, profile.weight
    away = profile.offset_px - np.asarray(shift_px)[:, None]
    columns = np.empty((*away.shape, _SPLINES + 7))
    first, table = _round_the_rod(round(radius, 1), round(blur_px, 2))
    place = np.clip((away - first) / _TABLE_PX, 0.0, len(table) - 1.001)
    before = place.astype(np.intp)
    part = weight * (place - before)
    columns[..., :_SPLINES] = (weight - part)[..., None] * table.take(before, axis=0)
    columns[..., :_SPLINES] += part[..., None] * table.take(before + 1, axis=0)
    for side, first_column in ((-1.0, _SPLINES), (1.0, _SPLINES + 3)):
        beyond = side * away - radius
        share = ndtr(beyond / blur_px)
        columns[..., first_column] = weight * share
        columns[..., first_column + 1] = columns[..., first_column] * beyond / _OUTSIDE_PX
        columns[..., first_column + 2] = share * profile.behind_weighted
    columns[..., -1] = weight * profile.light
    return columns


@lru_cache(maxsize=64)
def _round_the_rod(radius_px: float, blur_px: float) -> tuple[float, np.ndarray]:
    """Blurred pictures (n, splines) of a rod whose radiance is each spline of the angle round it, and the offset of
    the first row; rows are _TABLE_PX apart."""
    reach = radius_px + 6.0 * blur_px
    offset = np.arange(-reach, reach + _TABLE_PX, _TABLE_PX)
    z = (offset[:, None] - radius_px * np.sin(_ANGLES)) / blur_px
    area = radius_px * np.cos(_ANGLES) * (_ANGLES[1] - _ANGLES[0]) / (blur_px * np.sqrt(2.0 * np.pi))
    return float(offset[0]), (np.exp(-0.5 * z * z) * area) @ _splines()


@lru_cache(maxsize=1)
def _splines() -> np.ndarray:
    """Cubic B-splines (angles, splines) from edge to edge."""
    ends = 0.5 * np.pi
    inner = np.linspace(-ends, ends, _SPLINES - 2)
    knots = np.concatenate([[-ends] * 3, inner, [ends] * 3])
    return BSpline.design_matrix(np.clip(_ANGLES, -ends, ends - 1e-9), knots, 3).toarray()
