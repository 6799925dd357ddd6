"""The whisker for a job: θ, α_est, thickness, length, taper and base tilt of the least worst error of (10).

The error of a design at one slope, friction angle and distance is that of (10) with the moments of
(13), (14), and with its neglected terms to first order; its sigma is by the estimators' own
formulas, from the noise of one sample by the weights with which touch and moments are read, and
from how well the whisker's own sizes are known; its stiffness cancels, as gauges are calibrated by
it. Worst is the largest |bias| + 1.96 sigma over the region.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.base.errors import BadInput
from bench.base.progress import PartCount, count_parts
from bench.theory.sample_noise import StrokeNoise, stroke_noise
from estimator import distance, first_order, slip, uncertainty
from estimator.beam import Beam
from estimator.domain import Numbers

NAMES = ("theta_deg", "alpha_est_deg", "diameter_mm", "length_mm", "taper", "tilt_deg")
_SLOPES, _ALPHAS, _PLACES = 13, 7, 5  # of the region's grid: the worst may lie between its corners
_ALONG = np.linspace(0.0, 0.99, 34)[:, None]  # shares of the way to the contact, of the strain
# [1] Share of the diameter that is lost up to the tip: with more a whisker is a cone. Stated.
_CONE = 1.0 - 1e-3
_NO_DESIGN = 1e6  # %: of a design that is none; more where it is further from being one
# [1] Over the largest distance: a whisker slips along, too. Stated.
_SLIP_ROOM = 1.02
_GENERATIONS, _POPULATION, _TOLERANCE = 120, 12, 1e-4
_GENERATION_GAP_S = 2.0  # s, between two lines of a search's progress. A choice.


@dataclass(frozen=True)
class Region:
    """All that the whisker is to feel: ranges (low, high), and the bar.

    beta_deg: slope. alpha_deg: friction angle. d_x_mm: distance. lean_sigma_deg: one sigma of the
    bar's lean along the whisker.
    """

    beta_deg: tuple[float, float]
    alpha_deg: tuple[float, float]
    d_x_mm: tuple[float, float]
    bar_radius_mm: float = 3.0
    lean_sigma_deg: float = 5.0

    def points(
        self, slopes: int = _SLOPES, alphas: int = _ALPHAS, places: int = _PLACES
    ) -> np.ndarray:
        """Return a grid over the region, (3, slopes · alphas · places).

        Its rows are slopes, rad, friction angles, rad, and distances, mm.
        """
        beta = np.radians(np.linspace(*self.beta_deg, slopes))
        alpha = np.radians(np.linspace(*self.alpha_deg, alphas))
        d_x = np.linspace(*self.d_x_mm, places)
        return np.stack(np.meshgrid(beta, alpha, d_x, indexing="ij")).reshape(3, -1)

    def corners(self) -> np.ndarray:
        """Return the region's corners, (3, 8): slopes and friction angles, rad, and distances, mm."""
        return self.points(2, 2, 2)


@dataclass(frozen=True)
class Equipment:
    """The wire's material and the strain it bears, the gauges' noise a sample and full scale, how
    the motor whisks, and how well the whisker's length and the diameters of its ends are known."""

    youngs_modulus_GPa: float = 60.0
    most_strain: float = 0.005
    noise_Nmm: float = 0.07
    full_scale_Nmm: float = 110.0
    rate_Hz: float = 2000.0
    speed_deg_s: float = 10.0
    length_sigma_mm: float = 0.5
    diameter_sigma_mm: float = 0.02


@dataclass(frozen=True)
class DesignJob:
    """What a whisker is for: the region that it is to feel, with what equipment."""

    region: Region
    equipment: Equipment


@dataclass(frozen=True)
class Design:
    """One design; by default the paper's.

    taper: share of the diameter at the base that is lost up to the tip. tilt_deg: of the plane of
    whisking about the whisker, by which every slope is less.
    """

    theta_deg: float = 3.0
    alpha_est_deg: float = 10.0
    diameter_mm: float = 1.0
    length_mm: float = 100.0
    taper: float = 0.0
    tilt_deg: float = 0.0

    @property
    def theta_rad(self) -> float:
        """Return the pushing angle."""
        return float(np.radians(self.theta_deg))

    def beam(self, equipment: Equipment) -> Beam:
        """Return the whisker as a beam."""
        sizes = (equipment.youngs_modulus_GPa, self.diameter_mm, self.length_mm)
        if self.taper == 0:
            return Beam.from_modulus(*sizes, "cylinder")
        if self.taper > _CONE:
            return Beam.from_modulus(*sizes, "cone")
        return Beam.from_modulus(*sizes, "tapered", 1.0 - self.taper)


@dataclass(frozen=True)
class ExpectedError:
    """Error of (10) over n points, % of d_x: bias and sigma (n,), infinite where it has no distance."""

    bias_percent: np.ndarray
    sigma_percent: np.ndarray

    @property
    def bound_percent(self) -> np.ndarray:
        """Return |bias| + 1.96 sigma (n,)."""
        return np.abs(self.bias_percent) + uncertainty.Z_95 * self.sigma_percent


def expected_error(design: Design, job: DesignJob, points: np.ndarray) -> ExpectedError:
    """Compute the error of (10) that is to be expected at points (3, n) of the region."""
    beta, alpha, d_x = points
    slope = beta - np.radians(design.tilt_deg)
    beam = design.beam(job.equipment)
    with np.errstate(all="ignore"):
        thickness = beam.thickness(d_x)
        as_cylinder_mm = d_x / thickness
        moments = slip.moments(as_cylinder_mm, design.theta_rad, slope, alpha, beam.C_Nmm2)
        of_cylinder, noise_mm = _cylinder_distance(design, job.equipment, beam, *moments)
        by_friction = beam.distance_mm(of_cylinder) / d_x - 1.0
        by_noise = noise_mm / of_cylinder * thickness
        by_lean = _share_by_lean(design, job.region, np.arctan2(*moments), alpha)
    by_making = _share_by_making(design, job.equipment, d_x)
    bias = by_friction + _neglected_bias(design, job.region, thickness, slope, alpha, d_x)
    sigma = np.linalg.norm(np.broadcast_arrays(by_noise, by_lean, by_making), axis=0)
    is_open = ~np.isfinite(bias + by_noise)  # no distance there
    bias[is_open] = np.inf
    sigma[is_open] = np.inf
    return ExpectedError(100.0 * bias, 100.0 * sigma)


def _share_by_lean(design: Design, region: Region, phi: Numbers, alpha: Numbers) -> Numbers:
    """Return the relative sigma of d_x by how upright objects stand; phi: slip angle (8), rad."""
    lean_sigma = np.radians(region.lean_sigma_deg)
    return first_order.leaning(design.theta_rad, lean_sigma, phi, alpha)


def _share_by_making(design: Design, equipment: Equipment, d_x: Numbers) -> Numbers:
    """Return the relative sigma of d_x by the whisker's length and the diameters of its two ends.

    1/d_x gains the taper over the length (`Beam.distance_mm`). A wire that does not taper is drawn,
    as thick at both ends.
    """
    if design.taper == 0:
        return np.zeros_like(d_x)
    by_length = design.taper * equipment.length_sigma_mm / design.length_mm
    by_tip = equipment.diameter_sigma_mm / design.diameter_mm
    by_base = (1.0 - design.taper) * by_tip
    return d_x / design.length_mm * np.linalg.norm([by_length, by_tip, by_base])


def _cylinder_distance(
    design: Design, equipment: Equipment, beam: Beam, m_y: Numbers, m_z: Numbers
) -> tuple[Numbers, Numbers]:
    """Return the distance (n,) of the base's cylinder by (10), and its sigma by noise, mm."""
    theta = design.theta_rad
    C = beam.C_Nmm2
    alpha_est = float(np.radians(design.alpha_est_deg))
    noise = stroke_noise(theta, equipment.noise_Nmm, equipment.rate_Hz, equipment.speed_deg_s)
    distance_mm = distance.with_friction(theta, m_y, m_z, alpha_est, C)
    gradient = uncertainty.gradient_with_friction(theta, m_y, m_z, alpha_est, C)
    return distance_mm, _noise_sigma(gradient, theta, np.stack([m_y, m_z], axis=-1), noise)


def _noise_sigma(gradient, theta, moments: np.ndarray, noise: StrokeNoise) -> Numbers:
    """Return the sigma (n,) of the distance of the base's cylinder by the noise of the samples, mm.

    gradient: of the distance by θ and moments. moments (n, 2): (m_y, m_z), N·mm.
    """
    magnitude = np.linalg.norm(moments, axis=-1)
    theta_sigma = noise.touch_Nmm * theta / magnitude
    shared = noise.shared_Nmm2 * theta / magnitude**2
    return uncertainty.sigma(
        gradient,
        theta_sigma=np.where(np.isfinite(theta_sigma), theta_sigma, 0.0),
        covariance=noise.moment_Nmm**2 * np.eye(2),
        theta_moment_covariance=shared[..., None] * moments,
    )


def _neglected_bias(
    design: Design, region: Region, thickness: Numbers, slope: Numbers, alpha: Numbers, d_x: Numbers
) -> Numbers:
    """Return the bias of (10) by its neglected terms (docs/maps.md), as a share of d_x.

    They are of first order in θ: rolling on round surfaces, and friction along a held whisker; and
    of second order, of soft tips: it goes with the bend of the whisker, θ cos β / cos α where it
    slips.
    """
    theta = design.theta_rad
    steepness = np.abs(slope)
    reach = region.bar_radius_mm + 0.5 * design.diameter_mm * thickness
    rolling = first_order.rolling_at(theta, reach, slope, d_x, thickness)
    used_friction = np.tan(steepness) / np.maximum(np.tan(alpha), 1e-9)
    left_friction = np.sqrt(np.maximum(1.0 - used_friction**2, 0.0))
    held = np.where(steepness > alpha, 0.0, left_friction)
    bend = theta * np.cos(slope) / np.cos(np.minimum(steepness, alpha))
    large_angles = first_order.bending_far(bend, thickness)
    return rolling + held * first_order.dragging(theta, alpha) + large_angles


def worst_percent(design: Design, job: DesignJob) -> float:
    """Return the figure that a search minimises: the largest |bias| + 1.96 sigma over the region, %.

    A thousandth of the mean is added, so that it falls everywhere; it is beyond a million where
    `faults` finds any.
    """
    excess = sum(faults(design, job).values())
    if excess > 0:
        return _NO_DESIGN * (1.0 + excess)
    bound = expected_error(design, job, job.region.points()).bound_percent
    return float(np.minimum(bound.max(), _NO_DESIGN) + 1e-3 * np.minimum(bound, 1e3).mean())


def largest_percent(design: Design, job: DesignJob) -> float:
    """Return the largest |bias| + 1.96 sigma over the region, %."""
    return float(expected_error(design, job, job.region.points()).bound_percent.max())


def faults(design: Design, job: DesignJob) -> dict[str, float]:
    """Return by how much, as a share, a design exceeds the whisker's reach, its strain or the gauges'
    range; empty where it exceeds none."""
    equipment = job.equipment
    d_x = np.array(job.region.d_x_mm)
    reach = _SLIP_ROOM * d_x[1]
    if design.length_mm <= reach:
        return {"length": reach / design.length_mm - 1.0 + 1e-9}
    beam = design.beam(equipment)
    moments = beam.moment_Nmm(design.theta_rad, d_x)
    bending = moments * (1.0 - _ALONG) / beam.width(_ALONG * d_x / design.length_mm) ** 3
    strain = 0.5 * design.diameter_mm * bending / beam.rigidity_Nmm2
    shares = {
        "strain": strain.max() / equipment.most_strain,
        "gauges' range": moments.max() / equipment.full_scale_Nmm,
    }
    return {name: share - 1.0 for name, share in shares.items() if share > 1.0}


def best_design(ranges: Mapping[str, tuple[float, float]], job: DesignJob) -> tuple[Design, float]:
    """Find the design of least worst error within ranges (low, high) of each of NAMES.

    Returns it and that error in %. A drawn wire, which has no tolerance of a taper, is searched by
    itself. Raises BadInput where no design within the ranges is one.
    """
    lowest, highest = ranges["taper"]
    if lowest == 0.0 < highest:
        drawn = _best_of_one_making(ranges | {"taper": (0.0, 0.0)}, job)
        ground = _best_of_one_making(ranges, job)
        design = min(drawn, ground, key=lambda one: worst_percent(one, job))
    else:
        design = _best_of_one_making(ranges, job)
    _require_design(design, job)
    return design, largest_percent(design, job)


def _best_of_one_making(ranges: Mapping[str, tuple[float, float]], job: DesignJob) -> Design:
    """Find the design of least worst error within ranges over which that changes steadily."""
    design = Design(**{name: low for name, (low, _) in ranges.items()})
    free = _free(ranges)
    if free:

        def worst(values: np.ndarray) -> float:
            """Return the worst error, %, of the design with these values of its free choices."""
            return worst_percent(_with_values(design, free, values), job)

        limits = np.array([ranges[name] for name in free])
        design = _with_values(design, free, _least(worst, limits))
    return design


def _free(ranges: Mapping[str, tuple[float, float]]) -> list[str]:
    """Return the names whose range leaves a choice, in the order of NAMES."""
    free = []
    for name in NAMES:
        low, high = ranges[name]
        if low < high:
            free.append(name)
    return free


def _least(function: Callable, limits: np.ndarray) -> np.ndarray:
    """Return the arguments (n,) of the least value of a function within limits (n, 2).

    By differential evolution (Storn & Price, Journal of Global Optimization 11, 1997), then Nelder
    and Mead's simplex.
    """
    from scipy.optimize import Bounds, differential_evolution, minimize

    bounds = Bounds(*limits.T)
    count = PartCount("generations of the search, at most", _GENERATIONS, _GENERATION_GAP_S)
    found = differential_evolution(
        function,
        bounds,
        rng=np.random.default_rng(0),
        maxiter=_GENERATIONS,
        popsize=_POPULATION,
        tol=_TOLERANCE,
        polish=False,
        callback=lambda *_: count.add(),
    )
    refined = minimize(function, found.x, method="Nelder-Mead", bounds=bounds)
    return refined.x if refined.fun < found.fun else found.x


def _with_values(design: Design, names: Sequence[str], values: np.ndarray) -> Design:
    """Return a design with other values of the named choices."""
    return replace(design, **dict(zip(names, map(float, values))))


def _require_design(design: Design, job: DesignJob) -> None:
    """Raise BadInput where the best design of some ranges does not serve the region."""
    if worst_percent(design, job) < _NO_DESIGN:
        return
    found = faults(design, job)
    excesses = [f"{name} by {100 * share:.0f} %" for name, share in found.items()]
    why = "(10) has no distance where φ + α_est reaches 90°"
    if excesses:
        why = f"{', '.join(excesses)} too much"
    raise BadInput(f"no design within the ranges serves the whole region: {why}")


def costs_of_paper_values(
    ranges: Mapping[str, tuple[float, float]], job: DesignJob
) -> dict[str, float]:
    """Return the worst error of the best design with the paper's value of each free choice, %.

    It is infinite where there is no such design.
    """
    costs = {}
    free = _free(ranges)
    for name in count_parts(free, "searches with one value of the paper's", len(free)):
        value = getattr(Design(), name)
        try:
            _, costs[name] = best_design(ranges | {name: (value, value)}, job)
        except BadInput:
            costs[name] = np.inf
    return costs
