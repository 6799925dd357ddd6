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
from scipy.interpolate import BSpline
from scipy.ndimage import maximum_filter1d
from scipy.special import ndtr

from vision.touched.profiles import OUTSIDE_PX, STEP_PX, Profiles, light_range

# [splines] Of the angle round the rod: finer than the blur, so that a highlight is explained
# wherever the axis is taken to be. Study: bar_scenes.py.
_SPLINES = 36
# [1] One sigma of what light on neighbouring splines differs by: this share of what it varies by
# inside the bar, and of a part of the whole contrast, for a rim may be another than what is seen
# farther in. Smaller shares take a bright bar's shaded rim for its edge. Study: bar_scenes.py.
_STEP_SHARE, _RIM_SHARE = 0.3, 0.2
# [1] One sigma of the light's second differences from spline to spline, by what it varies by
# inside the bar; the last leaves light as free as `_STEP_SHARE` does. Mixed over by evidence,
# which calls for 0.03 to 0.1 of matt bars. Study: bar_starts.py.
_TURN_SHARES = 0.03, 0.1, 0.3
# [px] Inside each edge, left out of what light varies by on the bar: two lens blurs, where the
# background is seen, too. Derived.
_RIM_BLURRED_PX = 2.0
# [1] Of the contrast, one sigma: by so much the background changes over `OUTSIDE_PX`. Set by eye.
# Study: thresholds.py bar.evidence _SLOPE_SHARE ….
_SLOPE_SHARE = 0.3
# [rad] At which the splines are added up: five a spline, 0.5 px apart at most on a bar of 56 px,
# less than a blur. Derived.
_ANGLES = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 171)
# [columns] A layout: level and slope beyond both edges.
_SIDES = 4
# [1] Of its prior variance: a way in which light may differ, and no pixel tells more of it than
# this, is left out; all of them together move no evidence by more than 0.4 where bars are likely.
# Derived.
_TOLD = 1e-3


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
        ranges = [
            light_range(light[some])
            for light, some in zip(across.light, inner)
            if np.sum(some) >= 5
        ]
        return float(np.median(ranges)) if ranges else across.contrast

    @cached_property
    def _of_outside(self) -> np.ndarray:
        """Inverse prior covariance, its diagonal, of levels and slopes beyond both edges, and of the background."""
        sides = [self._level, _SLOPE_SHARE * self.profiles.contrast]
        return np.array([*sides, *sides, 1.0, 1.0]) ** -2.0

    @cached_property
    def _of_rod(self) -> list[np.ndarray]:
        """Inverse prior covariances (splines, splines) of the light on the rod: of ever rougher light, the last that
        which turns as suddenly as it steps."""
        varies = np.hypot(self._inside, _RIM_SHARE * self.profiles.contrast)
        return [self._level**-2.0 * np.eye(_SPLINES) + one / varies**2 for one in _changes()]

    @cached_property
    def _root(self) -> np.ndarray:
        """Of the roughest light's covariance (splines, splines)."""
        return np.linalg.inv(np.linalg.cholesky(self._of_rod[-1])).T

    @cached_property
    def _smooth(self) -> list[np.ndarray]:
        """Covariances (splines, splines) of the smoother kinds of light, in what that root multiplies."""
        back = np.linalg.inv(self._root)
        return [back @ np.linalg.inv(one) @ back.T for one in self._of_rod[:-1]]

    def told(self, columns: np.ndarray, all_light: bool) -> tuple[np.ndarray, list[np.ndarray]]:
        """Ways (splines, r) in which the light on the rod may differ and pixels tell that it does, and inverse prior
        covariances (r + 6, r + 6) of these and of the light beyond both edges: of each kind of light, or of the
        roughest alone. columns (b, splines): weighted pictures of the splines.

        In these ways the roughest light varies by one each. What no pixel tells is left as each kind of light has it:
        it takes no part in the evidence."""
        seen = columns @ self._root
        size, ways = np.linalg.eigh(seen.T @ seen)
        ways = ways[:, size > _TOLD]
        rough = np.diag(np.concatenate([np.ones(ways.shape[1]), self._of_outside]))
        smooth = []
        for kind in self._smooth if all_light else ():
            smooth.append(rough.copy())
            smooth[-1][: ways.shape[1], : ways.shape[1]] = np.linalg.inv(ways.T @ kind @ ways)
        return self._root @ ways, [*smooth, rough]

    @cached_property
    def of_none(self) -> tuple[np.ndarray, np.ndarray]:
        """Minus twice the log evidence (k,) that there is no rod, and the misfit (k,) per bin then."""
        across = self.profiles
        return self._explained(
            [1.0, across.offset_px / OUTSIDE_PX, across.behind], self._of_outside[[0, 1, 4]]
        )

    def clearness(self, one: "Evidence") -> float:
        """The log of how many times worse the light is explained without a bar, or with one edge of it, left or right,
        as of another, wider thing beside which nothing is different: of the median stretch."""
        others = [
            self.of_none[1],
            *(
                self._misfit_of_edge(one.at_px + side * self.profiles.radius_px, one.blur_px)
                for side in (-1.0, 1.0)
            ),
        ]
        return float(
            np.median(np.log(np.maximum(np.min(others, axis=0), 1.0) / np.maximum(one.misfit, 1.0)))
        )

    def _misfit_of_edge(self, edge_px: np.ndarray, blur_px: float) -> np.ndarray:
        """The misfit (k,) per bin of an edge (k,) alone."""
        across = self.profiles
        beyond = ndtr((across.offset_px - edge_px[:, None]) / blur_px)
        columns = [
            share * one
            for share in (1.0 - beyond, beyond)
            for one in (1.0, across.offset_px / OUTSIDE_PX, across.behind)
        ]
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


def evidence(
    rod: LitRod,
    reach_px: float,
    blur_px: float,
    positions: int = 1,
    all_light: bool = True,
    every: int = 1,
    wider: float = 1.0,
) -> Evidence:
    """Evidence of the bar's middle up to reach_px off, at so many positions for each step of the grid, or at every so
    many steps, in each stretch; under all kinds of light, or the roughest only. wider: times the bar's width."""
    seen, radius_px = rod.profiles, wider * rod.profiles.radius_px
    most = int(np.ceil(reach_px / (every * STEP_PX)))
    shifts = every * np.arange(-most, most + 1)
    steps, more_px = _within(seen, every * most), STEP_PX / positions * np.arange(positions)
    pictures = [_on_rod(STEP_PX * steps - more, radius_px, blur_px) for more in more_px]
    light, priors = rod.told(
        _best_seen(seen, steps, every * most)[:, None] * pictures[0], all_light
    )
    normal = [
        _normal(
            seen, shifts, _columns(STEP_PX * steps - more, one @ light, radius_px, blur_px), steps
        )
        for more, one in zip(more_px, pictures)
    ]
    normal = np.stack(normal, axis=2).reshape(len(seen), -1, *normal[0].shape[-2:])
    shift_px = (STEP_PX * shifts[:, None] + more_px).ravel()
    under = [rod.marginal(normal, prior) for prior in priors]
    value, misfit = (np.stack(one, axis=-1) for one in zip(*under))
    best = np.argmin(value.reshape(len(seen), -1), axis=1)
    misfit = misfit.reshape(len(seen), -1)[np.arange(len(seen)), best]
    return Evidence(blur_px, shift_px, value, misfit, rod.of_none[0])


def _within(seen: Profiles, most: int) -> np.ndarray:
    """The places (b,) of a bar that are seen somewhere when it is looked for so many steps aside, in steps from its
    middle."""
    used = np.flatnonzero(np.convolve(np.any(seen.seen, axis=0), np.ones(2 * most + 1)) > 0)
    return used - (len(seen.offset_px) // 2 + most)


def _best_seen(seen: Profiles, steps: np.ndarray, most: int) -> np.ndarray:
    """One over sigma (b,) of what a model leaves at such places of the bar, where and in the stretch it is least."""
    weight = maximum_filter1d(np.pad(np.max(seen.weight, axis=0), most), 2 * most + 1)
    return np.sqrt(weight[steps + len(weight) // 2])


def _normal(seen: Profiles, shifts, columns, steps) -> np.ndarray:
    """Products (k, g, n, n) of the weighted columns of what the light is made of, and of the light, for middles at
    these whole steps (g,) of the grid. columns: see `_columns`, at such steps (b,) from the middle. Not to be used
    above the diagonal."""
    own, cover, leak = columns
    most, middle = int(np.max(np.abs(shifts))), len(seen.offset_px) // 2
    row, column, place = _layout(own.shape[1])
    one, other = [0, 0, 1], [0, 1, 1]
    mixed = ((own[:, None] * two[:, :, None]).reshape(len(own), -1) for two in (cover, leak))
    tables = (
        own[:, row] * own[:, column],
        *mixed,
        cover[:, one] * cover[:, other],
        cover[:, one] * leak[:, other] + leak[:, one] * cover[:, other],
        leak[:, one] * leak[:, other],
        own,
        cover,
        leak,
    )
    padded = np.pad(seen.moments, ((0, 0), (0, 0), (2 * most, 2 * most)))
    windows = padded.take(2 * most + middle + shifts[:, None] + steps, axis=2).reshape(
        len(tables), -1, len(own)
    )
    power = np.repeat(np.sum(seen.weight * seen.light**2, axis=1), len(shifts))[:, None]
    alone, *parts = map(np.matmul, windows, tables)
    sums = [
        alone,
        parts[0] + parts[1],
        parts[2] + parts[3] + parts[4],
        parts[5],
        parts[6] + parts[7],
        power,
    ]
    sums = np.concatenate(sums, axis=1)
    return sums.take(place.ravel(), axis=1).reshape(len(seen), len(shifts), *place.shape)


@lru_cache(maxsize=_SPLINES)
def _layout(own: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of so many own columns, which two (n (n + 1) / 2,) each of their products is of, and where (n + 3, n + 3) each
    product is among the sums of `_normal`; above the diagonal the first."""
    place, (row, column) = np.zeros((own + 3, own + 3), dtype=np.intp), np.tril_indices(own)
    pairs = len(row)
    place[row, column] = np.arange(pairs)
    place[own:-1, :own] = pairs + np.arange(2 * own).reshape(2, own)
    place[[-3, -2, -2], [-3, -3, -2]] = pairs + 2 * own + np.arange(3)
    place[-1] = pairs + 2 * own + 3 + np.arange(own + 3)
    return row, column, place


def _columns(
    offset_px, on_rod, radius_px: float, blur_px: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Those of the light on the rod, (n, r), and blurred pictures of level and slope beyond each edge (n, r + 4); how
    much of the background each side shows (n, 2); and what to take of its slope besides
    (n, 2), for the picture without rods was blurred whole: a product of two pictures, blurred, is that of the blurred
    ones and blur² times that of their slopes.
    """
    beyond = np.stack([-offset_px, offset_px], axis=1) - radius_px
    cover = ndtr(beyond / blur_px)
    bell = np.exp(-0.5 * (beyond / blur_px) ** 2) / np.sqrt(2.0 * np.pi)
    sides = np.stack([cover, cover * beyond / OUTSIDE_PX], axis=2).reshape(len(offset_px), _SIDES)
    return np.concatenate([on_rod, sides], axis=1), cover, blur_px * np.array([-1.0, 1.0]) * bell


def _on_rod(offset_px, radius_px: float, blur_px: float) -> np.ndarray:
    """Blurred pictures (n, splines) of a rod whose radiance is each spline of the angle round it."""
    z = (offset_px[:, None] - radius_px * np.sin(_ANGLES)) / blur_px
    area = (
        radius_px * np.cos(_ANGLES) * (_ANGLES[1] - _ANGLES[0]) / (blur_px * np.sqrt(2.0 * np.pi))
    )
    return (np.exp(-0.5 * z * z) * area) @ _splines()


@lru_cache(maxsize=1)
def _changes() -> list[np.ndarray]:
    """What light changes by from spline to spline (splines, splines), squared and over what it may, of each kind."""
    steps, turns = (np.diff(np.eye(_SPLINES), order, axis=0) for order in (1, 2))
    return [steps.T @ steps / _STEP_SHARE**2 + turns.T @ turns / share**2 for share in _TURN_SHARES]


@lru_cache(maxsize=1)
def _splines() -> np.ndarray:
    """Cubic B-splines (angles, splines) from edge to edge."""
    ends = 0.5 * np.pi
    inner = np.linspace(-ends, ends, _SPLINES - 2)
    knots = np.concatenate([[-ends] * 3, inner, [ends] * 3])
    return BSpline.design_matrix(np.clip(_ANGLES, -ends, ends - 1e-9), knots, 3).toarray()
