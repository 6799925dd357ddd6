"""The whisker as the session states it, for truth and estimate alike."""

import math
from dataclasses import dataclass, replace
from typing import Any

from bench.session.manifest import WhiskerKeys
from bench.session.profile import Profile, contradiction
from bench.session.rest_shape import (
    MOST_SLOPE,
    MOST_TURN_DEG,
    STRAIGHT,
    RestShape,
    of_curvature,
    steepest_slopes,
)
from estimator.beam import Beam, flexural_rigidity
from estimator.profiled_beam import ProfiledBeam
from vision.geometry import ProfiledWire, Wire


@dataclass(frozen=True, kw_only=True)
class Whisker(WhiskerKeys):
    """Shape, size and stiffness, each with one standard deviation (0: exact).

    diameter_mm is the base's; a "tapered" whisker, and no other, has a tip_diameter_mm below it. Exactly one of
    `youngs_modulus_GPa` and `flexural_rigidity_Nmm2` (at the base) is given. rest_mm: what the file `rest_shape`
    holds, see `bench.session.rest_shape`. widths: of the file `profile` (`bench.session.profile`); shape and
    tip_diameter_mm are then those from end to end, diameter_mm that measured at the base. Raises ValueError for anything else.
    """

    rest_mm: RestShape = STRAIGHT
    widths: tuple[float, ...] = ()

    def __post_init__(self):
        """Raise ValueError where the keys contradict each other."""
        if (self.youngs_modulus_GPa is None) == (self.flexural_rigidity_Nmm2 is None):
            raise ValueError("give either youngs_modulus_GPa or flexural_rigidity_Nmm2")
        if (self.shape == "tapered") != (self.tip_diameter_mm is not None):
            raise ValueError('tip_diameter_mm belongs to shape = "tapered", and to no other shape')
        if self.tip_diameter_mm is not None and not 0 < self.tip_diameter_mm < self.diameter_mm:
            found = f"tip_diameter_mm = {self.tip_diameter_mm:g}"
            raise ValueError(f"{found}: must be below diameter_mm, and above 0")
        if self.rest_curvature_per_mm is not None and self.rest_shape is not None:
            raise ValueError("give either rest_curvature_per_mm or rest_shape, not both")
        if max(steepest_slopes(self.unloaded_mm, self.length_mm)) > MOST_SLOPE:
            raise ValueError(
                "rest_curvature_per_mm: over length_mm the whisker would turn by more than "
                f"{MOST_TURN_DEG:g}° from its base"
            )

    @property
    def unloaded_mm(self) -> RestShape:
        """Return the shape of the unloaded whisker, straight where nothing is stated of it."""
        if self.rest_curvature_per_mm is None:
            return self.rest_mm
        return of_curvature(self.rest_curvature_per_mm, self.length_mm)

    def with_rest(self, rest_mm: RestShape) -> "Whisker":
        """Return the whisker with another unloaded shape."""
        return replace(self, rest_curvature_per_mm=None, rest_mm=rest_mm)

    @property
    def turn_rad(self) -> float:
        """Return by how much the unloaded whisker turns from its base, at most."""
        return math.asin(max(steepest_slopes(self.unloaded_mm, self.length_mm)))

    @property
    def wire(self) -> Wire:
        """Return the rod that the cameras see."""
        stated = (
            self.shape,
            self.length_mm,
            self.diameter_mm,
            self.length_sigma_mm,
            self.diameter_sigma_mm,
            self.tip_diameter_mm,
            self.unloaded_mm,
        )
        return ProfiledWire(*stated, widths=self.widths) if self.widths else Wire(*stated)

    @property
    def EI_Nmm2(self) -> float:
        """Return the flexural rigidity at the base, N·mm²."""
        if self.flexural_rigidity_Nmm2 is not None:
            return self.flexural_rigidity_Nmm2
        return flexural_rigidity(self.youngs_modulus_GPa, self.diameter_mm)

    @property
    def implied_modulus_GPa(self) -> float:
        """Return the Young's modulus that rigidity and diameter amount to, GPa."""
        return self.EI_Nmm2 / flexural_rigidity(1.0, self.diameter_mm)

    @property
    def C_Nmm2(self) -> float:
        """Return C = 3 E I of the paper, N·mm²."""
        return 3.0 * self.EI_Nmm2

    @property
    def beam(self) -> Beam:
        """Return the beam that an estimator may know of."""
        if self.widths:
            return ProfiledBeam.of_widths(
                self.C_Nmm2,
                self.length_mm,
                self.widths,
                self.unloaded_mm,
                self.rest_shape_sigma_mm,
                self.wire.taper_sigma_per_mm,
                self.length_sigma_mm,
            )
        tip_share = None
        if self.tip_diameter_mm is not None:
            tip_share = self.tip_diameter_mm / self.diameter_mm
        return Beam(
            self.C_Nmm2,
            self.length_mm,
            self.shape,
            tip_share,
            self.unloaded_mm,
            self.rest_shape_sigma_mm,
            self.wire.taper_sigma_per_mm,
            self.length_sigma_mm,
        )

    @property
    def C_sigma_Nmm2(self) -> float:
        """Return one standard deviation of C, N·mm².

        It is from the rigidity's, or from E's and (fourfold) the diameter's.
        """
        if self.flexural_rigidity_Nmm2 is not None:
            return 3.0 * self.flexural_rigidity_sigma_Nmm2
        by_modulus = self.youngs_modulus_sigma_GPa / self.youngs_modulus_GPa
        by_diameter = 4.0 * self.diameter_sigma_mm / self.diameter_mm
        return self.C_Nmm2 * math.hypot(by_modulus, by_diameter)


def profiled_sizes(keys: WhiskerKeys, profile: Profile) -> dict[str, Any]:
    """Return the sizes of a whisker whose diameters are measured, by their names in `Whisker`.

    Raises ValueError where keys that are stated besides contradict them.
    """
    sigma_mm = keys.diameter_sigma_mm
    for key, measured_mm in (
        ("diameter_mm", profile.base_mm),
        ("tip_diameter_mm", profile.tip_mm),
    ):
        stated_mm = getattr(keys, key)
        found = stated_mm and contradiction(key, stated_mm, sigma_mm, measured_mm)
        if found:
            raise ValueError(found)
    if keys.shape == "cone":
        raise ValueError('shape = "cone" has no profile: leave shape out')
    is_tapered = profile.tip_mm < profile.base_mm
    return {
        "shape": "tapered" if is_tapered else "cylinder",
        "diameter_mm": profile.base_mm,
        "diameter_sigma_mm": sigma_mm if profile.sigma_mm is None else profile.sigma_mm,
        "tip_diameter_mm": profile.tip_mm if is_tapered else None,
        "widths": profile.widths,
    }
