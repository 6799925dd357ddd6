"""Lamp, surroundings and what surfaces make of them. Brightness is linear and in parts of the sensor's full scale."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Light:
    """One distant lamp (unit vector towards it, rig frame) over soft light from all round."""

    towards: np.ndarray
    lamp: float
    soft: float

    def flat(self, normal: np.ndarray) -> float:
        """What a matt white face with this normal sends back."""
        return self.soft + self.lamp * max(0.0, float(np.dot(normal, self.towards)))


@dataclass(frozen=True)
class Material:
    """`matt` and `shiny` reflectances; `gloss`: the highlight's exponent; `rim`: how soon a round bar darkens to its
    edges, as polished metal does that mirrors dark surroundings there (0: not at all).
    """

    matt: float
    shiny: float = 0.0
    gloss: float = 20.0
    rim: float = 0.0


def round_shade(
    light: Light,
    material: Material,
    across: np.ndarray,
    facing: np.ndarray,
    aside: np.ndarray,
    mirror: np.ndarray,
) -> np.ndarray:
    """Brightness on a round bar at `across` (−1…1 from silhouette to silhouette).

    `facing`, `aside`: the lamp's components towards the camera and across the bar; `mirror`: the same two (stacked)
    of the direction half-way between lamp and camera, and its length without the part along the bar. All broadcast
    against `across`.
    """
    up = np.sqrt(np.maximum(1 - across**2, 0))
    return surface_shade(
        light, material, up * facing + across * aside, up * mirror[0] + across * mirror[1], up
    )


def surface_shade(
    light: Light, material: Material, lamp: np.ndarray, mirror: np.ndarray, up: np.ndarray
) -> np.ndarray:
    """Brightness of a surface by the cosines between its normal and the lamp, the direction half-way between lamp and
    camera, and the camera's as it is seen across a round bar.
    """
    diffuse = np.maximum(lamp, 0)
    highlight = np.maximum(mirror, 0) ** material.gloss
    edge = up**material.rim if material.rim else 1.0
    return (
        material.matt * (light.soft + light.lamp * diffuse)
        + material.shiny * light.lamp * highlight
    ) * edge
