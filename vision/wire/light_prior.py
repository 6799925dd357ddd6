"""What is known of a rod's light before its picture is seen.

Light is smooth: its Fourier coefficients round the rod fall with their order, and neighbouring places
along it are lit much alike. How smooth differs from scene to scene: diffuse light has low orders alone, a
highlight has high ones, and the shadow of a bar ends within a centimetre of the wire.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from vision.wire.shading import Knots

# [1] Prior sigma of the rod's level of light over its contrast: of half to twice this, lines are off alike.
# Study: wire_scenes.py.
_LEVEL_SHARE = 2.0
# [1] What of it changes from turn to turn of `LIT_ALIKE_RAD`: light and rod keep, the angle at
# which they meet does not. Half or twice it moves nothing on the fixtures. Study: thresholds.py
# wire.light_prior _TURNED_SHARE ….
_TURNED_SHARE = 0.3


@dataclass(frozen=True)
class LightPrior:
    """How strongly the light of a rod is expected to vary round it and along it.

    The prior sigma of a Fourier coefficient of order n is strength / n ** decay, over the contrast. From
    knot to knot along the rod a coefficient changes by `change` of that sigma.
    """

    strength: float
    decay: float
    change: float

    def precision(self, knots: Knots, terms: int) -> np.ndarray:
        """Return the inverse covariance (size, size) of all coefficients over the contrast.

        size = knots × terms.
        """
        along = _between(self.change, len(knots.turn_rad), len(knots.place_mm))
        return np.kron(along, np.diag(self._sigmas(terms) ** -2.0))

    def _sigmas(self, terms: int) -> np.ndarray:
        """Return the prior sigma (terms,) of each coefficient over the contrast."""
        order = np.arange(1, terms + 1) // 2
        sigmas = self.strength * np.maximum(order, 1.0) ** -self.decay
        sigmas[0] = _LEVEL_SHARE
        return sigmas


# [1] Light of the descent, which needs one: between diffuse light and a highlight, and much the same a
# centimetre farther on. Free at every knot, it bends the line of a wire before an even floor by up to a
# pixel. Study: wire_scenes.py.
USUAL_LIGHT = LightPrior(strength=0.6, decay=1.0, change=0.1)


@lru_cache
def _between(change: float, turns: int, places: int) -> np.ndarray:
    """Return the inverse covariance (turns · places,) of one coefficient at all knots, over its own variance."""
    from_place_to_place = np.kron(np.eye(turns), _squared_steps(places)) / change**2
    from_turn_to_turn = np.kron(_squared_steps(turns), np.eye(places)) / _TURNED_SHARE**2
    return np.eye(turns * places) + from_place_to_place + from_turn_to_turn


def _squared_steps(count: int) -> np.ndarray:
    """Return the matrix (count, count) of the sum of squared steps between neighbouring values."""
    steps = np.diff(np.eye(count), axis=0)
    return steps.T @ steps
