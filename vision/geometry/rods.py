"""The two rods in front of the cameras: the whisker, and the bar or other object that it touches."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.polynomial import polynomial

from vision.geometry.checks import require, require_length, require_sigma
from vision.geometry.touched import OneDiameter, Touched

SHAPES = ("cylinder", "cone", "tapered")
# Polynomials in arc length over the wire's length, in y and z, mm: lowest power first.
RestShape = tuple[tuple[float, ...], tuple[float, ...]]
# [1] Radius of a tapering rod over that at its base: a fit's wild step past the tip stays finite.
# Stated.
LEAST_WIDTH = 1e-3
# [1] Gauss–Legendre's places on −1…1 and weights, of the bend of a wire of measured diameters: within 1e-9 of it up to where
# 0.1 of the diameter is left. Study: tests/vision/geometry/test_profiled_wire.py.
_GAUSS = np.polynomial.legendre.leggauss(32)


@dataclass(frozen=True)
class Wire:
    """The whisker: a cylinder, a cone with its point at its length, or one cut off there (tapered).

    rest_mm: as it is without load, as far as it is stated; a fit's own rest shape adds to that.
    taper_error_per_mm: by how much more of the base's diameter is lost for each mm than is stated, one number
    or an array that broadcasts with the arc lengths asked for. Refused where a length is not > 0, and
    where a tapered wire has no tip thinner than its base or another one has.
    """

    shape: str
    length_mm: float
    diameter_mm: float
    length_sigma_mm: float = 0.0
    diameter_sigma_mm: float = 0.0
    tip_diameter_mm: float | None = None
    rest_mm: RestShape = ((0.0,), (0.0,))
    taper_error_per_mm: np.ndarray | float = 0.0

    def __post_init__(self):
        """Raise Refused where there is no such wire."""
        require(
            self.shape in SHAPES, f"wire shape {self.shape!r}: must be one of {', '.join(SHAPES)}"
        )
        require_length("wire", length_mm=self.length_mm, diameter_mm=self.diameter_mm)
        require(
            self._tip_fits(),
            f"wire tip_diameter_mm {self.tip_diameter_mm}: a tapered wire, and no other, "
            "has one between 0 and its diameter",
        )
        require_sigma(
            "wire", length_sigma_mm=self.length_sigma_mm, diameter_sigma_mm=self.diameter_sigma_mm
        )

    def _tip_fits(self) -> bool:
        """Return whether a tapered wire has a tip thinner than its base, and another has none."""
        tip_mm = self.tip_diameter_mm
        if self.shape != "tapered":
            return tip_mm is None
        return tip_mm is not None and 0 < tip_mm < self.diameter_mm

    def radius_mm(self, arc_mm: np.ndarray | float) -> np.ndarray:
        """Return the radius (...), mm, at arc lengths (...) from the base, 0 beyond a point."""
        arc_mm = np.asarray(arc_mm, dtype=float)
        return 0.5 * self.diameter_mm * np.clip(self._share_left(arc_mm), 0.0, None)

    def radius_by_arc(self, arc_mm: np.ndarray | float) -> np.ndarray | float:
        """Return the change of the radius per arc length at arc lengths (...), below 0 where it tapers."""
        return -0.5 * self.diameter_mm * (self.taper_per_mm + self.taper_error_per_mm)

    def width(self, arc_mm: np.ndarray) -> np.ndarray:
        """Return the diameter (...) at arc lengths (...) over the base's, `LEAST_WIDTH` beyond a point."""
        return np.maximum(self._share_left(arc_mm), LEAST_WIDTH)

    def turn(self, arc_mm: np.ndarray, contact_mm: np.ndarray) -> np.ndarray:
        """Return the tangent angle (...), mm², per point force and base stiffness, by small bends.

        It is the integral of (contact - t) over the fourth power of the width from 0 to arc_mm (...),
        none of which is beyond contact_mm (...). In this form nothing cancels, whatever the taper;
        without any it is s (contact - s/2).
        """
        w = self.width(arc_mm)
        lever_mm = contact_mm * (1.0 + w + w * w) / 3.0 - arc_mm * (w + 2.0) / 6.0
        return arc_mm / w**3 * lever_mm

    @property
    def is_uniform(self) -> bool:
        """Return whether the diameter is the same all along."""
        return self.taper_per_mm == 0.0

    def _share_left(self, arc_mm: np.ndarray) -> np.ndarray:
        """Return the diameter (...) at arc lengths (...) over the base's, below 0 beyond a point."""
        return 1.0 - (self.taper_per_mm + self.taper_error_per_mm) * arc_mm

    @property
    def taper_per_mm(self) -> float:
        """Return the share of the base's diameter that is lost for each mm of arc.

        It is one over the length at which the wire would come to a point.
        """
        if self.shape == "tapered":
            return (1.0 - self.tip_diameter_mm / self.diameter_mm) / self.length_mm
        return 1.0 / self.length_mm if self.shape == "cone" else 0.0

    @property
    def taper_sigma_per_mm(self) -> float:
        """Return one sigma of the share of the base's diameter that is lost for each mm, by length and diameters.

        The point of a cone is one, and a cylinder is drawn, as thick at both ends.
        """
        if self.shape == "cylinder":
            return 0.0
        left = (self.tip_diameter_mm or 0.0) / self.diameter_mm
        by_length = (1.0 - left) * self.length_sigma_mm / self.length_mm
        by_diameter = self.diameter_sigma_mm / self.diameter_mm if left else 0.0
        return math.hypot(by_length, by_diameter, left * by_diameter) / self.length_mm


@dataclass(frozen=True)
class ProfiledWire(Wire):
    """A whisker of measured diameters.

    widths: polynomial in the share of the length of the diameter over the base's, lowest power first.
    shape, tip_diameter_mm: of the taper that it has from end to end.
    """

    widths: tuple[float, ...] = (1.0,)

    def turn(self, arc_mm: np.ndarray, contact_mm: np.ndarray) -> np.ndarray:
        """Return the tangent angle (...), mm², per point force and base stiffness, by small bends."""
        at, weights = _GAUSS
        arc_mm, contact_mm = np.broadcast_arrays(arc_mm, contact_mm)
        at_mm = arc_mm[..., None] * (0.5 * (1.0 + at))
        curvature = (contact_mm[..., None] - at_mm) / self.width(at_mm) ** 4
        return 0.5 * arc_mm * (curvature @ weights)

    def radius_by_arc(self, arc_mm: np.ndarray | float) -> np.ndarray | float:
        """Return the change of the radius per arc length at arc lengths (...)."""
        share = np.asarray(arc_mm) / self.length_mm
        per_share = polynomial.polyval(share, polynomial.polyder(self.widths))
        return 0.5 * self.diameter_mm * (per_share / self.length_mm - self.taper_error_per_mm)

    @property
    def is_uniform(self) -> bool:
        """Return whether the diameter is the same all along."""
        return not any(self.widths[1:])

    def _share_left(self, arc_mm: np.ndarray) -> np.ndarray:
        """Return the diameter (...) at arc lengths (...) over the base's."""
        stated = polynomial.polyval(np.asarray(arc_mm) / self.length_mm, self.widths)
        return stated - self.taper_error_per_mm * arc_mm


@dataclass(frozen=True)
class Bar(OneDiameter):
    """A straight round bar. Refused where its diameter is no length."""

    name: ClassVar[str] = "bar"
    may_move: ClassVar[bool] = True
    along_sigma_mm: ClassVar[tuple[float, ...]] = ()
    outline_sigma_px: ClassVar[tuple[float, ...]] = ()

    @property
    def label(self) -> str:
        """Return the bar with its diameter, for a message."""
        return f"bar of diameter {self.diameter_mm:g} mm"


@dataclass(frozen=True)
class Rods:
    """The whisker and the object that it touches, and how far apart their axes are then."""

    wire: Wire
    bar: Touched

    def reach_mm(self, arc_mm: np.ndarray | float) -> np.ndarray:
        """Return the distance (...) of the two axes where they touch at arc lengths (...)."""
        return self.bar.radius_mm + self.wire.radius_mm(arc_mm)

    @property
    def reach_sigma_mm(self) -> float:
        """Return one sigma of the reach, by both diameters.

        Of a wire that tapers it is that at its base, where it is largest.
        """
        return 0.5 * float(np.hypot(self.bar.diameter_sigma_mm, self.wire.diameter_sigma_mm))
