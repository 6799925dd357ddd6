"""The laws of friction at one contact: equations in the tangent plane, and their exact derivatives.

A law's `equations(load, own)` returns residuals (n,) and their derivatives by the contact's four
unknowns, force and arc length, and the law's own. x_by is the derivative of x by these.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

# [lengths] A held contact gives way by about this before it slides along the whisker: 10 nm of 100 mm. Stated.
GIVE = 1e-7


class ContactLoad(NamedTuple):
    """What a law sees: the normal force, N, the shear force (2,), N, and the motion (2,), mm, of
    the whisker's material, along the object's axis and round it.

    press_by (4,), shear_by (2, 4), motion_by (2, 4): derivatives by force (3,) and arc length.
    """

    press: float
    press_by: np.ndarray
    shear: np.ndarray
    shear_by: np.ndarray
    motion: np.ndarray
    motion_by: np.ndarray


@dataclass(frozen=True)
class Sliding:
    """Shear force = −μ · normal force · unit vector at a heading, which the motion has, too.

    The heading, rad, is an unknown of the law's own.
    """

    friction: float
    status = "sliding"

    def equations(self, load: ContactLoad, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the residuals (3,) of shear force and heading, and their derivatives (3, 5)."""
        (heading,) = own
        forward = np.array([math.cos(heading), math.sin(heading)])
        sideways = np.array([-forward[1], forward[0]])
        limit = self.friction * load.press
        residual = np.append(load.shear + limit * forward, sideways @ load.motion)
        residual_by = np.empty((3, 5))
        residual_by[:2, :4] = load.shear_by + self.friction * np.outer(forward, load.press_by)
        residual_by[:2, 4] = limit * sideways
        residual_by[2, :4] = sideways @ load.motion_by
        residual_by[2, 4] = -forward @ load.motion
        return residual, residual_by


@dataclass(frozen=True)
class RegularisedSliding:
    """Shear force = −μ · normal force · v/√(v² + give²), v the motion.

    Coulomb's law, made smooth where the motion is small: it has a solution near any guess, and with
    ever less give it leads to that of `Sliding`.
    """

    friction: float
    give_mm: float
    status = "sliding"

    def equations(self, load: ContactLoad, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the residuals (2,) of the shear force, and their derivatives (2, 4)."""
        length = math.hypot(*load.motion, self.give_mm)
        direction = load.motion / length
        along = direction @ load.motion_by
        direction_by = (load.motion_by - np.outer(direction, along)) / length
        residual = load.shear + self.friction * load.press * direction
        friction_by = np.outer(direction, load.press_by) + load.press * direction_by
        return residual, load.shear_by + self.friction * friction_by


@dataclass(frozen=True)
class Held:
    """No motion along the object; round it (along the whisker) a friction μN(1 − x²) against the
    motion, x = force along the object / μN, softened within give_mm.

    That is inside the cone, the whole of μN where nothing acts along the object, and (unlike the
    cone's own circle) smooth at its end.
    """

    friction: float
    give_mm: float
    status = "held"

    def equations(self, load: ContactLoad, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the residuals (2,) of motion along and force round the object, and their
        derivatives (2, 4)."""
        limit = self.friction * load.press
        x = load.shear[0] / limit if limit else 1.0
        residual = np.array([load.motion[0], load.shear[1]])
        residual_by = np.stack([load.motion_by[0], load.shear_by[1]])
        if abs(x) < 1:
            direction, direction_by = _soft_sign(load.motion[1], load.motion_by[1], self.give_mm)
            left = limit * (1 - x**2)  # what the cone leaves for friction round the object
            left_by = (1 + x**2) * self.friction * load.press_by - 2 * x * load.shear_by[0]
            residual[1] += direction * left
            residual_by[1] += direction * left_by + left * direction_by
        return residual, residual_by


def _soft_sign(motion, motion_by, give_mm):
    """Return the sign of a motion, softened within give_mm of zero, and its derivatives (4,)."""
    length = math.hypot(motion, give_mm)
    return motion / length, give_mm**2 / length**3 * motion_by
