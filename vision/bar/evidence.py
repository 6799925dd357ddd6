"""A lit rod of known width before its surroundings, seen across: how well each position of its axis explains the light.

Outside either edge the picture is nearly linear, or follows the picture without rods; between the edges it is the
radiance of a cylinder, a smooth but otherwise free function of the angle round it. The lens blurs both. Light adds up
before the sensor's transfer curve, grey = 255 · light^(1/gamma), so that all but position, blur and gamma is linear; it
has wide Gaussian priors and is integrated out (marginal likelihood; MacKay, Neural Computation 4, 415, 1992). What
light does inside the bar, highlights and dark rims, then cannot pull its axis: free radiance explains it anywhere.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.interpolate import BSpline
from scipy.special import ndtr

from vision.bar.profiles import OUTSIDE_PX, STEP_PX, Profiles, light_range

_SPLINES = 36  # round the rod: finer than the blur, so that a highlight is explained wherever the axis is taken to be
# What the light on neighbouring splines may differ by, one sigma: this share of what it varies by inside the bar, and
# of a part of the whole contrast (a rim may be another than what is seen farther in). Smaller shares take a bright
# bar's shaded rim for its edge (tests/ladder/bar_scenes.py).
_STEP_SHARE, _RIM_SHARE = 0.3, 0.2
_TURN_SHARES = (0.03, 0.1, 0.3)  # the same of second differences: matt bars are smooth, polished ones mirror borders
_RIM_BLURRED_PX = 2.0
_SLOPE_SHARE = 0.3  # of the contrast: by so much the background changes over OUTSIDE_PX
_ANGLES = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 241)
_SIDES = 4  # columns of level and slope beyond both edges; the picture without rods has two more


@dataclass(frozen=True)
class LitRod:
    """A model of these profiles: a rod lit in any way that its priors allow."""

    profiles: Profiles

    @cached_property
    def _level(self) -> float:
        """One sigma of how bright anything is."""
        across = self.profiles
        return 3.0 * across.contrast + float(np.median(across.light[across.seen]))

    @cached_property
    def _inside(self) -> float:
        """What the light varies by on the bar, rims apart; of one too thin for that, over all of the profile."""
        across = self.profiles
        inner = across.seen & (np.abs(across.offset_px) < across.radius_px - _RIM_BLURRED_PX)
        ranges = [light_range(light[some]) for light, some in zip(across.light, inner) if np.sum(some) >= 5]
        return float(np.median(ranges)) if ranges else across.contrast

    @cached_property
    def _of_outside(self) -> np.ndarray:
        """Inverse prior covariance, its diagonal, of levels and slopes beyond both edges, and of the background."""
        sides = [self._level, _SLOPE_SHARE * self.profiles.contrast]
        return np.array([*sides, *sides, 1.0, 1.0]) ** -2.0

    @cached_property
    def priors(self) -> list[np.ndarray]:
        """Inverse prior covariances (splines + 6, splines + 6) of the light on the rod and beyond both edges: of light
        that turns as suddenly as it steps, and of ever smoother light."""
        varies = np.hypot(self._inside, _RIM_SHARE * self.profiles.contrast)
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
        across = self.profiles
        return self._explained([1.0, across.offset_px / OUTSIDE_PX, across.behind], self._of_outside[[0, 1, 4]])

    def clearness(self, one: "Evidence") -> float:
        """The log of how many times worse the light is explained without a bar, or with one edge of it, left or right,
        as of another, wider thing beside which nothing is different: of the median stretch."""
        others = [self.of_none[1], *(self._misfit_of_edge(one.at_px + side * self.profiles.radius_px, one.blur_px)
                                     for side in (-1.0, 1.0))]
        return float(np.median(np.log(np.maximum(np.min(others, axis=0), 1.0) / np.maximum(one.misfit, 1.0))))

    def _misfit_of_edge(self, edge_px: np.ndarray, blur_px: float) -> np.ndarray:
        """The misfit (k,) per bin of an edge (k,) alone."""
        across = self.profiles
        beyond = ndtr((across.offset_px - edge_px[:, None]) / blur_px)
        columns = [share * one for share in (1.0 - beyond, beyond)
                   for one in (1.0, across.offset_px / OUTSIDE_PX, across.behind)]
        return self._explained(columns, np.tile(self._of_outside[[0, 1, 4]], 2))[1]

    def _explained(self, columns: list, prior: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`marginal` (k,) of columns (k, b) each, their prior given by its diagonal."""
        across = self.profiles
        columns = [np.broadcast_to(one, across.light.shape) for one in (*columns, across.light)]
        columns = np.sqrt(across.weight)[..., None] * np.stack(columns, axis=-1)
        normal = np.swapaxes(columns, -1, -2) @ columns
        value, misfit = self.marginal(normal[:, None], np.diag(prior))
        return value[:, 0], misfit[:, 0]

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
        value = chi2 + widths - np.linalg.slogdet(prior)[1] + self.profiles.in_grey[:, None]
        return value, chi2 / np.maximum(np.sum(self.profiles.seen, axis=1), 1)[:, None]


@dataclass(frozen=True)
class Evidence:
    """Under a lens blur, minus twice the log evidence (k, g, r) of each stretch's middle at each shift, for each prior;
    the misfit (k,) per bin at its best; and the former (k,) of there being no bar."""

    blur_px: float
    shift_px: np.ndarray
    of_bar: np.ndarray
    misfit: np.ndarray
    of_none: np.ndarray

    @property
    def least(self) -> np.ndarray:
        """That (k,) of each stretch's best."""
        return self.of_bar.min(axis=(1, 2))

    @property
    def at_px(self) -> np.ndarray:
        """The shift (k,) of each stretch's best."""
        best = np.argmin(self.of_bar.reshape(len(self.of_bar), -1), axis=1)
        return self.shift_px[best // self.of_bar.shape[2]]


def evidence(rod: LitRod, reach_px: float, blur_px: float, positions: int = 1, all_light: bool = True,
             every: int = 1, wider: float = 1.0) -> Evidence:
    """Evidence of the bar's middle up to reach_px off, at so many positions for each step of the grid, or at every so
    many steps, in each stretch; under all of `priors`, or the roughest only. wider: times the bar's width."""
    seen = rod.profiles
    most = int(np.ceil(reach_px / (every * STEP_PX)))
    whole = every * np.arange(-most, most + 1)
    more_px = STEP_PX / positions * np.arange(positions)
    shift = (STEP_PX * whole[:, None] + more_px).ravel()
    normal = np.stack([_normal(seen, whole, more, blur_px, wider * seen.radius_px) for more in more_px], axis=2)
    normal = normal.reshape(len(seen), len(shift), *normal.shape[-2:])
    under = [rod.marginal(normal, prior) for prior in (rod.priors if all_light else rod.priors[-1:])]
    value, misfit = (np.stack(one, axis=-1) for one in zip(*under))
    best = np.argmin(value.reshape(len(seen), -1), axis=1)
    misfit = misfit.reshape(len(seen), -1)[np.arange(len(seen)), best]
    return Evidence(blur_px, shift, value, misfit, rod.of_none[0])


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
    sides = np.stack([cover, cover * beyond / OUTSIDE_PX], axis=2).reshape(len(offset_px), _SIDES)
    return np.concatenate([rod, sides], axis=1), cover, blur_px * np.array([-1.0, 1.0]) * bell


@lru_cache(maxsize=1)
def _splines() -> np.ndarray:
    """Cubic B-splines (angles, splines) from edge to edge."""
    ends = 0.5 * np.pi
    inner = np.linspace(-ends, ends, _SPLINES - 2)
    knots = np.concatenate([[-ends] * 3, inner, [ends] * 3])
    return BSpline.design_matrix(np.clip(_ANGLES, -ends, ends - 1e-9), knots, 3).toarray()
