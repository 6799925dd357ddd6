"""Hypotheses about where a ring, sphere or cone is, and the search among them.

A hypothesis is where the straight whisker first touches the object: a distance along the whisker, a
motor angle, the slope there, and the numbers that this leaves free (`Rounded.free_numbers`: of a
cone its radius there and the side of its tip, of a ring its tilt and its turn about the tangent).
The best of a grid of hypotheses are refined from coarse to fine (`vision.touched.grid_search`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from vision.geometry.centreline import rotation_z
from vision.geometry.contact import directions_at_slope
from vision.geometry.rods import Rods
from vision.geometry.rounded import RoundedAxis
from vision.touched.grid_search import SearchPass, coarse_to_fine, half_steps
from vision.touched.search_scene import SearchScene

Places = Callable[[np.ndarray], RoundedAxis]


@dataclass(frozen=True)
class PlaceGrid:
    """The grid of hypotheses from which a search begins.

    x_mm: its step along the whisker. touch_mm: its step along the arc of the whisker's middle.
    beta_rad: its slopes. starts: number of hypotheses that go on. separation: least distance of
    two of these, in half steps of the grid.
    """

    x_mm: float
    touch_mm: float
    beta_rad: np.ndarray
    starts: int
    separation: float

    def values(self, scene: SearchScene) -> list[np.ndarray]:
        """Return the grid's values of each number of a hypothesis."""
        x_mm = scene.contact_places_mm(self.x_mm)
        touch_rad = scene.touch_angles_rad(self.touch_mm)
        free = [number.values for number in scene.rods.bar.free_numbers()]
        return [x_mm, touch_rad, self.beta_rad, *free]

    def search(
        self, scene: SearchScene, passes_of: Callable[[Places], Sequence[SearchPass]]
    ) -> list[RoundedAxis]:
        """Find the places with the highest scores, the best first.

        passes_of: returns the passes, by a function of hypotheses (n, k) that returns their places.
        """
        rods = scene.rods
        values = self.values(scene)
        free_choices = [number.is_choice for number in rods.bar.free_numbers()]
        is_choice = [False, False, False, *free_choices]
        steps = np.where(is_choice, 0.0, half_steps(values))

        def places_of(hypotheses: np.ndarray) -> RoundedAxis:
            """Return the places (n, 3) of hypotheses (n, k)."""
            return touched_first(rods, hypotheses)

        passes = passes_of(places_of)
        best = coarse_to_fine(values, steps, passes, self.separation, self.starts)
        return places_of(best).each()


def touched_first(rods: Rods, hypotheses: np.ndarray) -> RoundedAxis:
    """Return where objects (n, 3) stand that a straight whisker first touches as hypotheses say.

    hypotheses (n, k): x along the whisker, mm; motor angle and slope, rad; the object's free
    numbers.
    """
    x, touch, beta = hypotheses[:, :3].T
    along, inwards = directions_at_slope(beta)
    on_whisker = x[:, None] * np.array([1.0, 0.0, 0.0])
    spot = on_whisker + rods.wire.radius_mm(x)[:, None] * inwards
    place = rods.bar.at_contact(spot, inwards, along, hypotheses[:, 3:])
    return place.turned(rotation_z(touch))
