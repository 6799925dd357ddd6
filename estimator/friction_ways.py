"""Ways 1 and 3 of section VII to do without a known friction angle: tilting the array, and confidence.

Way 2, consistency, needs the objects that a session describes. Angles in rad.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from estimator.domain import Numbers, elementwise, require_friction_angle, require_sigma
from estimator.friction import FrictionFit
from estimator.reasons import NamedReason

# [1] Sigma of a distance by all but friction, as a share of it, in the weight of way 3. Stated.
_OWN_SHARE = 0.01
ONE_SIDED = NamedReason(
    "tilts_one_sided",
    "the slip angle does not leave zero on both sides of the tilts: tilt further",
)


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
