"""A whisker of measured diameters as a beam, whose compliance is integrated as it is."""

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import ArrayLike

from estimator.beam import Beam
from estimator.domain import Numbers

if TYPE_CHECKING:  # it takes longer than reading a session
    from scipy.interpolate import CubicHermiteSpline

# [1] Gauss–Legendre on −1…1, of a compliance: within 1e-9 of it up to where 0.1 of the diameter is left.
# Study: tests/estimator/test_profiled_beam.py.
_AT, _WEIGHTS = np.polynomial.legendre.leggauss(48)
# [1] Shares of the length at which a compliance is tabled, between which its cubic has its slope:
# within 1e-8 of the distance. Study: tests/estimator/test_profiled_beam.py.
_SHARES = np.linspace(0.0, 1.0, 401)[1:]
# [1] Part of the length in which the closest taper is asked for: where whiskers touch. Stated.
_TOUCHED = (0.2, 0.9)
# [1] Least diameter over the base's: thinner is a point, to which nothing is held. Stated.
_LEAST_WIDTH = 0.01
# [1] Least and largest tip of the closest taper. Stated.
_TIPS = (0.01, 0.999)


@dataclass(frozen=True)
class ProfiledBeam(Beam):
    """A whisker of measured diameters, clamped at its base.

    widths: the diameter over the base's, a polynomial in the share of the length, lowest power first.
    shape and tip_share are those of the taper whose compliance is closest, which only the equations of
    objects that give way or move, and of a shape that is seen, take for it. The others take d of
    θ/m = d/C, 3 ∫(d_x − s)²/w⁴ ds / d_x², as it is.
    """

    widths: tuple[float, ...] = (1.0,)

    @classmethod
    def of_widths(
        cls,
        C_Nmm2: float,
        length_mm: float,
        widths: tuple[float, ...],
        rest_mm: tuple[tuple[float, ...], tuple[float, ...]] = ((0.0,), (0.0,)),
        rest_sigma_mm: float = 0.0,
        taper_sigma_per_mm: float = 0.0,
        length_sigma_mm: float = 0.0,
    ) -> Self:
        """Make the beam, with the closest taper."""
        distances = _as_cylinder(widths)[0]
        touched = (_TOUCHED[0] <= _SHARES) & (_TOUCHED[1] >= _SHARES)
        loss = np.mean((1.0 / _SHARES - 1.0 / distances)[touched])
        tip_share = float(np.clip(1.0 - loss, *_TIPS))
        return cls(
            C_Nmm2,
            length_mm,
            "tapered",
            tip_share,
            rest_mm,
            rest_sigma_mm,
            taper_sigma_per_mm,
            length_sigma_mm,
            widths,
        )

    def width(self, share: ArrayLike) -> Numbers:
        """Return the diameter over the base's at a share of the length."""
        return np.maximum(polynomial.polyval(np.asarray(share), self.widths), _LEAST_WIDTH)

    def width_by_share(self, share: ArrayLike) -> Numbers:
        """Return the derivative of the width by the share of the length."""
        return polynomial.polyval(np.asarray(share), polynomial.polyder(self.widths))

    def as_cylinder_mm(self, d_x_mm: ArrayLike) -> Numbers:
        """Return the distance at which the base's cylinder is as stiff as this whisker at d_x.

        It is infinite beyond the tip, and NaN unless d_x is positive.
        """
        share = np.asarray(d_x_mm, float) / self.length_mm
        inside = _spline(self.widths, False)(np.clip(share, 0.0, 1.0)) * self.length_mm
        found = np.where(share <= 1.0, inside, np.inf)
        return np.where(share > 0, found, np.nan)[()]

    def distance_mm(self, as_cylinder_mm: ArrayLike) -> Numbers:
        """Return d_x from the distance of the base's cylinder; NaN unless that is positive.

        Beyond the tip it goes on as that of a taper.
        """
        share = np.asarray(as_cylinder_mm, float) / self.length_mm
        inverse = _spline(self.widths, True)
        end = inverse.x[-1]
        inside = inverse(np.clip(share, 0.0, end))
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse_beyond = 1.0 - 1.0 / end + 1.0 / share
            beyond = np.where(inverse_beyond > 0, 1.0 / inverse_beyond, np.inf)
        found = np.where(share <= end, inside, beyond) * self.length_mm
        return np.where(share > 0, found, np.nan)[()]

    def thickness(self, d_x_mm: ArrayLike) -> Numbers:
        """Return the relative error of d_x over that of the base's cylinder's distance.

        Of a taper that is the diameter at d_x over the base's.
        """
        share = np.asarray(d_x_mm, float) / self.length_mm
        tabled = np.clip(share, 1e-9, 1.0)  # 0/0 at the base
        spline = _spline(self.widths, False)
        return (spline(tabled) / (tabled * spline(tabled, 1)))[()]


@lru_cache(maxsize=16)
def _as_cylinder(widths: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return the base's cylinder's distances (n,) at `_SHARES`, and their derivatives by these.

    A rod of width w(s) that is touched at x is as stiff as the base's cylinder that is touched at
    d = 3/x² ∫₀ˣ (x − s)² / w⁴ ds; integrals are Gauss–Legendre's.
    """
    half = 0.5 * _SHARES
    at = _SHARES[:, None] * 0.5 * (1.0 + _AT)  # (n, nodes): s, from 0 to x
    lever = _SHARES[:, None] - at
    width = np.maximum(polynomial.polyval(at, widths), _LEAST_WIDTH)
    softness = width**-4.0
    by_lever = half * ((lever * softness) @ _WEIGHTS)
    distance = 3.0 * half * ((lever**2 * softness) @ _WEIGHTS) / _SHARES**2
    slope = 6.0 * by_lever / _SHARES**2 - 2.0 * distance / _SHARES
    return distance, slope


@lru_cache(maxsize=32)
def _spline(widths: tuple[float, ...], inverse: bool) -> "CubicHermiteSpline":
    """Return the base's cylinder's distance over the length by the share of the length, or the inverse."""
    from scipy.interpolate import CubicHermiteSpline

    distance, slope = _as_cylinder(widths)
    at = np.append(0.0, _SHARES)
    values = np.append(0.0, distance)
    slopes = np.append(1.0, slope)
    if inverse:
        return CubicHermiteSpline(values, at, 1.0 / slopes)
    return CubicHermiteSpline(at, values, slopes)
