"""The whisker as a rod: round section, uniform or tapering, with a rest shape of its own."""

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

    def offset_mm(self, arc_mm: float | np.ndarray) -> np.ndarray:
        """Departure from the straight line at arc length: (..., 3), its x component zero."""
        u = np.asarray(arc_mm, float) / self.length_mm
        weight = (u**4 - 4 * u**3 + 6 * u**2) / 3
        return np.stack(
            [0 * u, self.set_y_mm * u**2, self.set_z_mm * u**2 - self.sag_mm * weight], -1
        )

    def slope(self, arc_mm: float | np.ndarray) -> np.ndarray:
        """Derivative of the departure along the arc: (..., 3)."""
        u = np.asarray(arc_mm, float) / self.length_mm
        weight = 4 * (u**3 - 3 * u**2 + 3 * u) / 3
        slope = np.stack(
            [0 * u, 2 * self.set_y_mm * u, 2 * self.set_z_mm * u - self.sag_mm * weight], -1
        )
        return slope / self.length_mm

    def curvature(self, arc_mm: float) -> np.ndarray:
        """Second derivative of the departure at one arc length: (3,), 1/mm."""
        u = arc_mm / self.length_mm
        weight = 4 * (u**2 - 2 * u + 1)
        return (
            np.array([0.0, 2 * self.set_y_mm, 2 * self.set_z_mm - self.sag_mm * weight])
            / self.length_mm**2
        )


@dataclass(frozen=True)
class Rod:
    """A whisker of one material. `shape` is "cylinder", "cone": base diameter to a point at `length_mm`, or "tapered":
    to `tip_diameter_mm` there.

    Raises ValueError for another shape, a size that is not positive, or a tip that is not thinner than the base.
    """

    shape: str
    length_mm: float
    diameter_mm: float
    youngs_modulus_GPa: float
    density_kg_m3: float = 6450.0  # Nitinol
    rest: Rest | None = field(default=None)
    tip_diameter_mm: float | None = None

    def __post_init__(self):
        if self.shape not in ("cylinder", "cone", "tapered"):
            raise ValueError(
                f"a whisker's shape is 'cylinder', 'cone' or 'tapered', not {self.shape!r}"
            )
        if (self.shape == "tapered") != (self.tip_diameter_mm is not None):
            raise ValueError(
                f"a tapered whisker, and no other, has a tip_diameter_mm; the shape is {self.shape!r}"
            )
        if self.tip_diameter_mm is not None and not 0 < self.tip_diameter_mm < self.diameter_mm:
            raise ValueError(
                f"a whisker's tip_diameter_mm is between 0 and its diameter, not {self.tip_diameter_mm}"
            )
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

    @property
    def lost(self) -> float:
        """Share of the base's diameter that is lost up to the tip: 0 of a cylinder, 1 of a cone."""
        if self.tip_diameter_mm is not None:
            return 1 - self.tip_diameter_mm / self.diameter_mm
        return 1.0 if self.shape == "cone" else 0.0

    def width(self, arc_mm: float | np.ndarray) -> np.ndarray:
        """Diameter relative to the base's at arc length."""
        return np.maximum(1 - self.lost * np.asarray(arc_mm, float) / self.length_mm, 0.0)

    def radius_mm(self, arc_mm: float | np.ndarray) -> np.ndarray:
        """Radius at arc length."""
        return 0.5 * self.diameter_mm * self.width(arc_mm)

    @property
    def taper(self) -> float:
        """Change of the radius per arc length: zero, or negative where the whisker tapers."""
        return -0.5 * self.lost * self.diameter_mm / self.length_mm
