"""The whisker as a rod: round section, uniform or tapering to a point, with a rest shape of its own."""

import math
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Rest:
    """How the unloaded whisker lies off the straight line, in the hub frame, turning with the hub.

    `sag_mm`: tip's drop (towards -z) of a cantilever under its own weight; `set_y_mm`, `set_z_mm`: tip's departure of
    a wire that keeps a constant curvature from its spool. All small against the length: slopes are taken to first
    order.
    """

    length_mm: float
    sag_mm: float = 0.0
    set_y_mm: float = 0.0
    set_z_mm: float = 0.0

    def offset_mm(self, arc_mm: float | np.ndarray):
        """Departure from the straight line at arc length: (..., 3), its x component zero."""
        u = np.asarray(arc_mm, float) / self.length_mm
        weight = (u**4 - 4 * u**3 + 6 * u**2) / 3
        return np.stack([0 * u, self.set_y_mm * u**2, self.set_z_mm * u**2 - self.sag_mm * weight], -1)

    def slope(self, arc_mm: float | np.ndarray):
        """Derivative of the departure along the arc: (..., 3)."""
        u = np.asarray(arc_mm, float) / self.length_mm
        weight = 4 * (u**3 - 3 * u**2 + 3 * u) / 3
        slope = np.stack([0 * u, 2 * self.set_y_mm * u, 2 * self.set_z_mm * u - self.sag_mm * weight], -1)
        return slope / self.length_mm

    def curvature(self, arc_mm: float) -> np.ndarray:
        """Second derivative of the departure at one arc length: (3,), 1/mm."""
        u = arc_mm / self.length_mm
        weight = 4 * (u**2 - 2 * u + 1)
        return np.array([0.0, 2 * self.set_y_mm, 2 * self.set_z_mm - self.sag_mm * weight]) / self.length_mm**2


@dataclass(frozen=True)
class Rod:
    """A whisker of one material. `shape` is "cylinder", or "cone": base diameter to a point at `length_mm`.

    Raises ValueError for another shape or a size that is not positive.
    """

    shape: str
    length_mm: float
    diameter_mm: float
    youngs_modulus_GPa: float
    density_kg_m3: float = 6450.0  # Nitinol
    rest: Rest | None = field(default=None)

    def __post_init__(self):
        if self.shape not in ("cylinder", "cone"):
            raise ValueError(f"a whisker's shape is 'cylinder' or 'cone', not {self.shape!r}")
        for name in ("length_mm", "diameter_mm", "youngs_modulus_GPa", "density_kg_m3"):
            if not getattr(self, name) > 0:
                raise ValueError(f"a whisker's {name} is positive, not {getattr(self, name)}")
        if self.rest is None:
            object.__setattr__(self, "rest", Rest(self.length_mm))

    @property
    def rigidity_Nmm2(self) -> float:
        """Flexural rigidity EI at the base; 1 GPa = 1000 N/mm²."""
        return 1000 * self.youngs_modulus_GPa * math.pi * self.diameter_mm**4 / 64

    @property
    def mass_kg_m(self) -> float:
        """Mass per length at the base."""
        return self.density_kg_m3 * math.pi * (self.diameter_mm * 1e-3) ** 2 / 4

    def width(self, arc_mm: float | np.ndarray):
        """Diameter relative to the base's at arc length."""
        arc = np.asarray(arc_mm, float)
        return np.ones_like(arc) if self.shape == "cylinder" else np.maximum(1 - arc / self.length_mm, 0.0)

    def radius_mm(self, arc_mm: float | np.ndarray):
        """Radius at arc length."""
        return 0.5 * self.diameter_mm * self.width(arc_mm)

    @property
    def taper(self) -> float:
        """Change of the radius per arc length: zero, or negative for a cone."""
        return 0.0 if self.shape == "cylinder" else -0.5 * self.diameter_mm / self.length_mm
