"""The whisker as a beam: section, flexural rigidity, and C = 3EI. Lengths in mm, rigidity in N·mm²."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from estimator.domain import require_positive

NMM2_PER_GPA_MM4 = 1000.0
SHAPES = ("cylinder", "cone")


def second_moment_of_area(diameter_mm: ArrayLike):
    """I = pi d^4 / 64 of a round section, in mm^4.

    >>> round(second_moment_of_area(1.0), 7)
    0.0490874
    """
    return np.pi * diameter_mm**4 / 64


def flexural_rigidity(youngs_modulus_GPa: ArrayLike, diameter_mm: ArrayLike):
    """EI in N·mm² of a round section.

    >>> round(flexural_rigidity(60.0, 1.0), 1)
    2945.2
    """
    return NMM2_PER_GPA_MM4 * youngs_modulus_GPa * second_moment_of_area(diameter_mm)


def diameter_at(arc_mm: ArrayLike, base_diameter_mm: ArrayLike, length_mm: ArrayLike, taper: ArrayLike):
    """Diameter in mm at the arc length `arc_mm` from the base.

    `taper` is the share of the base diameter that is lost up to the tip: 0 for a cylinder, 1 for a cone.
    """
    return base_diameter_mm * (1 - taper * arc_mm / length_mm)


def rigidity_at(arc_mm: ArrayLike, base_rigidity_Nmm2: ArrayLike, length_mm: ArrayLike, taper: ArrayLike):
    """EI in N·mm² at the arc length `arc_mm`; it goes with the fourth power of the diameter."""
    return base_rigidity_Nmm2 * (1 - taper * arc_mm / length_mm) ** 4


def moment_in_EI_per_metre(moment_Nmm: ArrayLike, rigidity_Nmm2: ArrayLike):
    """Moment in the paper's unit EI/metre, i.e. the curvature at the base in 1/m (Fig. 8).

    >>> moment_in_EI_per_metre(2.0, 4000.0)
    0.5
    """
    return 1000.0 * moment_Nmm / rigidity_Nmm2


@dataclass(frozen=True)
class Beam:
    """A straight whisker, clamped at its base.

    C_Nmm2 is 3EI at the base (the C of equation (1)); shape is "cylinder", or "cone" for one that tapers
    to a point at length_mm. Raises ValueError for anything but a positive C and length and one of these
    shapes.
    """

    C_Nmm2: float
    length_mm: float
    shape: str = "cylinder"

    def __post_init__(self):
        require_positive("C_Nmm2", self.C_Nmm2, "N·mm²")
        require_positive("length_mm", self.length_mm, "mm")
        if self.shape not in SHAPES:
            raise ValueError(f"shape = {self.shape!r}: must be one of {', '.join(SHAPES)}")

    @classmethod
    def from_modulus(
        cls, youngs_modulus_GPa: float, diameter_mm: float, length_mm: float, shape: str = "cylinder"
    ) -> Self:
        """Beam of a round wire from Young's modulus and the diameter at the base."""
        require_positive("youngs_modulus_GPa", youngs_modulus_GPa, "GPa")
        require_positive("diameter_mm", diameter_mm, "mm")
        return cls.from_rigidity(flexural_rigidity(youngs_modulus_GPa, diameter_mm), length_mm, shape)

    @classmethod
    def from_rigidity(cls, rigidity_Nmm2: float, length_mm: float, shape: str = "cylinder") -> Self:
        """Beam from its flexural rigidity EI at the base."""
        return cls(3 * rigidity_Nmm2, length_mm, shape)

    @property
    def rigidity_Nmm2(self) -> float:
        """EI at the base."""
        return self.C_Nmm2 / 3
