"""Bayesian evidence of a bar's position: the probability of a light profile for each position.

The model of a profile at distance x from its middle is the light on the rod between its edges c ±
R, and the background beyond them; the lens blurs both by a Gaussian of sigma β, and noise of
variance 1 / w is added.

* On the rod, light is a function of the angle φ round it, sin φ = (x − c) / R: a spline with a
  smooth prior.
* Beyond each edge it is a level and a slope, or a share of the picture without rods.

Light adds up before the sensor's transfer curve, grey = 255 light^(1 / gamma), so for a given c, β
and gamma the model is linear in its coefficients θ, which have wide Gaussian priors of precision P:

    y = A(c, β) θ + ε,    θ ~ N(0, P⁻¹),    ε ~ N(0, W⁻¹)
    −2 log p(y | c, β) = χ² + log |AᵀWA + P| − log |P| − log |W|    (up to a constant)
    χ² = yᵀWy − yᵀWA (AᵀWA + P)⁻¹ AᵀWy

The coefficients are integrated out (marginal likelihood; MacKay, Neural Computation 4, 415, 1992).
Highlights and dark rims inside the bar cannot pull its position, for the free light on the rod
explains them at any c. `deviance` is short for −2 log evidence throughout.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.interpolate import BSpline
from scipy.ndimage import maximum_filter1d
from scipy.special import ndtr

from vision.touched.profiles import OUTSIDE_PX, STEP_PX, Profiles, light_range

# [splines] Of the angle round the rod, at least. Study: bar_scenes.py.
_FEWEST_SPLINES = 36
# [px] Largest distance of their knots where the bar has pixels: sharper light than that the lens
# blurs, and a highlight is explained at any position of the axis. On a shaft of 130 px, 36 splines
# were 2.7 px apart: positions whose knots lay on a highlight's borders were preferred by 5 to 30 in
# deviance. With 1.5 and 0.9 it is alike to within 2. Study: real_shaft.py.
_KNOT_PX = 1.5
# [1] Sigma of the difference between neighbouring spline coefficients, over the range of light
# inside the bar. Smaller shares take a bright bar's shaded rim for its edge. Study: bar_scenes.py.
_STEP_SHARE = 0.3
# [1] Part of the whole contrast that counts as range inside the bar, for a rim may differ from
# what is visible farther in. Study: bar_scenes.py.
_RIM_SHARE = 0.2
# [1] Sigmas of the second differences of spline coefficients, over the range inside the bar, from
# smooth to rough; the last is as free as `_STEP_SHARE`. Averaged over by evidence, which selects
# 0.03 to 0.1 for matt bars. Study: bar_starts.py.
_CURVATURE_SHARES = (0.03, 0.1, 0.3)
# [1] Range of the light of a highlight that saturates its pixels, over the range that is seen: no
# pixel says more. With 1, the border of a highlight was taken for the edge of the bar, 0.9 px and 11
# sigma off. Study: bar_scenes.py.
_UNSEEN_RANGE = 10.0
# [px] Margin inside each edge without which the range of light on the bar is measured: two lens
# blurs, where the background contributes. Derived.
_RIM_BLURRED_PX = 2.0
# [1] Sigma of the background's change over `OUTSIDE_PX`, over the contrast. Half or twice it
# moves touch by 0.35 sigma at most. Study: thresholds.py touched.evidence _SLOPE_SHARE ….
_SLOPE_SHARE = 0.3
# [columns] Level and slope beyond both edges: a layout.
_SIDES = 4
# [1] Information of the pixels on a mode of the light, over its prior precision, below which the
# mode is left out: all of these together change no evidence by more than 0.4 at probable
# positions. Derived.
_LEAST_INFORMATION = 1e-3
# [positions] That are tried within less than a step to either side: with a spline between them the
# line of a painted bar errs by 0.009 px, with two a step by 0.015. Study: bar_lines.py.
_POSITIONS_WITHIN_STEP = 9
# [bins] Fewer give no range of light. Derived.
_FEWEST_BINS = 5


@dataclass(frozen=True)
class LitRod:
    """The prior model of profiles: a rod with any shading that the priors allow, before its
    background."""

    profiles: Profiles

    @cached_property
    def _level_sigma(self) -> float:
        """Return the prior sigma of any level of light."""
        profiles = self.profiles
        median = float(np.median(profiles.light[profiles.is_observed]))
        return 3.0 * profiles.contrast + median

    @cached_property
    def _inner_range(self) -> float:
        """Return the range of light on the bar without its rims, or of the whole profile of a bar
        too thin for that."""
        profiles = self.profiles
        is_inner = np.abs(profiles.offset_px) < profiles.radius_px - _RIM_BLURRED_PX
        ranges = []
        for light, is_used in zip(profiles.light, profiles.is_observed & is_inner):
            if np.sum(is_used) >= _FEWEST_BINS:
                ranges.append(light_range(light[is_used]))
        return float(np.median(ranges)) if ranges else profiles.contrast

    @cached_property
    def splines(self) -> int:
        """Return how many splines have knots at most _KNOT_PX apart on the pixels of the bar."""
        profiles = self.profiles
        is_used = np.any(profiles.is_observed, axis=0)
        radius_px = profiles.radius_px
        innermost_px = np.min(np.abs(profiles.offset_px[is_used]), initial=radius_px)
        px_per_rad = np.sqrt(radius_px**2 - innermost_px**2)
        return max(_FEWEST_SPLINES, int(np.ceil(np.pi * px_per_rad / _KNOT_PX)))

    @cached_property
    def _outside_precision(self) -> np.ndarray:
        """Return the prior precisions (6,) of level and slope beyond either edge, and of the
        background's two shares."""
        sides = [self._level_sigma, _SLOPE_SHARE * self.profiles.contrast]
        return np.array([*sides, *sides, 1.0, 1.0]) ** -2.0

    @cached_property
    def _rod_precisions(self) -> list[np.ndarray]:
        """Return the prior precisions (splines, splines) of the light on the rod, from smooth to
        rough.

        The last is that of light with a saturated highlight, if there is one.
        """
        scale = np.hypot(self._inner_range, _RIM_SHARE * self.profiles.contrast)
        level = self._level_sigma**-2.0 * np.eye(self.splines)
        penalties = _roughness_penalties(self.splines)
        precisions = [level + roughness / scale**2 for roughness in penalties]
        if self.profiles.is_saturated:
            precisions.append(level + penalties[-1] / (_UNSEEN_RANGE * scale) ** 2)
        return precisions

    @cached_property
    def _rough_root(self) -> np.ndarray:
        """Return a square root (splines, splines) of the covariance of the roughest light."""
        return np.linalg.inv(np.linalg.cholesky(self._rod_precisions[-1])).T

    @cached_property
    def _smooth_covariances(self) -> list[np.ndarray]:
        """Return the covariances (splines, splines) of the smoother light in the basis of
        `_rough_root`."""
        inverse_root = np.linalg.inv(self._rough_root)
        covariances = []
        for precision in self._rod_precisions[:-1]:
            covariances.append(inverse_root @ np.linalg.inv(precision) @ inverse_root.T)
        return covariances

    def observable_modes(
        self, design: np.ndarray, *, with_smooth_priors: bool
    ) -> tuple[np.ndarray, list[np.ndarray]]:
        """Return the modes (splines, r) of the light that pixels constrain, and the prior
        precisions (r + 6, r + 6).

        design (b, splines): whitened pictures of the splines. Modes are scaled so that each has
        prior variance 1 under the roughest prior. Modes about which the pixels say less than
        _LEAST_INFORMATION are dropped: they do not change the evidence. The precisions also hold
        those of the light beyond the edges; there is one for each smoothness of the light, or the
        roughest alone.
        """
        whitened = design @ self._rough_root
        information, modes = np.linalg.eigh(whitened.T @ whitened)
        modes = modes[:, information > _LEAST_INFORMATION]
        number = modes.shape[1]
        rough = np.diag(np.concatenate([np.ones(number), self._outside_precision]))
        precisions = []
        if with_smooth_priors:
            for covariance in self._smooth_covariances:
                precision = rough.copy()
                precision[:number, :number] = np.linalg.inv(modes.T @ covariance @ modes)
                precisions.append(precision)
        return self._rough_root @ modes, [*precisions, rough]

    def marginalise(
        self, normal: np.ndarray, precision: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the deviance (k, …) of linear Gaussian models, and their misfit (k, …): χ² per
        bin of the profile, less what the pattern always adds.

        normal (k, …, n, n): products of the whitened columns [A y], the light y last; only its
        lower triangle is used. precision (n - 1, n - 1): P of the coefficients.

        The last diagonal element of the Cholesky factor of [[AᵀWA + P, ·], [yᵀWA, yᵀWy]] is the
        root of χ².
        """
        prior = np.eye(len(precision) + 1)  # 1 keeps it positive definite where χ² is 0
        prior[:-1, :-1] = precision
        diagonal = np.diagonal(np.linalg.cholesky(normal + prior), axis1=-2, axis2=-1)
        least_chi2 = self.profiles.pattern.least_chi2[:, None]
        chi2 = diagonal[..., -1] ** 2 - 1.0 - least_chi2
        log_determinant = 2.0 * np.sum(np.log(diagonal[..., :-1]), axis=-1)
        prior_log_determinant = np.linalg.slogdet(precision)[1]
        deviance = chi2 + log_determinant - prior_log_determinant
        deviance = deviance + self.profiles.log_jacobian[:, None]
        bins = np.maximum(np.sum(self.profiles.is_observed, axis=1), 1)
        return deviance, np.maximum(chi2, 0.0) / bins[:, None]

    @cached_property
    def without_rod(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the deviance (k,) of the background alone, without a rod, and its misfit (k,) per
        bin."""
        precision = self._outside_precision[[0, 1, 4]]
        return self._marginalise_columns(self._background_columns, self._pattern_shares, precision)

    @cached_property
    def _background_columns(self) -> np.ndarray:
        """Return level, slope, and the picture without rods as columns (3, k, b)."""
        background = self.profiles.background
        slope = self.profiles.offset_px / OUTSIDE_PX
        columns = [1.0, slope, background]
        return np.stack([np.broadcast_to(column, background.shape) for column in columns])

    @property
    def _pattern_shares(self) -> np.ndarray:
        """Return how much of the background's pattern is in each of `_background_columns`."""
        shares = np.zeros_like(self._background_columns)
        shares[2] = 1.0
        return shares

    def detection_score(self, evidence: "Evidence") -> float:
        """Return log of the misfit without the bar over that with it, of the median segment.

        Alternatives are the background alone, and a single edge where the bar's left or right one
        is: the edge of some wider thing. The one with the least misfit counts. The score does not
        depend on the contrast.
        """
        misfits = [self.without_rod[1]]
        for side in (-1.0, 1.0):
            edge_px = evidence.best_shift_px + side * self.profiles.radius_px
            misfits.append(self._misfit_of_edge(edge_px, evidence.blur_px))
        alternative = np.maximum(np.min(misfits, axis=0), 1.0)
        return float(np.median(np.log(alternative / np.maximum(evidence.misfit, 1.0))))

    def _misfit_of_edge(self, edge_px: np.ndarray, blur_px: float) -> np.ndarray:
        """Return the misfit (k,) per bin of a single edge at edge_px (k,) between two
        backgrounds."""
        beyond = ndtr((self.profiles.offset_px - edge_px[:, None]) / blur_px)

        def on_both_sides(columns: np.ndarray) -> np.ndarray:
            """Return columns (n, k, b) twice, each as far as it is visible on one side."""
            return np.concatenate([(1.0 - beyond) * columns, beyond * columns])

        columns = on_both_sides(self._background_columns)
        shares = on_both_sides(self._pattern_shares)
        precision = np.tile(self._outside_precision[[0, 1, 4]], 2)
        return self._marginalise_columns(columns, shares, precision)[1]

    def _marginalise_columns(
        self, columns: np.ndarray, shares: np.ndarray, precision: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the deviance and the misfit (k,) of columns (n, k, b) whose coefficients have
        precision (n,).

        shares (n, k, b): of the background's pattern in each.
        """
        profiles = self.profiles
        design = np.stack([*columns, profiles.light], axis=-1)  # (k, b, n + 1)
        whitened = np.sqrt(profiles.weight)[..., None] * design
        normal = np.swapaxes(whitened, -1, -2) @ whitened + profiles.pattern.products(shares)
        deviance, misfit = self.marginalise(normal[:, None], np.diag(precision))
        return deviance[:, 0], misfit[:, 0]


@dataclass(frozen=True)
class Evidence:
    """The evidence of k segments under one lens blur, as deviance: −2 log evidence.

    shift_px (g,): positions of the bar's middle. bar_deviance (k, g, r): of each position and each
    of r priors of the light. misfit (k,): χ² per bin at the best of these. no_bar_deviance (k,): of
    the background alone.
    """

    blur_px: float
    shift_px: np.ndarray
    bar_deviance: np.ndarray
    misfit: np.ndarray
    no_bar_deviance: np.ndarray

    @property
    def least_deviance(self) -> np.ndarray:
        """Return the deviance (k,) of each segment at its best position."""
        return self.bar_deviance.min(axis=(1, 2))

    @property
    def best_shift_px(self) -> np.ndarray:
        """Return the best position (k,) of each segment."""
        segments, _, priors = self.bar_deviance.shape
        best = np.argmin(self.bar_deviance.reshape(segments, -1), axis=1)
        return self.shift_px[best // priors]


@dataclass(frozen=True)
class _Positions:
    """The positions of the bar's middle that are tried.

    shifts (s,): in whole steps of the profiles' grid. fractions_px (p,): added to each of them.
    steps (n,): offsets from a middle, in steps, that have pixels for some shift.
    """

    shifts: np.ndarray
    fractions_px: np.ndarray
    steps: np.ndarray

    @classmethod
    def within(cls, profiles: Profiles, reach_px: float, every: int, per_step: int) -> "_Positions":
        """Return positions within reach_px: every so many steps, and `per_step` in each step.

        Within less than a step there are _POSITIONS_WITHIN_STEP.
        """
        if reach_px < STEP_PX:
            fractions_px = np.linspace(-reach_px, reach_px, _POSITIONS_WITHIN_STEP)
            return cls(np.zeros(1, dtype=int), fractions_px, _visible_steps(profiles, 0))
        most = int(np.ceil(reach_px / (every * STEP_PX)))
        shifts = every * np.arange(-most, most + 1)
        steps = _visible_steps(profiles, every * most)
        return cls(shifts, STEP_PX / per_step * np.arange(per_step), steps)

    @property
    def most(self) -> int:
        """Return the largest shift, in steps."""
        return int(np.max(np.abs(self.shifts)))

    @property
    def shift_px(self) -> np.ndarray:
        """Return all positions (s · p,)."""
        return (STEP_PX * self.shifts[:, None] + self.fractions_px).ravel()

    def offset_px(self, fraction_px: float) -> np.ndarray:
        """Return the offsets (n,) from a middle that lies a fraction of a step from the grid."""
        return STEP_PX * self.steps - fraction_px


@dataclass(frozen=True)
class _Design:
    """Columns of the model at offsets (n,) from the bar's middle, apart from the picture without
    rods.

    light (n, r + 4): of the modes of light on the rod, and of level and slope beyond each edge.
    cover (n, 2): the share of the background that is visible beyond each edge.
    leak (n, 2): the share of the background's slope that is visible, px. The picture without rods
    is blurred already, and the blur of a product of two pictures is the product of the blurred ones
    plus blur² times that of their slopes.
    """

    light: np.ndarray
    cover: np.ndarray
    leak: np.ndarray

    @classmethod
    def at(
        cls, offset_px: np.ndarray, modes: np.ndarray, radius_px: float, blur_px: float
    ) -> "_Design":
        """Return the design at offset_px (n,), with modes (splines, r) of the light on the rod."""
        rod_light = _blur_splines(offset_px, radius_px, blur_px, len(modes)) @ modes
        beyond_px = np.stack([-offset_px, offset_px], axis=1) - radius_px  # left and right edge
        cover = ndtr(beyond_px / blur_px)
        density = np.exp(-0.5 * (beyond_px / blur_px) ** 2) / np.sqrt(2.0 * np.pi)
        sides = np.stack([cover, cover * beyond_px / OUTSIDE_PX], axis=2)
        sides = sides.reshape(len(offset_px), _SIDES)
        leak = blur_px * np.array([-1.0, 1.0]) * density
        return cls(np.concatenate([rod_light, sides], axis=1), cover, leak)

    @cached_property
    def products(self) -> list[np.ndarray]:
        """Return products of two columns, (n, elements) each, by the moment that each belongs to.

        They are in the order of `Profiles.moments`. Of two columns of the light only the lower
        triangle is there, and of the two edges left left, left right and right right.
        """
        light = self.light
        cover = self.cover
        leak = self.leak
        row, column, _ = _element_layout(light.shape[1])
        one = [0, 0, 1]
        other = [0, 1, 1]
        return [
            light[:, row] * light[:, column],
            (light[:, None] * cover[:, :, None]).reshape(len(light), -1),
            (light[:, None] * leak[:, :, None]).reshape(len(light), -1),
            cover[:, one] * cover[:, other],
            cover[:, one] * leak[:, other] + leak[:, one] * cover[:, other],
            leak[:, one] * leak[:, other],
            light,
            cover,
            leak,
        ]


def compute_evidence(
    rod: LitRod,
    reach_px: float,
    blur_px: float,
    *,
    positions: int = 1,
    with_smooth_priors: bool = True,
    every: int = 1,
    width_factor: float = 1.0,
) -> Evidence:
    """Compute the evidence of positions of the bar's middle within reach_px, in each segment.

    positions: how many for each step of the profiles' grid. every: uses only every so many steps.
    Both hold where reach_px is more than a step.
    with_smooth_priors: under all priors of the light, else under the roughest alone. width_factor:
    of the bar's width.
    """
    profiles = rod.profiles
    radius_px = width_factor * profiles.radius_px
    tried = _Positions.within(profiles, reach_px, every, positions)
    picture = _blur_splines(tried.offset_px(0.0), radius_px, blur_px, rod.splines)
    root_weight = _largest_root_weight(profiles, tried)
    modes, precisions = rod.observable_modes(
        root_weight[:, None] * picture, with_smooth_priors=with_smooth_priors
    )
    normal = _normal_at_positions(profiles, tried, modes, radius_px, blur_px)
    models = [rod.marginalise(normal, precision) for precision in precisions]
    bar_deviance, misfit = np.moveaxis(models, 0, -1)  # (k, g, r) each
    best_misfit = _misfit_at_best(bar_deviance, misfit)
    return Evidence(blur_px, tried.shift_px, bar_deviance, best_misfit, rod.without_rod[0])


def _misfit_at_best(deviance: np.ndarray, misfit: np.ndarray) -> np.ndarray:
    """Return the misfit (k,) of each segment at its best position and prior, of all of them.

    deviance, misfit (k, g, r): of g positions under r priors.
    """
    segments = len(deviance)
    best = np.argmin(deviance.reshape(segments, -1), axis=1)
    return misfit.reshape(segments, -1)[np.arange(segments), best]


def _normal_at_positions(
    profiles: Profiles, tried: _Positions, modes: np.ndarray, radius_px: float, blur_px: float
) -> np.ndarray:
    """Compute the matrices of `_normal_matrices` (k, g, m, m) for middles at all positions tried.

    modes (splines, r): of the light on a rod of this radius.
    """
    matrices = []
    for fraction_px in tried.fractions_px:
        design = _Design.at(tried.offset_px(fraction_px), modes, radius_px, blur_px)
        matrices.append(_normal_matrices(profiles, tried, design))
    normal = np.stack(matrices, axis=2)  # (k, s, p, m, m)
    return normal.reshape(len(profiles), -1, *normal.shape[-2:])


def _visible_steps(profiles: Profiles, most: int) -> np.ndarray:
    """Return the offsets (n,) from a bar's middle, in steps, that have pixels for some shift of up
    to `most` steps."""
    any_observed = np.any(profiles.is_observed, axis=0)
    visible = np.flatnonzero(np.convolve(any_observed, np.ones(2 * most + 1)) > 0)
    return visible - (len(profiles.offset_px) // 2 + most)


def _largest_root_weight(profiles: Profiles, tried: _Positions) -> np.ndarray:
    """Return 1 / sigma (n,) at offsets from the middle, the largest over segments and shifts."""
    weight = np.pad(np.max(profiles.weight, axis=0), tried.most)
    largest = maximum_filter1d(weight, 2 * tried.most + 1)
    return np.sqrt(largest[tried.steps + len(largest) // 2])


def _normal_matrices(profiles: Profiles, tried: _Positions, design: _Design) -> np.ndarray:
    """Compute the matrices [A y]ᵀ W [A y] (k, s, m, m) for middles at each of the shifts.

    Columns of A are the r + 4 of the light, then the background beyond either edge, cover · g +
    leak · s of the background g and its slope s. So each element is a sum over products of two
    columns of the design times one of the `moments` of the profiles, shifted: nine matrix products
    give all of them. Only the lower triangle is right.
    """
    windows = _shifted_moments(profiles, tried)
    products = [window @ table for window, table in zip(windows, design.products)]
    sums = [
        products[0],
        products[1] + products[2],
        products[3] + products[4] + products[5],
        products[6],
        products[7] + products[8],
        np.repeat(profiles.power, len(tried.shifts))[:, None],
    ]
    _, _, element = _element_layout(design.light.shape[1])
    elements = np.concatenate(sums, axis=1).take(element.ravel(), axis=1)
    return elements.reshape(len(profiles), len(tried.shifts), *element.shape)


def _shifted_moments(profiles: Profiles, tried: _Positions) -> np.ndarray:
    """Return the moments (9, k · s, n) of the profiles at offsets from a middle at each shift."""
    margin = 2 * tried.most
    padded = np.pad(profiles.moments, ((0, 0), (0, 0), (margin, margin)))
    middle = margin + len(profiles.offset_px) // 2
    bins = middle + tried.shifts[:, None] + tried.steps  # (s, n)
    return padded.take(bins, axis=2).reshape(len(padded), -1, len(tried.steps))


@lru_cache(maxsize=_FEWEST_SPLINES)
def _element_layout(columns: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return where each sum of `_normal_matrices` stands in its matrices.

    columns: number of columns of the light. row, column (columns (columns + 1) / 2,): of the lower
    triangle of their products. element (columns + 3, columns + 3): index of each element among all
    sums, 0 above the diagonal. The rows are the light's, the backgrounds' left and right, and y's.
    """
    element = np.zeros((columns + 3, columns + 3), dtype=np.intp)
    row, column = np.tril_indices(columns)
    first = len(row)
    element[row, column] = np.arange(first)  # light by light
    element[columns:-1, :columns] = first + np.arange(2 * columns).reshape(2, columns)
    first += 2 * columns
    element[[-3, -2, -2], [-3, -3, -2]] = first + np.arange(3)  # background by background
    first += 3
    element[-1] = first + np.arange(columns + 3)  # all by y
    return row, column, element


def _blur_splines(offset_px, radius_px: float, blur_px: float, number: int) -> np.ndarray:
    """Return blurred pictures (n, number) of rods whose radiance is one spline of the angle
    each."""
    angles = _angles(number)
    z = (offset_px[:, None] - radius_px * np.sin(angles)) / blur_px
    step_rad = angles[1] - angles[0]
    area = radius_px * np.cos(angles) * step_rad / (blur_px * np.sqrt(2.0 * np.pi))
    return (np.exp(-0.5 * z * z) * area) @ _splines(number)


@lru_cache(maxsize=8)
def _roughness_penalties(number: int) -> list[np.ndarray]:
    """Return DᵀD / sigma² (number, number) of first and second differences of the light, from
    smooth to rough.

    Shares are those between _FEWEST_SPLINES. The light is a random walk, and a random walk's
    integral: between knots n times as near, variances of differences are n and n³ times less.
    """
    nearer = number / _FEWEST_SPLINES
    steps = np.diff(np.eye(number), 1, axis=0)
    curvatures = np.diff(np.eye(number), 2, axis=0)
    of_steps = nearer / _STEP_SHARE**2 * steps.T @ steps
    of_curvatures = nearer**3 * curvatures.T @ curvatures
    return [of_steps + of_curvatures / share**2 for share in _CURVATURE_SHARES]


@lru_cache(maxsize=8)
def _angles(number: int) -> np.ndarray:
    """Return the angles at which splines are integrated, rad: five for each."""
    return np.linspace(-0.5 * np.pi, 0.5 * np.pi, 5 * (number - 2) + 1)


@lru_cache(maxsize=8)
def _splines(number: int) -> np.ndarray:
    """Return so many cubic B-splines (angles, number) of the angle from edge to edge."""
    end = 0.5 * np.pi
    inner = np.linspace(-end, end, number - 2)
    knots = np.concatenate([[-end] * 3, inner, [end] * 3])
    return BSpline.design_matrix(np.clip(_angles(number), -end, end - 1e-9), knots, 3).toarray()
