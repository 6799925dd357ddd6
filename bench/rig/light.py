"""Lamp, surroundings and how surfaces reflect them. Brightness is linear, in parts of the sensor's
full scale."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Light:
    """One distant lamp over soft light from all round.

    towards (3,): unit vector to the lamp, rig frame. lamp, soft: brightness of a white face by each.
    """

    towards: np.ndarray
    lamp: float
    soft: float

    def shade_flat(self, normal: np.ndarray) -> float:
        """Return the brightness of a matt white face with this unit normal (3,)."""
        return self.soft + self.lamp * max(0.0, float(np.dot(normal, self.towards)))


@dataclass(frozen=True)
class Material:
    """Reflectances of a surface.

    matt, shiny: diffuse and specular reflectance. gloss: the highlight's exponent. rim: how soon a
    round bar darkens to its edges, as polished metal does that mirrors dark surroundings there (0:
    not at all).
    """

    matt: float
    shiny: float = 0.0
    gloss: float = 20.0
    rim: float = 0.0


def shade_surface(
    light: Light, material: Material, lamp: np.ndarray, mirror: np.ndarray, facing: np.ndarray
) -> np.ndarray:
    """Return the brightness of a surface by cosines of its normal, which broadcast together.

    lamp: to the lamp. mirror: to the direction half-way between lamp and camera (Blinn). facing: to
    the camera, as seen across a round bar.
    """
    diffuse = material.matt * (light.soft + light.lamp * np.maximum(lamp, 0))
    highlight = material.shiny * light.lamp * np.maximum(mirror, 0) ** material.gloss
    rim = facing**material.rim if material.rim else 1.0
    return (diffuse + highlight) * rim
