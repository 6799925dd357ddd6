"""The whisker as a beam: section, flexural rigidity, and C = 3EI.

Lengths in mm, rigidity in N·mm².
"""

from dataclasses import dataclass
from math import inf, nan
from typing import Self

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import ArrayLike

from estimator.domain import Numbers, elementwise, require_positive

# [N·mm² per GPa·mm⁴] Unit of a rigidity from a modulus in GPa and a section in mm. Derived.
NMM2_PER_GPA_MM4 = 1000.0
SHAPES = ("cylinder", "cone", "tapered")


def second_moment_of_area(diameter_mm: ArrayLike) -> Numbers:
    """Return the second moment of area of a round section, I = pi d^4 / 64, in mm^4.

    >>> round(second_moment_of_area(1.0), 7)
    0.0490874
    """
    return np.pi * diameter_mm**4 / 64


def flexural_rigidity(youngs_modulus_GPa: ArrayLike, diameter_mm: ArrayLike) -> Numbers:
    """Return the flexural rigidity EI of a round section, in N·mm².

    >>> round(flexural_rigidity(60.0, 1.0), 1)
    2945.2
    """
    return NMM2_PER_GPA_MM4 * youngs_modulus_GPa * second_moment_of_area(diameter_mm)


def moment_in_EI_per_metre(moment_Nmm: ArrayLike, rigidity_Nmm2: ArrayLike) -> Numbers:
    """Convert a moment to the paper's unit EI/metre: the curvature at the base in 1/m (Fig. 8).

    >>> moment_in_EI_per_metre(2.0, 4000.0)
    0.5
    """
    return 1000.0 * moment_Nmm / rigidity_Nmm2


def taper_of(shape: str, tip_share: float | None = None) -> float:
    """Return the share of the base's diameter that is lost: 0 of a cylinder, 1 of a cone.

    tip_share: the tip's diameter over the base's, given for "tapered" alone. Raises ValueError for
    another shape, and where a tip_share is missing, superfluous, or outside (0, 1).
    """
    if shape not in SHAPES:
        raise ValueError(f"shape = {shape!r}: must be one of {', '.join(SHAPES)}")
    if (shape == "tapered") != (tip_share is not None):
        raise ValueError(f"a tapered whisker, and no other, has a tip diameter: shape is {shape!r}")
    if shape == "tapered":
        if not 0 < tip_share < 1:
            raise ValueError(
                f"tip diameter over base diameter = {tip_share}: must lie between 0 and 1"
            )
        return 1.0 - tip_share
    return float(shape == "cone")


@dataclass(frozen=True)
class Beam:
    """A whisker, clamped at its base: cylinder, cone, or a cone cut off ("tapered").

    C_Nmm2 is 3EI at the base (the C of equation (1)); tip_share, of "tapered" alone, is the tip's
    diameter over the base's. rest_mm: the unloaded whisker, polynomials in the share of the length of
    y and z, lowest power first; all equations but the exact rod's take it as straight. rest_sigma_mm: how far
    its tip may lie from there in each. taper_sigma_per_mm: one sigma of τ/L below, by length and diameters of
    the ends. length_sigma_mm: of the length, where a contact may be at the tip.
    Raises ValueError for anything but a positive C and length, and as `taper_of` does.

    All of them have one compliance: θ/m = d/C with 1/d = 1/d_x − τ/L, τ being the share of the
    diameter that is lost up to the tip, since ∫(d_x − s)²/(1 − τs/L)⁴ ds = d_x²·d/3. So every
    equation for a cylinder holds for the base's cylinder touched at d (`as_cylinder_mm`), and
    `distance_mm` is the inverse.
    """

    C_Nmm2: float
    length_mm: float
    shape: str = "cylinder"
    tip_share: float | None = None
    rest_mm: tuple[tuple[float, ...], tuple[float, ...]] = ((0.0,), (0.0,))
    rest_sigma_mm: float = 0.0
    taper_sigma_per_mm: float = 0.0
    length_sigma_mm: float = 0.0

    def __post_init__(self):
        """Raise ValueError unless C and length are positive and the shape is a known one."""
        require_positive("C_Nmm2", self.C_Nmm2, "N·mm²")
        require_positive("length_mm", self.length_mm, "mm")
        taper_of(self.shape, self.tip_share)
        object.__setattr__(self, "rest_mm", tuple(tuple(own) for own in self.rest_mm))

    def width(self, share: ArrayLike) -> Numbers:
        """Return the diameter over the base's at a share of the length."""
        return 1.0 - self.taper * share

    def width_by_share(self, share: ArrayLike) -> Numbers:
        """Return the derivative of the width by the share of the length."""
        return -self.taper + 0.0 * np.asarray(share)

    def share_by_taper(self, d_x_mm: ArrayLike) -> Numbers:
        """Return the relative sigma of d_x by that of the taper: 1/d_x is off by as much as τ/L."""
        return self.taper_sigma_per_mm * d_x_mm

    def other_rests_mm(self) -> tuple[tuple[tuple[float, ...], tuple[float, ...]], ...]:
        """Return the unloaded shapes that are one sigma of the tip's place off: in y, and in z.

        None of them where the shape is exact. The rest of the whisker is off as the square of the length.
        """
        if self.rest_sigma_mm == 0:
            return ()
        off = (0.0, 0.0, self.rest_sigma_mm)
        y, z = self.rest_mm
        return (_sum(y, off), z), (y, _sum(z, off))

    @property
    def is_curved(self) -> bool:
        """Return whether the unloaded whisker is curved, or stands off its axis."""
        return any(any(own) for own in self.rest_mm)

    @classmethod
    def from_modulus(
        cls, youngs_modulus_GPa: float, diameter_mm: float, length_mm: float, *shape: str | float
    ) -> Self:
        """Make the beam of a round wire from Young's modulus and the diameter at the base."""
        require_positive("youngs_modulus_GPa", youngs_modulus_GPa, "GPa")
        require_positive("diameter_mm", diameter_mm, "mm")
        rigidity_Nmm2 = flexural_rigidity(youngs_modulus_GPa, diameter_mm)
        return cls.from_rigidity(rigidity_Nmm2, length_mm, *shape)

    @classmethod
    def from_rigidity(cls, rigidity_Nmm2: float, length_mm: float, *shape: str | float) -> Self:
        """Make a beam from its flexural rigidity EI at the base."""
        return cls(3 * rigidity_Nmm2, length_mm, *shape)

    @property
    def rigidity_Nmm2(self) -> float:
        """Return EI at the base."""
        return self.C_Nmm2 / 3

    @property
    def taper(self) -> float:
        """Return the share of the base's diameter that is lost up to the tip."""
        return taper_of(self.shape, self.tip_share)

    def as_cylinder_mm(self, d_x_mm: ArrayLike) -> Numbers:
        """Return the distance at which the base's cylinder is as stiff as this whisker at d_x.

        It is infinite at a cone's apex, and NaN unless d_x is positive.
        """
        return _inverse_sum(d_x_mm, -self.taper / self.length_mm)

    def thickness(self, d_x_mm: ArrayLike) -> Numbers:
        """Return the diameter at d_x over the base's; a relative error of the base's cylinder's distance is as
        much smaller of d_x.
        """
        return d_x_mm / self.as_cylinder_mm(d_x_mm)

    def moment_Nmm(self, theta_rad: ArrayLike, d_x_mm: ArrayLike) -> Numbers:
        """Return m_z of (2): the moment of a push by θ against a contact at d_x, without slip."""
        return self.C_Nmm2 * theta_rad / self.as_cylinder_mm(d_x_mm)

    def distance_mm(self, as_cylinder_mm: ArrayLike) -> Numbers:
        """Return d_x from the distance of the base's cylinder; NaN unless that is positive."""
        return _inverse_sum(as_cylinder_mm, self.taper / self.length_mm)

    def error_share(self, d_x_mm: ArrayLike, of_cylinder: ArrayLike) -> Numbers:
        """Return the relative error of d_x from that of the distance as the base's cylinder.

        −1, that is no distance at all, where the cylinder's is off by −1 or less.
        """
        of_cylinder = np.asarray(of_cylinder)
        wrong = self.distance_mm(self.as_cylinder_mm(d_x_mm) * (1.0 + of_cylinder))
        return np.where(of_cylinder > -1, wrong / d_x_mm, 0.0)[()] - 1.0


def _sum(one: tuple[float, ...], other: tuple[float, ...]) -> tuple[float, ...]:
    """Return the sum of two polynomials."""
    return tuple(polynomial.polyadd(one, other).tolist())


def _inverse_sum(d, per_mm):
    """Return 1 / (1/d + per_mm) for d > 0: inf where the sum is ≤ 0, NaN unless d > 0."""
    if not isinstance(d, float):
        return _inverse_sums(d, per_mm)
    # A single number goes without arrays: a whisk's estimates need it a thousand times.
    d = float(d)
    if not d > 0:
        return nan
    below = 1 + d * per_mm
    return d / below if below > 0 else inf


@elementwise
def _inverse_sums(d, per_mm):
    """Evaluate `_inverse_sum` for arrays."""
    below = 1 + d * per_mm
    inverse = np.where(below > 0, d / np.maximum(below, 0.0), np.inf)
    return np.where(d > 0, inverse, np.nan)
