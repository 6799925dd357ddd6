"""Find where a straight bar may be: cylinders whose two edges stand out in all cameras at once.

The whisker touches the bar somewhere along itself and somewhere in its stroke. So a hypothesis is
where it first touches: a distance x along the straight whisker, a motor angle, and the slope beta
and tilt psi of the bar there. Each hypothesis is a cylinder of known radius, whose two edges
project to two lines in every camera. Its score is the mean edge strength along these lines (see
`vision.touched.edge_map`), the geometric mean of both edges, averaged over the cameras: a shadow
has no second edge at the bar's width, and a line that is bright in one camera alone scores little
in the others. A dark rim makes the outermost edge invisible; therefore an edge a little farther in
counts as well, by less, and one farther out counts against. The best hypotheses of a grid are
refined from coarse to fine (see `vision.touched.grid_search`). Which of the few that are left is
the bar is decided by its lines in `vision.touched.search`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from vision.geometry.camera import Camera
from vision.geometry.centreline import rotation_z
from vision.geometry.contact import BarAxis, directions_at_slope
from vision.geometry.rods import Rods
from vision.geometry.rotation import unit
from vision.pictures.change import HALF
from vision.touched.edge_map import EdgeMap
from vision.touched.grid_search import (
    ObjectScore,
    SearchPass,
    coarse_to_fine,
    half_steps,
)
from vision.touched.search_scene import SearchScene

# [half-widths] Blur of the edge maps, pass by pass: first half a step of the grid. Derived.
_BLURS = (0.3, 0.12, 0.06)
# [half-widths] Distance from the bar's middle at which an edge is read: a dark rim shows one
# farther in, one farther out speaks against. Without these 4 % of 53 path-traced scenes more were
# over 9 px off. Study: bar_scenes.py.
_OFFSETS = np.array([1.0, 0.8, 0.6, 1.3, 1.6])
# [1] How much an edge at each of these offsets counts in the last pass; before it, only the
# positive ones do. Study: bar_scenes.py.
_WEIGHTS = np.array([1.0, 0.8, 0.6, -0.5, -0.5])
# [1] Places along the bar, over the length of it that is used: clamps are farther out. Stated.
_ALONG = np.arange(-5.0, 5.1) / 6.0
# [rad] Slopes of the grid. Study: bar_scenes.py.
_BETA_RAD = np.radians(np.arange(-84.0, 85.0, 6.0))
# [rad] Tilts of the grid. Study: bar_scenes.py.
_PSI_RAD = np.radians([-8.0, 0.0, 8.0])
# [radii] Step of the grid along the whisker. Derived.
_X_STEP = 0.7
# [radii] Step of the grid along the arc of the whisker's middle. Derived.
_TOUCH_STEP = 0.8
# [hypotheses] Of the grid that go on. With 12 in place of 24, and 4 in place of 8 kept, two of 53
# path-traced scenes more were lost. Study: bar_scenes.py.
_STARTS = 24
# [hypotheses] That each pass keeps. Study: bar_scenes.py.
_KEPT = 8
# [steps] Least separation of two hypotheses of the grid. Study: bar_scenes.py.
_SEPARATION = 4.0
# [px] Along a line, at least: a bar seen end on has no direction, and shows no edges. Derived.
_LEAST_STEP_PX = np.float32(1e-9)
# [hypotheses] Evaluated together: arrays that stay in the processor's cache; no result depends on
# it. Study: tests/studies/speed/tracer.py.
_BATCH = 1000


def find_bars(edge_maps: Sequence[EdgeMap], scene: SearchScene) -> list[BarAxis]:
    """Find axes of what may be the bar, the best first; a few pixels off."""
    rods = scene.rods
    x_mm = scene.contact_places_mm(_X_STEP * scene.radius_mm)
    touch_rad = scene.touch_angles_rad(_TOUCH_STEP * scene.radius_mm)

    def axes_of(hypotheses: np.ndarray) -> BarAxis:
        """Return the axes (n, 3) of hypotheses (n, 4)."""
        x, touch, beta, psi = hypotheses.T
        return axis_from_angles(x, touch, beta, psi, rods.reach_mm(x))

    values = [x_mm, touch_rad, _BETA_RAD, _PSI_RAD]
    return search_bars(edge_maps, values, axes_of, scene)


def can_touch(axis: BarAxis, rods: Rods, motor_rad: tuple[float, float]) -> bool:
    """Return whether the straight whisker comes to touch a bar in its stroke, to a radius of it.

    motor_rad: lowest and highest motor angle.
    """
    radius_mm = rods.bar.radius_mm
    whiskers = rotation_z(np.array(motor_rad))[:, :, 0]  # directions (2, 3)
    before_mm, after_mm = axis.distance_mm(np.zeros((2, 3)), whiskers)
    in_plane_mm = axis.point_mm - axis.point_mm[2] / axis.direction[2] * axis.direction
    x_mm = float(np.linalg.norm(in_plane_mm))
    reach_mm = rods.reach_mm(x_mm)
    is_passed = before_mm > reach_mm - radius_mm and after_mm < reach_mm + radius_mm
    return bool(is_passed and x_mm < rods.wire.length_mm + radius_mm)


def search_bars(
    edge_maps: Sequence[EdgeMap],
    values: Sequence[np.ndarray],
    axes_of: Callable[[np.ndarray], BarAxis],
    scene: SearchScene,
) -> list[BarAxis]:
    """Find the axes whose edges are the strongest, from a grid of hypotheses, the best first.

    values: k arrays, the grid's values of each number. axes_of: function of hypotheses (n, k) that
    returns their axes, points and directions (n, 3).
    """
    along_mm = scene.settings.bar_reach_mm * _ALONG
    passes = []
    for blur in _BLURS:
        is_last = blur == _BLURS[-1]
        score = EdgeScore(
            objects_of=axes_of,
            edge_maps=[one.blurred(blur) for one in edge_maps],
            radius_mm=scene.radius_mm,
            weights=_WEIGHTS if is_last else np.maximum(_WEIGHTS, 0.0),
            along_mm=along_mm if is_last else along_mm[::2],
        )
        passes.append(SearchPass(score, blur / _BLURS[0], 1.0, _KEPT))
    best = axes_of(coarse_to_fine(values, half_steps(values), passes, _SEPARATION, _STARTS))
    found = zip(best.point_mm, best.direction)
    return [BarAxis(point_mm, direction).upward() for point_mm, direction in found]


@dataclass(frozen=True)
class EdgeScore(ObjectScore):
    """Score of hypothetical bars from 0 to 1: the strength of both edges, mean over the cameras.

    weights: of edges at _OFFSETS. along_mm (t,): places at which edges are read, from each axis's
    point.
    """

    edge_maps: Sequence[EdgeMap]
    radius_mm: float
    weights: np.ndarray
    along_mm: np.ndarray

    batch: ClassVar[int] = _BATCH

    def of_objects(self, objects: BarAxis) -> np.ndarray:
        """Return the scores (n,) of a batch of bars (n, 3)."""
        strengths = [self.both_edges(objects, one) for one in self.edge_maps]
        return np.mean(strengths, axis=0)

    def both_edges(self, axes: BarAxis, edges: EdgeMap) -> np.ndarray:
        """Compute the strength (n,) of both edges of bars (n, 3) in one camera.

        It is their geometric mean, 0 to 1.
        """
        is_used = self.weights != 0.0
        strength = self._along_lines(axes, edges, _OFFSETS[is_used].astype(np.float32))
        strength = strength * self.weights[is_used, None]
        for_edge = np.max(strength, axis=1)
        against = np.min(strength, axis=1, initial=0.0)
        sides = np.maximum(for_edge + against, 0.0)
        return np.sqrt(np.prod(sides, axis=0))

    def _along_lines(self, axes: BarAxis, edges: EdgeMap, offsets: np.ndarray) -> np.ndarray:
        """Compute the mean strengths (2, m, n) of edges along lines at offsets to either side.

        offsets (m,): from the middles of bars (n, 3), in half widths.
        """
        middle, half_width = _bar_in_picture(axes, edges.camera, self.radius_mm, self.along_mm)
        # Both edges run nearly as the middle does: one normal (x, y) = (-dy, dx) serves all lines.
        dx, dy = np.gradient(middle, axis=-1)  # (n, t) each
        step = np.maximum(np.hypot(dx, dy), _LEAST_STEP_PX)
        dx = dx / step
        dy = dy / step
        across = np.stack([dy * dy, -2.0 * dx * dy, dx * dx], axis=-1)  # weights of xx, xy, yy
        both_sides = np.concatenate([offsets, -offsets])[:, None, None, None]
        x, y = np.moveaxis(middle + both_sides * half_width, 1, 0)  # (lines, n, t) px each
        along_lines = edges.tensor_at(x, y)  # (lines, n, t, 3)
        strength = np.einsum("antk,ntk->an", along_lines, across) / len(self.along_mm)
        return strength.reshape(2, len(offsets), -1)


def _bar_in_picture(
    axes: BarAxis, camera: Camera, radius_mm: float, along_mm: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Project bars (n, 3): x and y of their middles (2, n, t), and the vectors to one edge.

    Both are in pixels of an edge map. Perspective makes the two edges differ by less than a coarse
    search resolves.
    """
    points_mm = axes.points_at(along_mm)  # (n, t, 3)
    sideways = unit(np.cross(axes.direction, axes.point_mm - camera.centre_mm))
    edge_mm = points_mm + radius_mm * sideways[:, None]
    middle, edge = camera.project(np.stack([points_mm, edge_mm]))  # (n, t, 2) each
    both = np.moveaxis([middle, edge - middle], -1, 1)  # (2, x and y, n, t)
    middle, half_width = both.astype(np.float32) / HALF
    return middle, half_width


def axis_from_angles(
    x_mm: ArrayLike,
    touch_rad: ArrayLike,
    beta_rad: ArrayLike,
    psi_rad: ArrayLike,
    reach_mm: ArrayLike,
) -> BarAxis:
    """Return the bars (n, 3) that a straight whisker first touches where these numbers say.

    x_mm: along the whisker. touch_rad: motor angle. beta_rad, psi_rad: slope and tilt of the bar.
    All arguments (n,). reach_mm: distance between the axes of bar and whisker where they touch.
    """
    x, touch, beta, psi, reach = np.broadcast_arrays(x_mm, touch_rad, beta_rad, psi_rad, reach_mm)
    upright, normal = directions_at_slope(beta)
    along_x = np.array([1.0, 0.0, 0.0])
    direction = np.sin(psi)[..., None] * along_x + np.cos(psi)[..., None] * upright
    point = x[..., None] * along_x + reach[..., None] * normal
    turn = rotation_z(touch)  # (n, 3, 3)
    return BarAxis(
        np.einsum("...ij,...j->...i", turn, point), np.einsum("...ij,...j->...i", turn, direction)
    )
