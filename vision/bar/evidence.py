"""A lit rod of known width before its surroundings, seen across: how well each position of its axis explains the light.

Outside either edge the picture is nearly linear, or follows the picture without rods; between the edges it is the
radiance of a cylinder, a smooth but otherwise free function of the angle round it. The lens blurs both. Light adds up
before the sensor's transfer curve, grey = 255 · light^(1/gamma), so that all but position, blur and gamma is linear; it
has wide Gaussian priors and is integrated out (marginal likelihood; MacKay, Neural Computation 4, 415, 1992). What
light does inside the bar, highlights and dark rims, then cannot pull its axis: free radiance explains it anywhere.

Each pixel is shared between the two nearest places of a regular grid across the bar, so that nothing jumps as the bar
is looked for a little beside; on that grid the normal equations of all positions are one product of matrices.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.interpolate import BSpline
from scipy.ndimage import uniform_filter1d
from scipy.special import ndtr

from vision.lines.bands import Pieces

FULL_SCALE = 255.0
STEP_PX = 0.25  # of the grid: a third of a lens blur
_RIM_PX = 8.0  # of a thick bar so much inside either edge is looked at
_OUTSIDE_PX = 6.0  # beyond either edge, wherever it is looked for: a shadow's border is seldom as near
_SPLINES = 36  # round the rod: finer than the blur, so that a highlight is explained wherever the axis is taken to be
# What the light on neighbouring splines may differ by, one sigma: this share of what it varies by inside the bar, and
# of a part of the whole contrast (a rim may be another than what is seen farther in). Smaller shares take a bright
# bar's shaded rim for its edge (tests/ladder/bar_scenes.py).
_STEP_SHARE, _RIM_SHARE = 0.3, 0.2
_TURN_SHARES = (0.03, 0.1, 0.3)  # the same of second differences: matt bars are smooth, polished ones mirror borders
_RIM_BLURRED_PX = 2.0
_SLOPE_SHARE = 0.3  # of the contrast: by so much the background changes over _OUTSIDE_PX
_MODEL_SHARE = 0.001  # of the contrast: what no such model explains
_SHARES = np.linspace(0.0, 1.0, 9)  # of the background that may be seen beside an edge
_ANGLES = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 241)
_ALIKE_PX = 1.0  # a lens blur: how far the errors of neighbours go together
_SMOOTHED = 5  # steps of the grid, about as much: over which texture is averaged
_MEDIAN_SQUARED, _FEW_DIFFER = 0.455, 3.0  # of a Gaussian; times the usual variance: more is no texture
_AS_ROUGH = 50  # steps of the grid for which a stretch counts as rough as the others
_SIDES = 4  # columns of level and slope beyond both edges; the picture without rods has two more


@dataclass(frozen=True)
class Profiles:
    """Stretches of the bar, seen across. offset_px (b,): the grid, from where the middle is expected; in each stretch
    light, sigma, behind, steep, by_grey (k, b): light in parts of full scale, its sigma (infinite where nothing is
    seen), the light of the picture without rods, about its median, and its slope per px, and the light's derivative by
    grey; place_mm (k,): along the
    bar; radius_px: half its width; alike: by how much errors that neighbours share make a mean's variance larger.
    """

    offset_px: np.ndarray
    light: np.ndarray
    sigma: np.ndarray
    behind: np.ndarray
    steep: np.ndarray
    by_grey: np.ndarray
    place_mm: np.ndarray
    radius_px: float
    alike: float

    def __len__(self) -> int:
        return len(self.place_mm)

    @cached_property
    def seen(self) -> np.ndarray:
        """Where (k, b) anything is seen."""
        return np.isfinite(self.sigma)

    @cached_property
    def contrast(self) -> float:
        """What the light varies by, of the median stretch."""
        return float(np.median([_range(light[seen]) for light, seen in zip(self.light, self.seen)]))

    @cached_property
    def weight(self) -> np.ndarray:
        """One over the variance (k, b) of what a model leaves."""
        return 1.0 / (self.sigma**2 + (_MODEL_SHARE * self.contrast) ** 2)

    @cached_property
    def moments(self) -> np.ndarray:
        """Weighted products (9, k, b) of what light is made of, in the order of `_normal`'s tables."""
        behind, steep = self.weight * self.behind, self.weight * self.steep
        return np.stack([self.weight, behind, steep, behind * self.behind, behind * self.steep, steep * self.steep,
                         self.weight * self.light, behind * self.light, steep * self.light])

    @cached_property
    def in_grey(self) -> np.ndarray:
        """What makes minus twice the log evidence (k,) that of grey levels."""
        root = np.where(self.seen, np.sqrt(self.weight) * self.by_grey, 1.0)
        return -2.0 * np.sum(np.log(root), axis=1)

    @cached_property
    def _level(self) -> float:
        """One sigma of how bright anything is."""
        return 3.0 * self.contrast + float(np.median(self.light[self.seen]))

    @cached_property
    def _inside(self) -> float:
        """What the light varies by on the bar, rims apart; of one too thin for that, over all of the profile."""
        inner = self.seen & (np.abs(self.offset_px) < self.radius_px - _RIM_BLURRED_PX)
        ranges = [_range(light[some]) for light, some in zip(self.light, inner) if np.sum(some) >= 5]
        return float(np.median(ranges)) if ranges else self.contrast

    @cached_property
    def _of_outside(self) -> np.ndarray:
        """Inverse prior covariance, its diagonal, of levels and slopes beyond both edges, and of the background."""
        sides = [self._level, _SLOPE_SHARE * self.contrast]
        return np.array([*sides, *sides, 1.0, 1.0]) ** -2.0

    @cached_property
    def priors(self) -> list[np.ndarray]:
        """Inverse prior covariances (splines + 6, splines + 6) of the light on the rod and beyond both edges: of light
        that turns as suddenly as it steps, and of ever smoother light."""
        varies = np.hypot(self._inside, _RIM_SHARE * self.contrast)
        flat = np.diag(np.concatenate([np.full(_SPLINES, self._level**-2.0), self._of_outside]))
        priors = []
        for share in _TURN_SHARES:
            changes = np.concatenate([np.diff(np.eye(_SPLINES), axis=0) / _STEP_SHARE,
                                      np.diff(np.eye(_SPLINES), 2, axis=0) / share]) / varies
            priors.append(flat.copy())
            priors[-1][:_SPLINES, :_SPLINES] += changes.T @ changes
        return priors

    @cached_property
    def of_none(self) -> tuple[np.ndarray, np.ndarray]:
        """Minus twice the log evidence (k,) that there is no rod, and the misfit (k,) per bin then."""
        columns = [np.broadcast_to(one, self.light.shape)
                   for one in (1.0, self.offset_px / _OUTSIDE_PX, self.behind, self.light)]
        columns = np.sqrt(self.weight)[..., None] * np.stack(columns, axis=-1)
        normal = np.swapaxes(columns, -1, -2) @ columns
        return self.marginal(normal[:, None], np.diag(self._of_outside[[0, 1, 4]]))

    def marginal(self, normal: np.ndarray, prior: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Minus twice the log evidence (k, …), and the misfit (k, …) per bin, of models with these products
        (k, …, n, n) of their weighted columns, the light the last of them, and a Gaussian prior with this inverse
        covariance (n - 1, n - 1).

        The light's own place in the root of the bordered normal equations is what the others leave of it.
        """
        normal = normal.copy()
        normal[..., :-1, :-1] += prior
        normal[..., -1, -1] += 1.0  # where nothing is left, a root yet
        root = np.diagonal(np.linalg.cholesky(normal), axis1=-2, axis2=-1)
        chi2 = root[..., -1] ** 2 - 1.0
        widths = 2.0 * np.sum(np.log(root[..., :-1]), axis=-1)
        value = chi2 + widths - np.linalg.slogdet(prior)[1] + self.in_grey[:, None]
        return value, chi2 / np.maximum(np.sum(self.seen, axis=1), 1)[:, None]


def profiles(pieces: Pieces, count: int, reach_px: float, gamma: float) -> Profiles:
    """So many stretches of the bar, or fewer where there are few pieces, for middles up to reach_px off."""
    radius = float(np.median(pieces.radius_px))
    stretched = pieces.offset_px * (radius / pieces.radius_px)[:, None]
    half = int(np.ceil((radius + reach_px + _OUTSIDE_PX) / STEP_PX))
    place = stretched / STEP_PX + half
    seen = (place >= 0) & (place < 2 * half)
    seen &= np.abs(stretched) > radius - reach_px - _RIM_PX
    light, slope = _light(pieces.grey, gamma)
    weight = np.where(seen, (pieces.weight / slope) ** 2, 0.0)
    behind, by_background = _light(pieces.background, gamma)
    order = np.argsort(pieces.place)
    values = [np.ones_like(light), light, behind, by_background * pieces.slope, slope]
    added = _shared(weight, values, place, 2 * half + 1)[:, order]
    stretches = np.array_split(np.arange(len(pieces)), max(1, min(count, len(pieces) // 2)))
    offset, place_mm = STEP_PX * np.arange(-half, half + 1), pieces.place[order]
    return _profiles(added, stretches, offset, np.array([place_mm[some].mean() for some in stretches]), radius)


def _shared(weight, values, place, size: int) -> np.ndarray:
    """Weighted sums (v, s, size) of values (s, p), each pixel between the two nearest whole places."""
    before = np.clip(np.floor(place), 0, size - 2)
    part = np.clip(place - before, 0.0, 1.0)
    rows = size * np.arange(len(place))[:, None] + before.astype(int)
    both = np.concatenate([rows.ravel(), rows.ravel() + 1])
    shares = np.concatenate([((1.0 - part) * weight).ravel(), (part * weight).ravel()])
    return np.stack([np.bincount(both, shares * np.tile(one.ravel(), 2), len(place) * size).reshape(-1, size)
                     for one in values])


def _light(grey, gamma: float):
    """Light in parts of full scale, and its derivative by grey."""
    share = np.maximum(grey, 1.0) / FULL_SCALE
    return share**gamma, gamma / FULL_SCALE * share ** (gamma - 1.0)


def _profiles(added, stretches, offset_px, place_mm, radius_px: float) -> Profiles:
    """Of sums (5, s, b) over the pieces, in their order along the bar: weights, and weighted light, light behind, its
    slope across, and the light's derivative by grey."""
    own = added[0]
    of_stretch = np.zeros((len(stretches), len(own)))
    for row, some in zip(of_stretch, stretches):
        row[some] = 1.0
    total = of_stretch @ own
    seen = total > 0
    light, behind, steep, by_grey = ((of_stretch @ part) / np.where(seen, total, 1.0) for part in added[1:])
    each = (np.where(own > 0, part / np.where(own > 0, own, 1.0), np.nan) for part in added[1:3])
    texture, alike = _texture(of_stretch[:, 1:-1], own, *each)
    number = np.maximum(of_stretch @ (own > 0), 1)
    sigma = np.where(seen, np.sqrt(1.0 / np.where(seen, total, 1.0) + texture / number), np.inf)
    middle = [np.median(row[some]) if np.any(some) else 0.0 for row, some in zip(behind, seen)]
    behind = behind - np.array(middle)[:, None]
    return Profiles(offset_px, light, sigma, behind, steep, by_grey, place_mm, radius_px, alike)


def _texture(of_stretch, weight, light, behind) -> tuple[np.ndarray, float]:
    """Variance (k, b) of what pieces of each stretch differ by beyond noise: texture of the bench, compression; and how
    alike neighbours across are, see `Profiles`. of_stretch (k, s - 2): 1 for its pieces, the first and last left out;
    weight, light, behind (s, b): of each piece, NaN where it shows nothing.

    By a piece and the mean of the two beside it, so that what changes steadily along the bar does not count, nor what
    follows the picture without rods, by the share that is seen. A product of one figure a stretch and one across.
    """
    noise = 1.0 / np.maximum(weight[1:-1], 1e-300)
    light, behind = (one[1:-1] - 0.5 * (one[:-2] + one[2:]) for one in (light, behind))
    left = light - _SHARES[:, None, None] * behind
    there = np.isfinite(left[0])
    left = np.where(there, left, 0.0)
    number = np.maximum(np.sum(there, axis=0), 1)
    spread = np.sum(left**2, axis=1) / (1.5 * number)
    best = np.argmin(spread, axis=0)
    left = np.take_along_axis(left, best[None, None], axis=0)[0]
    # where a tilted bar's edge passes a few pieces differ
    usual = _median_there(left**2, there) / (1.5 * _MEDIAN_SQUARED)
    spread = np.minimum(spread[best, np.arange(spread.shape[1])], _FEW_DIFFER * usual)
    spread = np.maximum(uniform_filter1d(spread, _SMOOTHED), 1e-300)
    left = left / np.sqrt(1.5 * spread)
    noise = uniform_filter1d(np.sum(np.where(there, noise, 0.0), axis=0) / number, _SMOOTHED)
    shown = np.sum(of_stretch @ there, axis=1)
    rougher = (np.sum(of_stretch @ left**2, axis=1) + _AS_ROUGH) / (shown + _AS_ROUGH)
    return np.maximum(rougher[:, None] * spread - noise, 0.0), _alike(left)


def _median_there(values, there) -> np.ndarray:
    """Median (b,) of values (s, b) over the pieces that are there, of an even number the upper one; 0
    where none is."""
    ordered, count = np.sort(np.where(there, values, np.inf), axis=0), np.sum(there, axis=0)
    middle = ordered[np.clip(count // 2, 0, len(there) - 1), np.arange(len(count))]
    return np.where(count > 0, middle, 0.0)


def _alike(left) -> float:
    """By how much the variance of a mean is larger than were neighbours across, of these (s, b), independent."""
    lags = range(1, 1 + round(_ALIKE_PX / STEP_PX))
    power = max(float(np.sum(left**2)), 1e-300)
    return max(1.0, 1.0 + 2.0 * sum(float(np.sum(left[:, lag:] * left[:, :-lag])) for lag in lags) / power)


@dataclass(frozen=True)
class Evidence:
    """Under a lens blur, minus twice the log evidence (k, g, r) of each stretch's middle at each shift, for each prior;
    the misfit (k,) per bin at its best; and both, (k,) each, of there being no bar."""

    blur_px: float
    shift_px: np.ndarray
    of_bar: np.ndarray
    misfit: np.ndarray
    of_none: np.ndarray
    misfit_of_none: np.ndarray

    @property
    def least(self) -> np.ndarray:
        """That (k,) of each stretch's best."""
        return self.of_bar.min(axis=(1, 2))

    @property
    def clearness(self) -> float:
        """The log of how many times worse the light is explained without a bar: of the median stretch."""
        return float(np.median(np.log(np.maximum(self.misfit_of_none, 1.0) / np.maximum(self.misfit, 1.0))))


def evidence(seen: Profiles, reach_px: float, blur_px: float, positions: int = 1, all_light: bool = True,
             every: int = 1, wider: float = 1.0) -> Evidence:
    """Evidence of the bar's middle up to reach_px off, at so many positions for each step of the grid, or at every so
    many steps, in each stretch; under all of `priors`, or the roughest only. wider: times the bar's width."""
    most = int(np.ceil(reach_px / (every * STEP_PX)))
    whole = every * np.arange(-most, most + 1)
    more_px = STEP_PX / positions * np.arange(positions)
    shift = (STEP_PX * whole[:, None] + more_px).ravel()
    normal = np.stack([_normal(seen, whole, more, blur_px, wider * seen.radius_px) for more in more_px], axis=2)
    normal = normal.reshape(len(seen), len(shift), *normal.shape[-2:])
    under = [seen.marginal(normal, prior) for prior in (seen.priors if all_light else seen.priors[-1:])]
    value, misfit = (np.stack(one, axis=-1) for one in zip(*under))
    best = np.argmin(value.reshape(len(seen), -1), axis=1)
    none, misfit_of_none = seen.of_none
    return Evidence(blur_px, shift, value, misfit.reshape(len(seen), -1)[np.arange(len(seen)), best], none[:, 0],
                    misfit_of_none[:, 0])


def _normal(seen: Profiles, shifts, more_px: float, blur_px: float, radius_px: float) -> np.ndarray:
    """Products (k, g, n, n) of the weighted columns of what the light is made of, and of the light, for middles at
    these whole steps (g,) of the grid and so much more, of a bar so thick. Not to be used above the diagonal."""
    most = int(np.max(np.abs(shifts)))
    size = len(seen.offset_px) + 2 * most
    offset = STEP_PX * (np.arange(size) - 0.5 * (size - 1)) - more_px
    used = np.convolve(np.any(seen.seen, axis=0), np.ones(2 * most + 1)) > 0
    own, cover, leak = _columns(offset[used], radius_px, blur_px)
    row, column = np.tril_indices(own.shape[1])
    one, other = [0, 0, 1], [0, 1, 1]
    mixed = ((own[:, None] * two[:, :, None]).reshape(len(own), -1) for two in (cover, leak))
    tables = (own[:, row] * own[:, column], *mixed,
              cover[:, one] * cover[:, other], cover[:, one] * leak[:, other] + leak[:, one] * cover[:, other],
              leak[:, one] * leak[:, other], own, cover, leak)
    windows = sliding_window_view(np.pad(seen.moments, ((0, 0), (0, 0), (2 * most, 2 * most))), size, axis=2)
    windows = windows[:, :, most + shifts][..., used].reshape(len(tables), -1, len(own))
    power = np.repeat(np.sum(seen.weight * seen.light**2, axis=1), len(shifts))[:, None]
    alone, *parts = map(np.matmul, windows, tables)
    sums = [alone, parts[0] + parts[1], parts[2] + parts[3] + parts[4], parts[5], parts[6] + parts[7], power]
    sums = np.concatenate(sums, axis=1)
    return sums[:, _layout()].reshape(len(seen), len(shifts), _SPLINES + 7, _SPLINES + 7)


@lru_cache(maxsize=1)
def _layout() -> np.ndarray:
    """Where (n, n) each product is among the sums of `_normal`; above the diagonal the first."""
    own = _SPLINES + _SIDES
    place = np.zeros((own + 3, own + 3), dtype=np.intp)
    pairs = own * (own + 1) // 2
    place[np.tril_indices(own)] = np.arange(pairs)
    place[own:-1, :own] = pairs + np.arange(2 * own).reshape(2, own)
    place[[-3, -2, -2], [-3, -3, -2]] = pairs + 2 * own + np.arange(3)
    place[-1] = pairs + 2 * own + 3 + np.arange(own + 3)
    return place


def _range(light) -> float:
    """From dark to bright, but for the outermost twentieths; a grey level at least."""
    return max(float(np.ptp(np.quantile(light, [0.05, 0.95]))) if len(light) else 0.0, 1.0 / FULL_SCALE)


def _columns(offset_px, radius_px: float, blur_px: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Blurred pictures of a rod whose radiance is each spline of the angle round it, and of level and slope beyond each
    edge (n, splines + 4); how much of the background each side shows (n, 2); and what to take of its slope besides
    (n, 2), for the picture without rods was blurred whole: a product of two pictures, blurred, is that of the blurred
    ones and blur² times that of their slopes.
    """
    z = (offset_px[:, None] - radius_px * np.sin(_ANGLES)) / blur_px
    area = radius_px * np.cos(_ANGLES) * (_ANGLES[1] - _ANGLES[0]) / (blur_px * np.sqrt(2.0 * np.pi))
    rod = (np.exp(-0.5 * z * z) * area) @ _splines()
    beyond = np.stack([-offset_px, offset_px], axis=1) - radius_px
    cover = ndtr(beyond / blur_px)
    bell = np.exp(-0.5 * (beyond / blur_px) ** 2) / np.sqrt(2.0 * np.pi)
    sides = np.stack([cover, cover * beyond / _OUTSIDE_PX], axis=2).reshape(len(offset_px), _SIDES)
    return np.concatenate([rod, sides], axis=1), cover, blur_px * np.array([-1.0, 1.0]) * bell


@lru_cache(maxsize=1)
def _splines() -> np.ndarray:
    """Cubic B-splines (angles, splines) from edge to edge."""
    ends = 0.5 * np.pi
    inner = np.linspace(-ends, ends, _SPLINES - 2)
    knots = np.concatenate([[-ends] * 3, inner, [ends] * 3])
    return BSpline.design_matrix(np.clip(_ANGLES, -ends, ends - 1e-9), knots, 3).toarray()
