"""The whisker for a job: θ, α_est, thickness, length, taper and base tilt of the least worst error of (10).

The error of a design at one slope, friction angle and distance is what (10) says of the moments of (13), (14) there,
with what it leaves out to first order; its sigma is that of the estimators' own formulas, from the noise of one sample
by the weights with which touch and moments are read. Worst is the largest |bias| + 1.96 sigma over the region.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from bench.base.errors import BadInput
from bench.theory.sample_noise import StrokeNoise, stroke_noise
from estimator import distance, first_order, slip, uncertainty
from estimator.beam import flexural_rigidity
from estimator.domain import Numbers

NAMES = ("theta_deg", "alpha_est_deg", "diameter_mm", "length_mm", "taper", "tilt_deg")
_SLOPES, _ALPHAS, _PLACES = 13, 7, 5  # of the region's grid: the worst may lie between its corners
_ALONG = np.linspace(
    0.0, 0.99, 34
)  # parts of the way to the contact, at which the strain is looked at
_NONE = 1e6  # %: of a design that is none; more where it is further from being one
_GENERATIONS, _POPULATION, _TOLERANCE = 120, 12, 1e-4


@dataclass(frozen=True)
class Region:
    """What the whisker is to feel: ranges (low, high) of slope, friction angle and distance, the bar's radius, and how
    far it may lean along the whisker, one sigma."""

    beta_deg: tuple[float, float]
    alpha_deg: tuple[float, float]
    d_x_mm: tuple[float, float]
    bar_radius_mm: float = 3.0
    lean_sigma_deg: float = 5.0

    def points(
        self, slopes: int = _SLOPES, alphas: int = _ALPHAS, places: int = _PLACES
    ) -> np.ndarray:
        """(3, slopes · alphas · places): slopes and friction angles, rad, and distances, over the region."""
        axes = (
            np.radians(np.linspace(*self.beta_deg, slopes)),
            np.radians(np.linspace(*self.alpha_deg, alphas)),
            np.linspace(*self.d_x_mm, places),
        )
        return np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")])

    def corners(self) -> np.ndarray:
        """(3, 8): its corners, likewise."""
        return self.points(2, 2, 2)


@dataclass(frozen=True)
class Means:
    """What the bench has: the wire's stuff and the strain it bears, the gauges' noise a sample and full scale, and how
    it whisks."""

    youngs_modulus_GPa: float = 60.0
    most_strain: float = 0.005
    noise_Nmm: float = 0.07
    full_scale_Nmm: float = 110.0
    rate_Hz: float = 2000.0
    speed_deg_s: float = 10.0


@dataclass(frozen=True)
class Design:
    """One design. taper: share of the diameter at the base that is lost up to the tip; tilt_deg: of the plane of
    whisking about the whisker, by which every slope is less."""

    theta_deg: float = 3.0
    alpha_est_deg: float = 10.0
    diameter_mm: float = 1.0
    length_mm: float = 100.0
    taper: float = 0.0
    tilt_deg: float = 0.0

    @property
    def theta_rad(self) -> float:
        """Pushing angle."""
        return float(np.radians(self.theta_deg))

    def rigidity_Nmm2(self, means: Means) -> float:
        """EI at the base."""
        return float(flexural_rigidity(means.youngs_modulus_GPa, self.diameter_mm))


@dataclass(frozen=True)
class Expected:
    """Error of (10) over n points, % of d_x: bias and sigma (n,). Both are infinite where it has no distance."""

    bias_percent: np.ndarray
    sigma_percent: np.ndarray

    @property
    def bound_percent(self) -> np.ndarray:
        """|bias| + 1.96 sigma (n,)."""
        return np.abs(self.bias_percent) + uncertainty.Z_95 * self.sigma_percent


def expected(design: Design, region: Region, means: Means, points: np.ndarray) -> Expected:
    """What (10) is to be wrong by at points (3, n) of the region."""
    (beta, alpha, d_x), theta = points, design.theta_rad
    slope, left = beta - np.radians(design.tilt_deg), 1.0 - design.taper * d_x / design.length_mm
    C, alpha_est = 3.0 * design.rigidity_Nmm2(means), float(np.radians(design.alpha_est_deg))
    with np.errstate(all="ignore"):
        m_y, m_z = slip.moments(d_x / left, theta, slope, alpha, C)
        felt = theta, m_y, m_z, alpha_est, C
        found = distance.with_friction(*felt)
        of_friction = 1.0 / (1.0 / found + design.taper / design.length_mm) / d_x - 1.0
        noise = (
            _noise_share(
                felt, found, stroke_noise(theta, means.noise_Nmm, means.rate_Hz, means.speed_deg_s)
            )
            * left
        )
        phi = np.arctan2(m_y, m_z)
        lean = first_order.leaning(theta, np.radians(region.lean_sigma_deg), phi, alpha)
    bias = of_friction + _left_out(design, region, slope, alpha, d_x, left)
    told = np.isfinite(bias) & np.isfinite(noise)
    pairs = (100.0 * np.where(told, share, np.inf) for share in (bias, np.hypot(noise, lean)))
    return Expected(*pairs)


def _noise_share(felt: tuple, found: Numbers, noise: StrokeNoise) -> Numbers:
    """Relative sigma of the base's cylinder's distance (n,), by the noise of the samples."""
    theta, m_y, m_z, *_ = felt
    rise = np.stack([m_y, m_z], axis=-1)
    size = np.linalg.norm(rise, axis=-1)
    theta_sigma = noise.touch_Nmm * theta / size
    mixed = noise.shared_Nmm2 * theta / size**2
    told = {
        "theta_sigma": np.where(np.isfinite(theta_sigma), theta_sigma, 0.0),
        "covariance": noise.moment_Nmm**2 * np.eye(2),
        "theta_moment_covariance": mixed[..., None] * rise,
    }
    return uncertainty.sigma(uncertainty.gradient_with_friction(*felt), **told) / found


def _left_out(design: Design, region: Region, slope, alpha, d_x, left) -> Numbers:
    """First order of what (10) leaves out, and the second of soft tips (docs/maps.md), as a share of d_x. The second
    goes with how far the whisker is bent, θ cos β / cos α where it slips."""
    theta = design.theta_rad
    reach = region.bar_radius_mm + 0.5 * design.diameter_mm * left
    slips = np.maximum(np.abs(slope) - alpha, 0.0)
    rolled = first_order.rolling_at(theta, reach, slope, d_x, left)
    ratio = np.tan(np.abs(slope)) / np.maximum(np.tan(alpha), 1e-9)
    held = np.where(slips > 0, 0.0, np.sqrt(np.maximum(1.0 - ratio**2, 0.0)))
    bent = theta * np.cos(slope) / np.cos(np.minimum(np.abs(slope), alpha))
    return rolled + held * first_order.dragging(theta, alpha) + bent**2 / (6 * left)


def worst_percent(design: Design, region: Region, means: Means) -> float:
    """The largest |bias| + 1.96 sigma over the region, %; beyond a million where the design is none (`faults`)."""
    beyond = sum(faults(design, region, means).values())
    if beyond > 0:
        return _NONE * (1.0 + beyond)
    bound = expected(design, region, means, region.points()).bound_percent
    return float(np.minimum(bound.max(), _NONE) + 1e-3 * np.minimum(bound, 1e3).mean())


def faults(design: Design, region: Region, means: Means) -> dict[str, float]:
    """By how much, as a share, a design goes beyond what can be: the whisker's reach, its strain, the gauges' range."""
    d_x, far = (
        np.array(region.d_x_mm),
        1.02 * region.d_x_mm[1],
    )  # 2 %: it slips along the whisker, too
    if design.length_mm <= far:
        return {"length": far / design.length_mm - 1.0 + 1e-9}
    moments = (
        design.theta_rad
        * 3.0
        * design.rigidity_Nmm2(means)
        * (1.0 / d_x - design.taper / design.length_mm)
    )
    along = _ALONG[:, None] * d_x
    bent = moments * (1.0 - _ALONG[:, None]) / (1.0 - design.taper * along / design.length_mm) ** 3
    strain = 0.5 * design.diameter_mm * bent.max() / design.rigidity_Nmm2(means)
    most = {
        "strain": strain / means.most_strain,
        "gauges' range": moments.max() / means.full_scale_Nmm,
    }
    return {name: share - 1.0 for name, share in most.items() if share > 1.0}


def best_design(
    ranges: Mapping[str, tuple[float, float]], region: Region, means: Means, seed: int = 0
) -> tuple[Design, float]:
    """(design, its worst error in %) within ranges (low, high) of each of NAMES, by differential evolution (Storn &
    Price, Journal of Global Optimization 11, 1997). Raises BadInput where no design within them is one."""
    from scipy.optimize import Bounds, differential_evolution, minimize

    free = [name for name in NAMES if ranges[name][0] < ranges[name][1]]
    held = Design(**{name: ranges[name][0] for name in NAMES})

    def worst(values) -> float:
        return worst_percent(replace(held, **dict(zip(free, map(float, values)))), region, means)

    if not free:
        return _told(held, worst([]), region, means)
    low, high = np.array([ranges[name] for name in free]).T
    how = {"maxiter": _GENERATIONS, "popsize": _POPULATION, "tol": _TOLERANCE, "polish": False}
    found = differential_evolution(worst, Bounds(low, high), rng=np.random.default_rng(seed), **how)
    near = minimize(worst, found.x, method="Nelder-Mead", bounds=Bounds(low, high))
    values = near.x if near.fun < found.fun else found.x
    return _told(
        replace(held, **dict(zip(free, values.tolist()))), min(near.fun, found.fun), region, means
    )


def _told(design: Design, worst: float, region: Region, means: Means) -> tuple[Design, float]:
    if worst >= _NONE:
        beyond = faults(design, region, means)
        why = ", ".join(f"{name} by {100 * share:.0f} %" for name, share in beyond.items())
        raise BadInput(
            f"no design within the ranges serves the whole region: {why} too much"
            if beyond
            else "no design within the ranges serves the whole region: (10) has no distance where φ + α_est reaches 90°"
        )
    return design, float(expected(design, region, means, region.points()).bound_percent.max())


def worth_of_each(
    ranges: Mapping[str, tuple[float, float]], region: Region, means: Means, seed: int = 0
) -> dict[str, float]:
    """By name of what was free, the worst error of the best design with the paper's value of it, %; infinite where
    there is none."""
    paper = {f.name: f.default for f in fields(Design)}
    found = {}
    for name in NAMES:
        low, high = ranges[name]
        if low < high:
            try:
                found[name] = best_design(
                    {**ranges, name: (paper[name], paper[name])}, region, means, seed
                )[1]
            except BadInput:
                found[name] = np.inf
    return found
