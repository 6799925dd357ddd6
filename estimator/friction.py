"""The friction cone angle α from the moments: the fit of Fig. 8.

Angles in rad, moments in N·mm, C = 3EI in N·mm², lengths in mm.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from estimator import slip
from estimator.domain import first_failure, require_positive
from estimator.reasons import NamedReason

# [1] Two sums of squares are the same but for rounding if they differ by less than this share of
# the data's own: that of 45 additions. Derived.
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
    observed = _Observed.of(pushes)
    alpha = observed.best_alpha()
    residuals = observed.residuals(alpha)
    slopes = observed.derivative(alpha)
    if pushes.sigma_y is None or pushes.sigma_z is None:
        sigma, freedom = _sigma_of_residuals(residuals, slopes, pushes.recording)
    else:
        sigma = _sigma_of_data(pushes, slopes)
        freedom = np.inf
    rounding = _ROUNDING * (observed.data**2).sum(axis=-1)
    no_more = (residuals**2).sum(axis=-1) + rounding
    never_slipped = observed.cost(np.abs(observed.beta).max()) <= no_more
    at_zero = observed.cost(0.0) <= no_more
    return _fit(alpha, sigma, freedom, residuals, never_slipped, at_zero)


def curves(
    alpha: ArrayLike, beta: ArrayLike, d_x: ArrayLike, theta: ArrayLike, C: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Evaluate (|m|, φ) over β for a fitted α: the solid lines of Fig. 8, in N·mm and rad."""
    return slip.moment_magnitude(d_x, theta, beta, alpha, C), slip.slip_angle(beta, alpha)


@dataclass(frozen=True, eq=False)
class _Observed:
    """Moments as observed, and as (13) and (14) have them at a friction angle.

    beta (n,): slopes. data (..., 2n): the moments m_y, then m_z. scale (n,): Cθ/d_x.
    """

    beta: np.ndarray
    data: np.ndarray
    scale: np.ndarray

    @classmethod
    def of(cls, pushes: Pushes) -> "_Observed":
        """Return the moments of pushes.

        Raises ValueError for a number that is missing, and for slopes and moments that are not one
        to one.
        """
        m_y, m_z = np.broadcast_arrays(pushes.m_y, pushes.m_z)
        push = pushes.C * np.divide(pushes.theta, pushes.d_x)
        beta, scale = np.broadcast_arrays(np.asarray(pushes.beta, dtype=float), push)
        data = np.concatenate([m_y, m_z], axis=-1, dtype=float)
        if m_y.shape[-1:] != beta.shape or beta.size < 2:
            raise ValueError(
                f"slopes {beta.shape} and moments {m_y.shape}: need one slope a moment, two at least"
            )
        if not (np.isfinite(data).all() and np.isfinite(beta).all()):
            raise ValueError("a moment or slope is missing or infinite: leave such points out")
        return cls(beta, data, scale)

    def residuals(self, alpha: ArrayLike) -> np.ndarray:
        """Return the observed moments less those at friction angles (...), (..., 2n)."""
        held = np.minimum(np.abs(self.beta), np.asarray(alpha)[..., None])
        phi = np.copysign(np.abs(self.beta) - held, self.beta)
        magnitude = self.scale * np.cos(self.beta) / np.cos(held)
        m_y = magnitude * np.sin(phi)
        m_z = magnitude * np.cos(phi)
        return self.data - np.concatenate([m_y, m_z], axis=-1)

    def derivative(self, alpha: ArrayLike) -> np.ndarray:
        """Differentiate the moments at friction angles (...) by these; 0 without slip, and where a
        slope is α itself.

        With slip it is (Cθ/d_x)/cos²α times −cos²β for m_y, and times sin β cos β for m_z.
        """
        alpha = np.asarray(alpha)[..., None]
        _, rate = _slipping_moments(self.beta, self.scale)
        share = np.where(np.abs(self.beta) > alpha, 1.0 / np.cos(alpha) ** 2, 0.0)
        return np.concatenate([share * rate[0], share * rate[1]], axis=-1)

    def cost(self, alpha: ArrayLike) -> np.ndarray:
        """Return the residuals' sum of squares (...) at friction angles (...)."""
        return (self.residuals(alpha) ** 2).sum(axis=-1)

    def best_alpha(self) -> np.ndarray:
        """Find the global minimum (...) of the cost.

        Points that slip are predicted linearly in tan α, points that hold by a constant: between
        two neighbouring slopes the sum of squares is a parabola of tan α.
        """
        bounds = np.append(0.0, np.sort(np.abs(self.beta)))  # of the segments, rad
        tangents = np.where(bounds < np.pi / 2, np.tan(bounds), np.inf)
        best, mu = _lowest(self._parabolas(), tangents[:-1], tangents[1:])
        # At a bound α is that slope itself: whether its point slips is then no matter of rounding.
        alpha = np.where(mu >= tangents[best + 1], bounds[best + 1], np.arctan(mu))
        return np.where(mu <= tangents[best], bounds[best], alpha)

    def _parabolas(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the sum of squares of each segment as squares − 2 cross·tan α + curvature·tan²α,
        (..., n) each.

        In the segment below a slope, its point and those of all steeper ones slip; the others hold.
        """
        order = np.argsort(np.abs(self.beta))
        scale = self.scale[order]
        data = self.data.reshape(*self.data.shape[:-1], 2, len(order))[..., order]
        start, rate = _slipping_moments(self.beta[order], scale)
        residual = data - start
        held = np.stack([np.zeros_like(scale), scale])
        held_squares = ((data - held) ** 2).sum(axis=-2)
        held_before = np.cumsum(held_squares, axis=-1) - held_squares
        squares = _sum_from_here((residual**2).sum(axis=-2)) + held_before
        cross = _sum_from_here((residual * rate).sum(axis=-2))
        curvature = _sum_from_here((rate**2).sum(axis=-2))
        return squares, cross, curvature


def _slipping_moments(beta: np.ndarray, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return m_y and m_z (2, n) of points that slip, by (13) and (14): at tan α = 0, and their rates with tan α."""
    sine = np.sin(beta)
    cosine = np.cos(beta)
    sliding = scale * cosine
    start = sliding * np.stack([sine, cosine])
    rate = sliding * np.stack([-np.sign(beta) * cosine, np.abs(sine)])
    return start, rate


def _lowest(
    parabolas: tuple[np.ndarray, np.ndarray, np.ndarray], low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Find the segment (...), and μ (...) in it, of the least sum of squares.

    parabolas: of `_Observed`. low, high (n,): bounds of the segments.
    """
    squares, cross, curvature = parabolas
    at_low = low + np.zeros(cross.shape)
    vertex = np.divide(cross, curvature, out=at_low, where=curvature > 0)
    mu = np.clip(vertex, low, high)
    cost = squares - 2 * mu * cross + mu**2 * curvature
    best = np.argmin(cost, axis=-1)
    return best, np.take_along_axis(mu, best[..., None], axis=-1)[..., 0]


def _sum_from_here(values: np.ndarray) -> np.ndarray:
    """Return the sum of each of the values (..., n) and all after it."""
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
    """Return the sums of values (..., 2n) over the points of each recording (n,)."""
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
