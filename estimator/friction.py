"""The friction cone angle α from the moments: the fit of Fig. 8, and the paper's ways to do without
it.

Way 1, tilting the array, and way 3, confidence, are here; way 2, consistency, needs the objects
that a session describes. Angles in rad, moments in N·mm, C = 3EI in N·mm², lengths in mm.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from estimator import slip
from estimator.domain import (
    Numbers,
    elementwise,
    first_failure,
    require_friction_angle,
    require_positive,
    require_sigma,
)
from estimator.reasons import NamedReason

# [1] Two sums of squares are the same but for rounding if they differ by less than this share of
# the data's own.
_ROUNDING = 1e-14
NEVER_SLIPPED = NamedReason(
    "never_slipped",
    "no slope is steeper than the friction angle, so it is known only to be larger than all of "
    "them",
)
VAGUE = NamedReason(
    "friction_vague", "the data hardly hold the friction angle: its sigma is above 1 rad"
)
AT_ZERO = NamedReason("friction_at_zero", "at the bound: the best friction angle is 0")
# [1] Sigma of a distance by all but friction, as a share of it, in the weight of way 3. Stated.
_OWN_SHARE = 0.01
ONE_SIDED = NamedReason(
    "tilts_one_sided",
    "the slip angle does not leave zero on both sides of the tilts: tilt further",
)


@dataclass(frozen=True)
class FrictionFit:
    """Least-squares friction cone angle: floats for one run, arrays for many.

    alpha_rad with sigma_rad and the 95 % interval low_rad … high_rad; rms of the residuals in the
    unit of the observations; status: empty, or why α is missing or on its bound; freedom: degrees
    of freedom of Student's t in the interval. NaN where the data do not determine α, but for rms
    and freedom.
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
    """Moments over slopes, measured on one surface.

    beta (n,): slopes, rad. m_y, m_z (..., n): moments, N·mm; each run of the leading axes is fitted
    by itself. d_x (mm), theta (rad) and C (N·mm²): scalars or (n,). sigma_y, sigma_z (..., n):
    standard deviations of the moments, both or none. recording (n,): name of the set-up of each
    point; the points of one set-up share its errors of slope and distance. Raises ValueError where
    C, d_x or theta is not positive.
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
        """Raise ValueError where C, d_x or theta is not positive."""
        require_positive("C", self.C, "N·mm²")
        require_positive("d_x", self.d_x, "mm")
        require_positive("theta", self.theta, "rad")


def fit_alpha(pushes: Pushes) -> FrictionFit:
    """Fit the friction cone angle to moments over slopes by (13) and (14), as in Fig. 8.

    All points weigh alike, as in the paper.

    With the moments' own sigmas the interval is that of the normal distribution. Without them the
    sigma comes from each residual's square and leverage, so that it also holds for noise that grows
    with the moment, and the interval takes Student's t; below about 30 residuals it is somewhat
    short. The points of a recording count as one in it. Raises ValueError where a moment or slope
    is NaN, or their numbers differ.
    """
    beta, data, scale = _observations(pushes)
    alpha = _least_squares(beta, data, scale)
    residuals = data - _model(alpha, beta, scale)
    slopes = _derivative(alpha, beta, scale)
    if pushes.sigma_y is None or pushes.sigma_z is None:
        sigma, freedom = _sigma_of_residuals(residuals, slopes, pushes.recording)
    else:
        sigma = _sigma_of_data(pushes, slopes)
        freedom = np.inf
    no_more = (residuals**2).sum(axis=-1) + _ROUNDING * (data**2).sum(axis=-1)
    never_slipped = _cost(np.abs(beta).max(), beta, data, scale) <= no_more
    at_zero = _cost(0.0, beta, data, scale) <= no_more
    return _fit(alpha, sigma, freedom, residuals, never_slipped, at_zero)


def curves(
    alpha: ArrayLike, beta: ArrayLike, d_x: ArrayLike, theta: ArrayLike, C: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Evaluate (|m|, φ) over β for a fitted α: the solid lines of Fig. 8, in N·mm and rad."""
    return slip.moment_magnitude(d_x, theta, beta, alpha, C), slip.slip_angle(beta, alpha)


def _observations(pushes):
    """Return slopes (n,), the moments m_y then m_z (..., 2n), and Cθ/d_x (n,).

    Raises ValueError for a number that is missing, and for slopes and moments that are not one to
    one.
    """
    m_y, m_z = np.broadcast_arrays(pushes.m_y, pushes.m_z)
    push = pushes.C * np.divide(pushes.theta, pushes.d_x)
    beta, scale = np.broadcast_arrays(np.asarray(pushes.beta, dtype=float), push)
    moments = np.concatenate([m_y, m_z], axis=-1, dtype=float)
    if m_y.shape[-1:] != beta.shape or beta.size < 2:
        raise ValueError(
            f"slopes {beta.shape} and moments {m_y.shape}: need one slope a moment, two at least"
        )
    if not (np.isfinite(moments).all() and np.isfinite(beta).all()):
        raise ValueError("a moment or slope is missing or infinite: leave such points out")
    return beta, moments, scale


def _model(alpha, beta, scale):
    """Predict the moments (..., 2n) for friction angles (...)."""
    alpha = np.asarray(alpha)[..., None]
    held = np.minimum(np.abs(beta), alpha)
    phi = np.copysign(np.abs(beta) - held, beta)
    magnitude = scale * np.cos(beta) / np.cos(held)
    return np.concatenate([magnitude * np.sin(phi), magnitude * np.cos(phi)], axis=-1)


def _derivative(alpha, beta, scale):
    """Differentiate `_model` by α; 0 without slip, and where a slope is α itself.

    With slip it is (Cθ/d_x)/cos²α times −cos²β for m_y, and times sin β cos β for m_z.
    """
    alpha = np.asarray(alpha)[..., None]
    steepness = np.abs(beta)
    sliding = scale * np.cos(beta) / np.cos(alpha) ** 2
    share = np.where(steepness > alpha, sliding, 0.0)
    of_m_y = -np.sign(beta) * share * np.cos(beta)
    of_m_z = share * np.sin(steepness)
    return np.concatenate([of_m_y, of_m_z], axis=-1)


def _cost(alpha, beta, data, scale):
    """Compute the residuals' sum of squares (...) at the friction angles α."""
    residuals = data - _model(alpha, beta, scale)
    return (residuals**2).sum(axis=-1)


def _least_squares(beta, data, scale):
    """Find the global minimum over α.

    Points that slip are predicted linearly in tan α, points that hold by a constant: between two
    neighbouring slopes the sum of squares is a parabola of tan α.
    """
    order = np.argsort(np.abs(beta))
    beta = beta[order]
    data = data.reshape(*data.shape[:-1], 2, len(beta))[..., order]
    bounds = np.concatenate([[0.0], np.abs(beta)])  # of the segments, rad
    tangents = np.where(bounds < np.pi / 2, np.tan(bounds), np.inf)
    best, mu = _lowest(_parabolas(beta, data, scale[order]), tangents[:-1], tangents[1:])
    # At a bound α is that slope itself: whether its point slips is then no matter of rounding.
    alpha = np.where(mu >= tangents[best + 1], bounds[best + 1], np.arctan(mu))
    return np.where(mu <= tangents[best], bounds[best], alpha)


def _lowest(parabolas, low, high):
    """Find the segment (...), and μ (...) in it, of the least sum of squares.

    parabolas: of `_parabolas`. low, high (n,): bounds of the segments.
    """
    squares, cross, curvature = parabolas
    vertex = np.divide(cross, curvature, out=low + np.zeros(cross.shape), where=curvature > 0)
    mu = np.clip(vertex, low, high)
    best = np.argmin(squares - 2 * mu * cross + mu**2 * curvature, axis=-1)
    return best, np.take_along_axis(mu, best[..., None], axis=-1)[..., 0]


def _parabolas(beta, data, scale):
    """Return the sum of squares of each segment as squares − 2 cross·tan α + curvature·tan²α, (..., n) each.

    In the segment below a slope, its point and those of all steeper ones slip; the others hold. The
    slopes (n,) are in order, data (..., 2, n) are m_y and m_z. By (13) and (14) the moments of points
    that slip are start + rate·tan α.
    """
    sliding = scale * np.cos(beta)
    start = np.stack([sliding * np.sin(beta), sliding * np.cos(beta)])
    rate = np.stack([-np.sign(beta) * sliding * np.cos(beta), sliding * np.sin(np.abs(beta))])
    residual = data - start
    held = np.stack([np.zeros_like(scale), scale])
    held_squares = ((data - held) ** 2).sum(axis=-2)
    held_before = np.cumsum(held_squares, axis=-1) - held_squares
    squares = _sum_from_here((residual**2).sum(axis=-2)) + held_before
    cross = _sum_from_here((residual * rate).sum(axis=-2))
    curvature = _sum_from_here((rate**2).sum(axis=-2))
    return squares, cross, curvature


def _sum_from_here(values):
    """Sum each of the values (..., n) and all after it."""
    return np.cumsum(values[..., ::-1], axis=-1)[..., ::-1]


def _sigma_of_residuals(residuals, slopes, recording):
    """Return (sigma of α, degrees of freedom) from the residuals' own scatter.

    σ² = Σ (Σ J e)² / (1 − h) over (Σ J²)², with the residuals e, the slopes J and the leverages h =
    Σ J² / Σ J². The inner sums are over each recording, or over the single residual where none is
    given: MacKinnon & White's HC2, and Bell & McCaffrey's form of it for what is recorded together.
    """
    leverage = slopes**2
    scores = slopes * residuals
    if recording is not None:
        leverage = _sum_by_recording(leverage, recording)
        scores = _sum_by_recording(scores, recording)
    with np.errstate(all="ignore"):
        total = (slopes**2).sum(axis=-1)
        leverage = leverage / total[..., None]
        sigma = np.sqrt((scores**2 / (1 - leverage)).sum(axis=-1)) / total
    if recording is None:
        return sigma, residuals.shape[-1] - 1
    return sigma, (leverage > 0).sum(axis=-1) - 1


def _sum_by_recording(values, recording):
    """Sum values (..., 2n) over the points of each recording (n,)."""
    names = np.tile(np.asarray(recording), 2)
    order = np.argsort(names, kind="stable")
    _, begins = np.unique(names[order], return_index=True)
    return np.add.reduceat(values[..., order], begins, axis=-1)


def _sigma_of_data(pushes, slopes):
    """Return the sigma of α by the moments' own sigmas: √(Σ J² σ²) / Σ J²."""
    given = (pushes.sigma_y, pushes.sigma_z, pushes.m_y, pushes.m_z)
    sigma_y, sigma_z, _, _ = np.broadcast_arrays(*given)
    sigmas = np.concatenate([sigma_y, sigma_z], axis=-1)
    with np.errstate(all="ignore"):
        return np.sqrt((slopes**2 * sigmas**2).sum(axis=-1)) / (slopes**2).sum(axis=-1)


def _fit(alpha, sigma, freedom, residuals, never_slipped, at_zero):
    """Assemble the fit: interval and status, and NaN where the data leave α open."""
    vague = ~(sigma < 1) & ~never_slipped
    at_zero = at_zero & ~vague
    conditions = ((NEVER_SLIPPED, ~never_slipped), (VAGUE, ~vague), (AT_ZERO, ~at_zero))
    unknown = never_slipped | vague
    alpha = np.where(unknown, np.nan, alpha)
    sigma = np.where(unknown, np.nan, sigma)
    half_width = stdtrit(freedom, 0.975) * sigma
    return FrictionFit(
        alpha_rad=_float_or_array(alpha),
        sigma_rad=_float_or_array(sigma),
        low_rad=_float_or_array(np.maximum(alpha - half_width, 0.0)),
        high_rad=_float_or_array(alpha + half_width),
        rms=_float_or_array(np.sqrt((residuals**2).mean(axis=-1))),
        status=first_failure(conditions, np.shape(alpha)),
        freedom=_float_or_array(freedom),
    )


def _float_or_array(value):
    """Convert a 0-dimensional value to a float; leave an array as it is."""
    return float(value) if np.ndim(value) == 0 else value


def alpha_from_tilts(tilt: ArrayLike, phi: ArrayLike) -> FrictionFit:
    """Estimate the friction cone angle from tilts of the whole array about the whisker's x axis.

    This is way 1 of section VII. tilt (n,) and the felt slip angles φ (n,), rad. φ follows the tilt
    less α beyond the range of tilts in which it is zero, and that range is 2α wide: two lines of
    slope one are fitted, and α is half their distance. Its sigma is that of the scatter about the
    lines, with Student's t for the interval, which is NaN with two slip angles on the lines. NaN
    with a status where φ does not leave zero on both sides.
    """
    tilt = np.asarray(tilt, dtype=float)
    phi = np.asarray(phi, dtype=float)
    known = np.isfinite(tilt) & np.isfinite(phi)
    tilt = tilt[known]
    phi = phi[known]
    band = _dead_band(tilt, phi)
    if not band.has_both_sides:
        return FrictionFit(np.nan, np.nan, np.nan, np.nan, np.nan, ONE_SIDED)
    squares = (phi - band.slip_angle(tilt)) ** 2
    sigma, freedom = _sigma_of_band(band, squares)
    half_width = stdtrit(freedom, 0.975) * sigma
    return FrictionFit(
        alpha_rad=float(band.alpha),
        sigma_rad=float(sigma),
        low_rad=max(0.0, float(band.alpha - half_width)),
        high_rad=float(band.alpha + half_width),
        rms=float(np.sqrt(squares.mean())),
        status="",
        freedom=freedom,
    )


@dataclass(frozen=True, eq=False)
class _DeadBand:
    """Range of tilts without slip: middle ∓ α, rad, NaN where a side has no point.

    below, above (n,): masks of the points on either side of it.
    """

    middle: float
    alpha: float
    below: np.ndarray
    above: np.ndarray

    @property
    def below_count(self) -> int:
        """Count the points below the range."""
        return np.count_nonzero(self.below)

    @property
    def above_count(self) -> int:
        """Count the points above the range."""
        return np.count_nonzero(self.above)

    @property
    def has_both_sides(self) -> bool:
        """Check that there are points on both sides, and a range between them."""
        return min(self.below_count, self.above_count) > 0 and self.alpha > 0

    def slip_angle(self, tilt: np.ndarray) -> np.ndarray:
        """Return the slip angles (n,) that follow from the tilts: how far they are outside."""
        from_middle = tilt - self.middle
        return np.maximum(np.abs(from_middle) - self.alpha, 0.0) * np.sign(from_middle)


def _sigma_of_band(band: _DeadBand, squares: np.ndarray) -> tuple[float, float]:
    """Return (sigma of α in rad, degrees of freedom) from the squared residuals (n,)."""
    # Two were fitted: the middle and α.
    freedom = float(band.below_count + band.above_count - 2)
    outside = squares[band.below | band.above]
    scatter = np.sqrt(np.sum(outside) / freedom) if freedom else np.nan
    return scatter / 2 * np.sqrt(1 / band.below_count + 1 / band.above_count), freedom


def _dead_band(tilt, phi) -> _DeadBand:
    """Fit the lines φ = tilt − middle ∓ α to the slip angles on both sides of the range without
    slip.
    """
    threshold = 0.1 * np.abs(phi).max(initial=0.0)
    below = phi < -threshold
    above = phi > threshold
    middle = np.nan
    alpha = np.nan
    for _ in range(20):
        if not (below.any() and above.any()):
            break
        lower = (tilt - phi)[below].mean()
        upper = (tilt - phi)[above].mean()
        middle = (lower + upper) / 2
        alpha = (upper - lower) / 2
        below = tilt < middle - alpha
        above = tilt > middle + alpha
    return _DeadBand(middle, alpha, below, above)


@elementwise
def confidence(phi: ArrayLike, alpha_est: ArrayLike, alpha_est_sigma: ArrayLike) -> Numbers:
    """Return the weight in (0, 1] of a contact with slip angle φ: less where α matters more.

    This is way 3 of section VII: the variance that would be left with α known, over the whole,
    s² / (s² + (σ_α ∂ln d_x/∂α_est)²), with the distance's own relative sigma s
    (`_OWN_SHARE`) and
    ∂ln d_x/∂α_est = tan α_est − tan(|φ| + α_est). 0 where φ + α_est ≥ 90°.

    >>> confidence(0.0, 0.2, 0.05)
    1.0
    """
    require_friction_angle("alpha_est", alpha_est)
    require_sigma("alpha_est_sigma", alpha_est_sigma)
    slope = np.abs(phi) + alpha_est
    ratio = alpha_est_sigma * (np.tan(slope) - np.tan(alpha_est)) / _OWN_SHARE
    weight = np.where(slope < np.pi / 2, 1 / (1 + ratio * ratio), 0.0)
    return np.where(np.isfinite(phi), weight, np.nan)
