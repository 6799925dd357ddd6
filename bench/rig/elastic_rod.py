"""The whisker as a rod: round section, uniform or tapering, with a rest shape of its own."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import polynomial

# [rounds] For the arc length at a distance, each a tenth as far off as the one before. Derived.
_ROUNDS = 12
# Gauss–Legendre on −1…1: of the forward part along a rest shape. Its slopes are polynomials of third
# degree, so that 24 points leave less than 1e-12 of the arc up to a turn of 60°. Derived.
_GAUSS = np.polynomial.legendre.leggauss(24)


@dataclass(frozen=True)
class RestShape:
    """The unloaded whisker, in the hub frame, turning with it.

    sag_mm: the tip's drop (towards −z) of a cantilever under its own weight. set_y_mm, set_z_mm:
    of a wire that keeps a curvature from its spool, or a whisker that grew so, how far its tip lies
    sideways. All are laid off over arc length, and what is left of each unit of it goes forward:
    exact, and inextensible. Raises ValueError where the whisker would turn back.
    """

    length_mm: float
    sag_mm: float = 0.0
    set_y_mm: float = 0.0
    set_z_mm: float = 0.0

    def __post_init__(self):
        steepest = np.linalg.norm(self._slopes(np.linspace(0, self.length_mm, 50)), axis=-1).max()
        if steepest >= 1.0:
            raise ValueError(
                "sag_mm, set_y_mm, set_z_mm: the unloaded whisker would turn back, its slope by "
                f"arc length being {steepest:.3g}; below 1 is allowed"
            )

    @property
    def is_straight(self) -> bool:
        """Return whether the unloaded whisker lies along the hub's x axis."""
        return not (self.sag_mm or self.set_y_mm or self.set_z_mm)

    def point_mm(self, arc_mm: float | np.ndarray) -> np.ndarray:
        """Return the points (..., 3) at arc lengths."""
        arc = np.asarray(arc_mm, float)
        u = arc / self.length_mm
        sag = (u**4 - 4 * u**3 + 6 * u**2) / 3
        lateral = self._lateral(u**2, sag)
        at, weights = _GAUSS
        arcs = 0.5 * arc[..., None] * (1 + at)  # (..., points) of the quadrature
        forward = 0.5 * arc * (self._forward(arcs) @ weights)
        return np.concatenate([forward[..., None], lateral], axis=-1)

    def arc_at_mm(self, distance_mm: float) -> float:
        """Return the arc length at which the whisker is as far from its base as this.

        Where it is nowhere so far, as much longer than the distance as it is at its tip.
        """
        arc = distance_mm
        for _ in range(_ROUNDS):
            within = min(arc, self.length_mm)
            arc = distance_mm * within / float(np.linalg.norm(self.point_mm(within)))
        return arc

    def tangent(self, arc_mm: float | np.ndarray) -> np.ndarray:
        """Return the unit tangents (..., 3) at arc lengths."""
        arc = np.asarray(arc_mm, float)
        return np.concatenate([self._forward(arc)[..., None], self._slopes(arc)], axis=-1)

    def tangent_by_arc(self, arc_mm: float | np.ndarray) -> np.ndarray:
        """Return the derivative (..., 3) of the tangent along the arc, 1/mm."""
        arc = np.asarray(arc_mm, float)
        u = arc / self.length_mm
        spool = np.full_like(u, 2.0)
        sag = 4 * (u**2 - 2 * u + 1)
        curvature = self._lateral(spool, sag) / self.length_mm**2
        turning = (self._slopes(arc) * curvature).sum(-1)
        forward_by = -turning / self._forward(arc)
        return np.concatenate([forward_by[..., None], curvature], axis=-1)

    def _forward(self, arc):
        """Return the part (...) of each unit of arc that goes forward."""
        return np.sqrt(1.0 - (self._slopes(arc) ** 2).sum(-1))

    def _slopes(self, arc):
        """Return the derivatives (..., 2) of y and z along the arc."""
        u = arc / self.length_mm
        return self._lateral(2 * u, 4 * (u**3 - 3 * u**2 + 3 * u) / 3) / self.length_mm

    def _lateral(self, spool, sag):
        """Return y and z (..., 2) of weights (...) of the spool's set and of the sag."""
        return np.stack([self.set_y_mm * spool, self.set_z_mm * spool - self.sag_mm * sag], -1)


@dataclass(frozen=True)
class Rod:
    """A whisker of one material.

    shape: "cylinder", "cone" (from the base's diameter to a point at `length_mm`), or "tapered"
    (to `tip_diameter_mm` there). rest: straight where it is None. widths: of a "tapered" whisker that is
    no cone, the diameter over the base's, a polynomial in the share of the length, lowest power first.
    Raises ValueError for another shape, a size that is not positive, a tip that is not thinner
    than the base, or widths that are not 1 at the base and positive all along.
    """

    shape: str
    length_mm: float
    diameter_mm: float
    youngs_modulus_GPa: float
    density_kg_m3: float = 6450.0  # Nitinol
    rest: RestShape | None = None
    tip_diameter_mm: float | None = None
    widths: tuple[float, ...] = ()

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
        if self.widths:
            self._check_widths()

    def _check_widths(self):
        """Raise ValueError for widths that are not 1 at the base and positive all along."""
        along = self.width(np.linspace(0.0, self.length_mm, 201))
        if not (self.widths[0] == 1.0 and along.min() > 0):
            raise ValueError(
                "a whisker's widths are 1 at its base and above 0 all along, "
                f"not {along[0]:g} and {along.min():g}"
            )

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

    @cached_property
    def _polynomials(self) -> list[tuple[float, ...]]:
        """Return the coefficients of the width by the share of the length, and of its first two derivatives."""
        widths = self.widths or (1.0, -self.diameter_loss)
        slope = polynomial.polyder(widths)
        return [tuple(widths), tuple(slope.tolist()), tuple(polynomial.polyder(slope).tolist())]

    def width(self, arc_mm: float | np.ndarray) -> np.ndarray:
        """Return the diameter at arc length over the base's."""
        return np.maximum(self._evaluate(0, arc_mm), 0.0)

    def width_by_arc(self, arc_mm: float | np.ndarray) -> float | np.ndarray:
        """Return the derivative of the width by arc length at arc lengths, 1/mm."""
        return self._evaluate(1, arc_mm) / self.length_mm

    def _evaluate(self, order, arc_mm):
        """Return a derivative of the width, of this order by the share of the length, at arc lengths."""
        share = np.asarray(arc_mm, float) / self.length_mm
        *lower, value = self._polynomials[order]
        for coefficient in reversed(lower):
            value = coefficient + value * share
        return value

    def radius_mm(self, arc_mm: float | np.ndarray) -> np.ndarray:
        """Return the radius at arc length."""
        return 0.5 * self.diameter_mm * self.width(arc_mm)

    def taper_at(self, arc_mm: float) -> float:
        """Return the change of the radius per arc length at an arc length."""
        return 0.5 * self.diameter_mm * float(self.width_by_arc(arc_mm))

    def taper_by_arc(self, arc_mm: float) -> float:
        """Return the change of the taper per arc length at an arc length, 1/mm."""
        return 0.5 * self.diameter_mm * float(self._evaluate(2, arc_mm)) / self.length_mm**2
