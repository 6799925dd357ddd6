"""What friction says of one contact: residuals in the plane that touches the bar, and their derivatives.

Each law is called with the normal force and its derivatives (4,), the shear force (2,) and the motion of the
whisker's material (2,) along the bar and round it with theirs (2, 4), and the unknowns beyond the four of the
contact. It answers with residuals (n,) and their derivatives (n, 4 + beyond).
"""

import math
from dataclasses import dataclass

import numpy as np

GIVE_MM = 1e-5  # a held contact gives way by about this before it slides along the whisker


@dataclass(frozen=True)
class Sliding:
    """Shear force = −μ · normal force · unit vector at a heading, an unknown of its own; the motion has that heading
    too.
    """

    friction: float
    status = "sliding"

    def __call__(self, press, press_by, shear, shear_by, motion, motion_by, heading):
        ahead = np.array([math.cos(heading[0]), math.sin(heading[0])])
        aside = np.array([-ahead[1], ahead[0]])
        law_by = np.zeros((3, 5))
        law_by[:2, :4] = shear_by + self.friction * np.outer(ahead, press_by)
        law_by[:2, 4] = self.friction * press * aside
        law_by[2, :4], law_by[2, 4] = aside @ motion_by, -ahead @ motion
        return [*(shear + self.friction * press * ahead), aside @ motion], law_by


@dataclass(frozen=True)
class Oiled:
    """Shear force = −μ · normal force · v/√(v² + give²), v the motion: sliding, softened where the motion is small."""

    friction: float
    give_mm: float
    status = "sliding"

    def __call__(self, press, press_by, shear, shear_by, motion, motion_by, _):
        soft = math.hypot(*motion, self.give_mm)
        part = motion / soft
        part_by = (motion_by - np.outer(part, part @ motion_by)) / soft
        law = shear + self.friction * press * part
        return [*law], shear_by + self.friction * (np.outer(part, press_by) + press * part_by)


@dataclass(frozen=True)
class Held:
    """No motion along the bar; round it (along the whisker) a friction μN(1 − x²), x = force along the bar / μN,
    against the motion.

    That is inside the cone, the whole of μN where nothing acts along the bar, and (unlike the cone's own circle)
    smooth at its end.
    """

    friction: float
    status = "held"

    def __call__(self, press, press_by, shear, shear_by, motion, motion_by, _):
        cone = self.friction * press
        x = shear[0] / cone if cone else 1.0
        if abs(x) >= 1:
            return [motion[0], shear[1]], np.stack([motion_by[0], shear_by[1]])
        soft = math.hypot(motion[1], GIVE_MM)
        way, way_by = motion[1] / soft, GIVE_MM**2 / soft**3 * motion_by[1]
        left, left_by = (
            cone * (1 - x**2),
            (1 + x**2) * self.friction * press_by - 2 * x * shear_by[0],
        )
        law = [motion[0], shear[1] + way * left]
        return law, np.stack([motion_by[0], shear_by[1] + way * left_by + left * way_by])
