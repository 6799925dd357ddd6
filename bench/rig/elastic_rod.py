"""The whisker as a rod: round section, uniform or tapering, with a rest shape of its own."""

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class RestShape:
    """How the unloaded whisker departs from the straight line, in the hub frame, turning with it.

    sag_mm: the tip's drop (towards −z) of a cantilever under its own weight. set_y_mm, set_z_mm:
    the tip's departure of a wire that keeps a constant curvature from its spool. All are small
    against the length: slopes are taken to first order.
    """

    length_mm: float
    sag_mm: float = 0.0
    set_y_mm: float = 0.0
    set_z_mm: float = 0.0

    def offset_mm(self, arc_mm: float | np.ndarray) -> np.ndarray:
        """Return the departure (..., 3) from the straight line at arc length; its x is zero."""
        u = np.asarray(arc_mm, float) / self.length_mm
        sag = (u**4 - 4 * u**3 + 6 * u**2) / 3
        return self._lateral(u**2, sag)

    def slope(self, arc_mm: float | np.ndarray) -> np.ndarray:
        """Return the derivative (..., 3) of the departure along the arc."""
        u = np.asarray(arc_mm, float) / self.length_mm
        sag = 4 * (u**3 - 3 * u**2 + 3 * u) / 3
        return self._lateral(2 * u, sag) / self.length_mm

    def curvature(self, arc_mm: float | np.ndarray) -> np.ndarray:
        """Return the second derivative (..., 3) of the departure along the arc, 1/mm."""
        u = np.asarray(arc_mm, float) / self.length_mm
        sag = 4 * (u**2 - 2 * u + 1)
        return self._lateral(2 + 0 * u, sag) / self.length_mm**2

    def _lateral(self, spool, sag):
        """Return the vectors (..., 3) of weights (...) of the spool's set and of the sag."""
        set_z = self.set_z_mm * spool
        return np.stack([0 * spool, self.set_y_mm * spool, set_z - self.sag_mm * sag], -1)


@dataclass(frozen=True)
class Rod:
    """A whisker of one material.

    shape: "cylinder", "cone" (from the base's diameter to a point at `length_mm`), or "tapered"
    (to `tip_diameter_mm` there). rest: straight where it is None.
    Raises ValueError for another shape, a size that is not positive, or a tip that is not thinner
    than the base.
    """

    shape: str
    length_mm: float
    diameter_mm: float
    youngs_modulus_GPa: float
    density_kg_m3: float = 6450.0  # Nitinol
    rest: RestShape | None = None
    tip_diameter_mm: float | None = None

    def __post_init__(self):
        if self.shape not in ("cylinder", "cone", "tapered"):
            raise ValueError(
                f"a whisker's shape is 'cylinder', 'cone' or 'tapered', not {self.shape!r}"
            )
        if (self.shape == "tapered") != (self.tip_diameter_mm is not None):
            raise ValueError(
                "a tapered whisker, and no other, has a tip_diameter_mm; "
                f"the shape is {self.shape!r}"
            )
        if self.tip_diameter_mm is not None and not 0 < self.tip_diameter_mm < self.diameter_mm:
            raise ValueError(
                "a whisker's tip_diameter_mm is between 0 and its diameter, "
                f"not {self.tip_diameter_mm}"
            )
        for name in ("length_mm", "diameter_mm", "youngs_modulus_GPa", "density_kg_m3"):
            if not getattr(self, name) > 0:
                raise ValueError(f"a whisker's {name} is positive, not {getattr(self, name)}")
        if self.rest is None:
            object.__setattr__(self, "rest", RestShape(self.length_mm))

    @property
    def rigidity_Nmm2(self) -> float:
        """Return the flexural rigidity EI at the base; 1 GPa = 1000 N/mm²."""
        return 1000 * self.youngs_modulus_GPa * math.pi * self.diameter_mm**4 / 64

    @property
    def mass_kg_m(self) -> float:
        """Return the mass per length at the base."""
        return self.density_kg_m3 * math.pi * (self.diameter_mm * 1e-3) ** 2 / 4

    @property
    def diameter_loss(self) -> float:
        """Return the share of the base's diameter that is lost up to the tip: 0 of a cylinder, 1
        of a cone."""
        if self.tip_diameter_mm is not None:
            return 1 - self.tip_diameter_mm / self.diameter_mm
        return 1.0 if self.shape == "cone" else 0.0

    def width(self, arc_mm: float | np.ndarray) -> np.ndarray:
        """Return the diameter at arc length over the base's."""
        share = np.asarray(arc_mm, float) / self.length_mm
        return np.maximum(1 - self.diameter_loss * share, 0.0)

    def radius_mm(self, arc_mm: float | np.ndarray) -> np.ndarray:
        """Return the radius at arc length."""
        return 0.5 * self.diameter_mm * self.width(arc_mm)

    @property
    def taper(self) -> float:
        """Return the change of the radius per arc length, not positive."""
        return -0.5 * self.diameter_loss * self.diameter_mm / self.length_mm
