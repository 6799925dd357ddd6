"""The two rods in front of the cameras: the whisker and the bar that it touches."""

from dataclasses import dataclass

import numpy as np

from vision.geometry.checks import require, require_length, require_sigma
from vision.geometry.rounded import Form

SHAPES = ("cylinder", "cone", "tapered")


@dataclass(frozen=True)
class Wire:
    """The whisker: a cylinder, a cone that ends in a point at its length, or a cone cut off there ("tapered").

    Refused where a length is not > 0, and where a tapered wire has no tip thinner than its base or another one has.
    """

    shape: str
    length_mm: float
    diameter_mm: float
    length_sigma_mm: float = 0.0
    diameter_sigma_mm: float = 0.0
    tip_diameter_mm: float | None = None

    def __post_init__(self):
        require(
            self.shape in SHAPES, f"wire shape {self.shape!r}: must be one of {', '.join(SHAPES)}"
        )
        require_length("wire", length_mm=self.length_mm, diameter_mm=self.diameter_mm)
        tip = self.tip_diameter_mm
        tips = (
            (tip is not None and 0 < tip < self.diameter_mm)
            if self.shape == "tapered"
            else tip is None
        )
        require(
            tips,
            f"wire tip_diameter_mm {tip}: a tapered wire, and no other, has one between 0 and its diameter",
        )
        require_sigma(
            "wire", length_sigma_mm=self.length_sigma_mm, diameter_sigma_mm=self.diameter_sigma_mm
        )

    def radius_mm(self, arc_mm: np.ndarray | float) -> np.ndarray:
        """Radius at arc length `arc_mm` from the base, mm; the shape of `arc_mm`; 0 beyond a cone's point."""
        arc_mm = np.asarray(arc_mm, dtype=float)
        return 0.5 * self.diameter_mm * np.clip(1.0 - self.taper_per_mm * arc_mm, 0.0, None)

    @property
    def taper_per_mm(self) -> float:
        """Share of the base's diameter that is lost for each mm of arc: one over where it would come to a point."""
        if self.shape == "tapered":
            return (1.0 - self.tip_diameter_mm / self.diameter_mm) / self.length_mm
        return 1.0 / self.length_mm if self.shape == "cone" else 0.0


@dataclass(frozen=True)
class Bar:
    """The bar that the whisker pushes against: a round one; or what is told of another object in its place, a sphere
    as thick, a bar as thick bent to a ring, or a cone (without a thickness of its own, 0)."""

    diameter_mm: float
    diameter_sigma_mm: float = 0.0
    form: Form | None = None

    def __post_init__(self):
        if self.form is None or self.form.shape != "cone":
            require_length("bar", diameter_mm=self.diameter_mm)
        if self.form is not None and self.form.shape == "ring":
            wide = self.form.ring_diameter_mm
            require(
                wide > self.diameter_mm,
                f"ring of {wide:g} mm: its bar is {self.diameter_mm:g} mm thick",
            )
        require_sigma("bar", diameter_sigma_mm=self.diameter_sigma_mm)

    @property
    def radius_mm(self) -> float:
        """Half the diameter."""
        return 0.5 * self.diameter_mm


@dataclass(frozen=True)
class Rods:
    """Whisker and bar, and how far apart their axes are while they touch."""

    wire: Wire
    bar: Bar

    def reach_mm(self, arc_mm: np.ndarray | float) -> np.ndarray:
        """Distance between the two axes where they touch at arc length `arc_mm`; the shape of `arc_mm`."""
        return self.bar.radius_mm + self.wire.radius_mm(arc_mm)

    @property
    def reach_sigma_mm(self) -> float:
        """One sigma of the reach, by both diameters; of a wire that tapers at its base, where it is largest."""
        return 0.5 * float(np.hypot(self.bar.diameter_sigma_mm, self.wire.diameter_sigma_mm))
