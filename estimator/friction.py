"""The friction cone angle α from the moments: the fit of Fig. 8, and the paper's ways to do without it.

Way 1, tilting the array, and way 3, confidence, are here; way 2, consistency, needs what a session says of its objects.
Angles in rad, moments in N·mm, C = 3EI in N·mm², lengths in mm.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from estimator import slip
from estimator.domain import (
    Numbers,
    elementwise,
    require_friction_angle,
    require_positive,
    require_sigma,
)

READINGS = ("moments", "magnitude")
GRID = np.radians(np.arange(0.0, 89.95, 0.25))
GOLDEN = (np.sqrt(5) - 1) / 2
SHRINKINGS = 45
ROUNDING = 1e-14  # share of the data's squares that a sum of squares does not tell apart
NEVER_SLIPPED = (
    "no slope is steeper than the friction angle, so it is known only to be larger than all of them"
)
VAGUE = "the data hardly hold the friction angle: its sigma is above 1 rad"
AT_ZERO = "at the bound: the best friction angle is 0"


@dataclass(frozen=True)
class FrictionFit:
    """Least-squares friction cone angle: floats for one run, arrays for many.

    alpha_rad with sigma_rad and the 95 % interval low_rad … high_rad; rms of the residuals in the unit of
    what was fitted; status empty, or what is doubtful; freedom: degrees, of Student's t in the interval. NaN where
    the data do not hold α, but for rms and freedom.
    """

    alpha_rad: float
    sigma_rad: float
    low_rad: float
    high_rad: float
    rms: float
    status: str
    freedom: float = np.inf


@dataclass(frozen=True, eq=False)
class Pushes:
    """Moments over slopes: what one surface showed.

    beta (n,), rad; m_y and m_z (..., n), N·mm, with any leading axes, each run of them fitted by itself; d_x (mm),
    theta (rad) and C (N·mm²) scalars or (n,). sigma_y and sigma_z (..., n): the moments' own standard deviations, both
    or none. recording (n,): names what was set up once, whose points share what is wrong with the slope and the
    distance. Raises ValueError where C, d_x or theta is not positive.
    """

    beta: np.ndarray
    m_y: np.ndarray
    m_z: np.ndarray
    d_x: float | np.ndarray
    theta: float | np.ndarray
    C: float | np.ndarray
    sigma_y: np.ndarray | None = None
    sigma_z: np.ndarray | None = None
    recording: np.ndarray | None = None

    def __post_init__(self):
        for name, unit in (("C", "N·mm²"), ("d_x", "mm"), ("theta", "rad")):
            require_positive(name, getattr(self, name), unit)


def fit_alpha(pushes: Pushes, *, reading: str = "moments") -> FrictionFit:
    """Friction cone angle that fits moments over slopes best, as in Fig. 8.

    reading: "moments" takes the residuals of (13) and (14); "magnitude" those of |m|² alone, the other reading of the
    paper's "LMS fits on the sum of the squares of (13) and (14)". The fit weighs all points alike, as the paper's.

    With the moments' own sigmas the interval is that of the normal distribution. Without them the sigma comes from each
    residual's square and leverage, so that it holds as well for noise that grows with the moment, and the interval
    takes Student's t; below about 30 residuals it is somewhat short. The points of a recording count as one in it.
    Raises ValueError where a moment or slope is NaN, or their numbers differ.
    """
    if reading not in READINGS:
        raise ValueError(f"reading = {reading!r}: must be one of {', '.join(READINGS)}")
    beta, data, scale = _observations(pushes, reading)
    alpha = _least_squares(beta, data, scale, reading)
    residuals = data - _model(alpha, beta, scale, reading)
    slopes = _derivative(alpha, beta, scale, reading)
    if pushes.sigma_y is None or pushes.sigma_z is None:
        sigma, freedom = _sigma_of_residuals(residuals, slopes, pushes.recording)
    else:
        sigma, freedom = _sigma_of_data(pushes, slopes, reading), np.inf
    return _fit(
        alpha,
        sigma,
        freedom,
        residuals,
        _fits_as_well_without_slip(residuals, beta, data, scale, reading),
    )


def curves(
    alpha: ArrayLike, beta: ArrayLike, d_x: ArrayLike, theta: ArrayLike, C: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """(|m|, φ) over β for a fitted α: the solid lines of Fig. 8, in N·mm and rad."""
    return slip.moment_magnitude(d_x, theta, beta, alpha, C), slip.slip_angle(beta, alpha)


def _observations(pushes, reading):
    """Slopes (n,), data (..., n) or (..., 2n) and Cθ/d_x (n,)."""
    m_y, m_z = np.broadcast_arrays(
        np.asarray(pushes.m_y, dtype=float), np.asarray(pushes.m_z, dtype=float)
    )
    beta, scale = np.broadcast_arrays(
        np.asarray(pushes.beta, dtype=float), pushes.C * np.divide(pushes.theta, pushes.d_x)
    )
    if m_y.shape[-1:] != beta.shape or beta.size < 2:
        raise ValueError(
            f"slopes {beta.shape} and moments {m_y.shape}: need one slope a moment, two at least"
        )
    if not (np.isfinite(m_y).all() and np.isfinite(m_z).all() and np.isfinite(beta).all()):
        raise ValueError("a moment or slope is missing or infinite: leave such points out")
    both = np.concatenate([m_y, m_z], axis=-1)
    return beta, both if reading == "moments" else m_y**2 + m_z**2, scale


def _model(alpha, beta, scale, reading):
    """Expected observations (..., n) or (..., 2n) for friction angles (...)."""
    alpha = np.asarray(alpha)[..., None]
    held = np.minimum(np.abs(beta), alpha)
    phi = np.copysign(np.abs(beta) - held, beta)
    size = scale * np.cos(beta) / np.cos(held)
    if reading == "magnitude":
        return size**2
    return np.concatenate([size * np.sin(phi), size * np.cos(phi)], axis=-1)


def _derivative(alpha, beta, scale, reading):
    """∂model/∂α, zero without slip; (Cθ/d_x)/cos²α times −cos²β for m_y, sin β cos β for m_z."""
    alpha = np.asarray(alpha)[..., None]
    steep = np.abs(beta)
    share = np.where(steep > alpha, scale * np.cos(beta) / np.cos(alpha) ** 2, 0.0)
    if reading == "magnitude":
        return 2 * share * scale * np.cos(beta) * np.tan(alpha)
    return np.concatenate([-np.sign(beta) * share * np.cos(beta), share * np.sin(steep)], axis=-1)


def _least_squares(beta, data, scale, reading):
    """Global minimum over α: the best of a grid, then golden sections between its neighbours."""
    model = _model(GRID, beta, scale, reading)
    cost = (model**2).sum(axis=-1) - 2 * data @ model.T
    best = np.argmin(cost, axis=-1)
    low, high = GRID[np.maximum(best - 1, 0)], GRID[np.minimum(best + 1, len(GRID) - 1)]

    def cost_at(alpha: ArrayLike):
        return ((data - _model(alpha, beta, scale, reading)) ** 2).sum(axis=-1)

    for _ in range(SHRINKINGS):
        left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        falls = cost_at(left) > cost_at(right)
        low, high = np.where(falls, left, low), np.where(falls, high, right)
    return (low + high) / 2


def _sigma_of_residuals(residuals, slopes, recording):
    """(sigma, degrees of freedom) of α, after MacKinnon & White's HC2, and Bell & McCaffrey's for what comes together.

    σ² = Σ (Σ J e)² / (1 − h) over (Σ J²)², with the residuals e, the slopes J and the leverages h = Σ J² / Σ J². The
    inner sums are over each recording, or over the single residual where none is given.
    """
    n = residuals.shape[-1]
    if recording is None:
        together = np.eye(n)
    else:
        together = np.asarray(recording)[:, None] == np.unique(recording)
        together = np.tile(together, (n // len(together), 1)).astype(float)
    with np.errstate(all="ignore"):
        total = (slopes**2).sum(axis=-1)
        leverage = slopes**2 @ together / total[..., None]
        sigma = (
            np.sqrt((((slopes * residuals) @ together) ** 2 / (1 - leverage)).sum(axis=-1)) / total
        )
    return sigma, n - 1 if recording is None else (leverage > 0).sum(axis=-1) - 1


def _sigma_of_data(pushes, slopes, reading):
    """Sigma of α from the moments' own: √(Σ J² σ²) / Σ J²."""
    sigma_y, sigma_z, m_y, m_z = np.broadcast_arrays(
        pushes.sigma_y, pushes.sigma_z, pushes.m_y, pushes.m_z
    )
    if reading == "magnitude":
        sigmas = 2 * np.hypot(m_y * sigma_y, m_z * sigma_z)
    else:
        sigmas = np.concatenate([sigma_y, sigma_z], axis=-1)
    with np.errstate(all="ignore"):
        return np.sqrt((slopes**2 * sigmas**2).sum(axis=-1)) / (slopes**2).sum(axis=-1)


def _fits_as_well_without_slip(residuals, beta, data, scale, reading):
    stuck = data - _model(np.abs(beta).max(), beta, scale, reading)
    rounding = ROUNDING * (data**2).sum(axis=-1)
    return (stuck**2).sum(axis=-1) <= (residuals**2).sum(axis=-1) + rounding


def _fit(alpha, sigma, freedom, residuals, unseen):
    vague = ~(sigma < 1) & ~unseen
    at_zero = (alpha < GRID[1] / 100) & ~vague
    status = np.select([unseen, vague, at_zero], [NEVER_SLIPPED, VAGUE, AT_ZERO], "")
    alpha, sigma = (np.where(unseen | vague, np.nan, value) for value in (alpha, sigma))
    reach = stdtrit(freedom, 0.975) * sigma
    rms = np.sqrt((residuals**2).mean(axis=-1))
    numbers = (alpha, sigma, np.maximum(alpha - reach, 0.0), alpha + reach, rms)
    status = status if status.ndim else str(status)
    return FrictionFit(
        *(_float_or_array(value) for value in numbers), status, _float_or_array(freedom)
    )


def _float_or_array(value):
    return float(value) if np.ndim(value) == 0 else value


def alpha_from_tilts(tilt: ArrayLike, phi: ArrayLike, *, phi_sigma: ArrayLike = 0.0) -> FrictionFit:
    """Friction cone angle from tilting the whole array about the whisker's x axis (section VII, way 1).

    tilt (n,) and the felt slip angles φ (n,) in rad. φ follows the tilt less α beyond the range in which
    it is zero, and that range is 2α: the two lines of slope one are fitted, and α is half their distance.
    phi_sigma is one slip angle's; 0 takes the scatter about the lines, with Student's t for the interval: NaN with two
    slip angles on them. NaN with a status where φ does not leave zero on both sides.
    """
    require_sigma("phi_sigma", phi_sigma)
    tilt, phi = np.asarray(tilt, dtype=float), np.asarray(phi, dtype=float)
    known = np.isfinite(tilt) & np.isfinite(phi)
    tilt, phi = tilt[known], phi[known]
    middle, alpha, sides = _dead_band(tilt, phi, phi_sigma)
    if min(np.count_nonzero(side) for side in sides) == 0 or not alpha > 0:
        one_sided = "the slip angle does not leave zero on both sides of the tilts: tilt further"
        return FrictionFit(np.nan, np.nan, np.nan, np.nan, np.nan, one_sided)
    outside = np.maximum(np.abs(tilt - middle) - alpha, 0.0) * np.sign(tilt - middle)
    rms = float(np.sqrt(((phi - outside) ** 2).mean()))
    slipping = sides[0] | sides[1]
    freedom = (
        np.inf if phi_sigma > 0 else float(np.count_nonzero(slipping) - 2)
    )  # less the middle, and α
    scatter = phi_sigma
    if not phi_sigma > 0:
        scatter = np.sqrt(np.sum((phi - outside)[slipping] ** 2) / freedom) if freedom else np.nan
    sigma = scatter / 2 * np.sqrt(sum(1 / np.count_nonzero(side) for side in sides))
    reach = stdtrit(freedom, 0.975) * sigma
    low, high = max(0.0, float(alpha - reach)), float(alpha + reach)
    return FrictionFit(float(alpha), float(sigma), low, high, rms, "", freedom)


def _dead_band(tilt, phi, phi_sigma):
    """(middle, half width, masks of both sides) of the least-squares lines φ = tilt − middle ∓ α."""
    slipping = max(3 * phi_sigma, 0.1 * np.abs(phi).max(initial=0.0))
    sides = (phi < -slipping, phi > slipping)
    middle, alpha = np.nan, np.nan
    for _ in range(20):
        if not (sides[0].any() and sides[1].any()):
            break
        lower, upper = ((tilt - phi)[side].mean() for side in sides)
        middle, alpha = (lower + upper) / 2, (upper - lower) / 2
        sides = (tilt < middle - alpha, tilt > middle + alpha)
    return middle, alpha, sides


@elementwise
def confidence(
    phi: ArrayLike,
    alpha_est: ArrayLike,
    alpha_est_sigma: ArrayLike,
    relative_sigma: ArrayLike = 0.01,
) -> Numbers:
    """Weight in (0, 1] of a contact whose slip angle is φ (section VII, way 3): less where α matters more.

    The variance that would be left with α known over the whole: s² / (s² + (σ_α ∂ln d_x/∂α_est)²), with s the
    distance's own relative sigma and ∂ln d_x/∂α_est = tan α_est − tan(|φ| + α_est). 0 where φ + α_est ≥ 90°.

    >>> confidence(0.0, 0.2, 0.05)
    1.0
    """
    require_friction_angle("alpha_est", alpha_est)
    require_sigma("alpha_est_sigma", alpha_est_sigma)
    require_positive("relative_sigma", relative_sigma, "(a share)")
    steep = np.abs(phi) + alpha_est
    doubt = alpha_est_sigma * (np.tan(steep) - np.tan(alpha_est)) / relative_sigma
    weight = np.where(steep < np.pi / 2, 1 / (1 + doubt * doubt), 0.0)
    return np.where(np.isfinite(phi), weight, np.nan)
