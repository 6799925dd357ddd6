"""Find where a sphere or a cone may be: places whose silhouettes stand out in all cameras at once.

A hypothesis is where the straight whisker first touches the object: a distance along the whisker, a
motor angle, the slope there, and what the shape leaves free of a cone, its radius there and the
side of its tip. Its score is the mean edge strength along both sides of its silhouette (see
`vision.touched.edge_map`), the geometric mean of both, averaged over the cameras. The best of a
grid are refined from coarse to fine (`vision.touched.grid_search`). The numbers of a hypothesis
about a ring are of the same kind, see `touched_first`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from vision.geometry.centreline import rotation_z
from vision.geometry.rods import Rods
from vision.geometry.rounded import Form, Rounded
from vision.pictures.change import HALF
from vision.touched.edge_map import EdgeMap
from vision.touched.grid_search import (
    SearchPass,
    coarse_to_fine,
    half_steps,
    score_in_batches,
    touch_angles,
)

# [half-widths] Blur of the edge maps, pass by pass. Set by eye. Study: rounded_seen.py.
_BLURS = (0.5, 0.2, 0.08)
# [places] That each pass keeps. Set by eye. Study: rounded_seen.py.
_KEPT = (24, 20, 12)
# [places] Of the grid that go on. Set by eye. Study: rounded_seen.py.
_STARTS = 32
# [steps] Least separation of two places of the grid. Study: rounded_seen.py.
_SEPARATION = 4.0
# [points] Of each side of a silhouette along which edges are read. Stated.
_STATIONS = 8
# [mm] Of a silhouette that is read, to either side of where it is touched: cones end. Stated.
_SILHOUETTE_MM = {"sphere": 30.0, "cone": 20.0}
# [mm] From a silhouette outwards, to a point that gives its normal in the picture. Stated.
_OUTWARDS_MM = 0.2
# [1] Least edge strength of a camera in a geometric mean over cameras. Stated.
_LEAST_STRENGTH = 1e-3
# [rad] Slopes of the grid, as of a bar's. Stated.
_BETA_RAD = np.radians(np.arange(-78.0, 79.0, 6.0))
# [mm] How thick a cone may be where it is touched. Study: rounded_seen.py.
_CONE_RADII_MM = np.array([3.0, 6.0, 12.0, 24.0])
# [1] How thick, over what is stated of it. Study: rounded_seen.py.
_ABOUT = np.array([0.6, 1.0, 1.7])
# [index] Of the number of a hypothesis that says on which side a cone's tip is. A layout.
_TIP_SIDE = 4
# [mm] Step of the grid along the whisker: less than the blur. Stated.
_X_MM = 2.4
# [mm] Step of the grid along the arc of the whisker's middle: less than the blur. Stated.
_TOUCH_MM = 2.4
# [mm] Nearest contact to the whisker's base. Stated.
_NEAREST_MM = 10.0
# [places] Evaluated together: arrays that stay in the processor's cache. Not measured.
_BATCH = 4000


def find_places(
    edge_maps: Sequence[EdgeMap], rods: Rods, motor_rad: tuple[float, float]
) -> list[Rounded]:
    """Find spheres or cones whose silhouettes have the strongest edges, the best first.

    motor_rad: lowest and highest motor angle, between which the whisker touches.
    """
    values = hypothesis_values(rods, motor_rad)
    steps = half_steps(values)
    steps[_TIP_SIDE:] = 0.0  # a tip is above or below, and nowhere between
    objects_of = partial(touched_first, rods.bar.form, rods)
    passes = []
    for blur, kept in zip(_BLURS, _KEPT):
        blurred = [one.blurred(blur) for one in edge_maps]
        score = SilhouetteScore(blurred, objects_of, rods.bar.radius_mm)
        passes.append(SearchPass(score, blur / _BLURS[0], 1.0, kept))
    found = objects_of(coarse_to_fine(values, steps, passes, _SEPARATION, _STARTS))
    return found.each()


def hypothesis_values(rods: Rods, motor_rad: tuple[float, float]) -> list[np.ndarray]:
    """Return the grid's values of each number of a hypothesis about a sphere or a cone.

    They are where along the whisker it is first touched, mm; at which motor angle, rad; the slope
    there, rad; and of a cone the log of its radius there, mm, and on which side its tip is, -1 or
    1.
    """
    length_mm = rods.wire.length_mm
    form = rods.bar.form
    x_mm = np.arange(_NEAREST_MM, length_mm, _X_MM)
    values = [x_mm, touch_angles(motor_rad, length_mm, _TOUCH_MM), _BETA_RAD]
    if form.shape == "cone":
        radii_mm = 0.5 * form.about_mm * _ABOUT if form.about_mm else _CONE_RADII_MM
        values += [np.log(radii_mm), np.array([-1.0, 1.0])]
    return values


def touched_first(form: Form, rods: Rods, hypotheses: np.ndarray) -> Rounded:
    """Return the objects (n, 3) that a straight whisker first touches where hypotheses (n, k) say.

    Numbers of a hypothesis: see `hypothesis_values`; of a ring a tilt, rad, and its turn about the
    tangent, rad, follow the slope.
    """
    x, touch, beta, *others = hypotheses.T
    zero = np.zeros_like(x)
    psi = others[0] if form.shape == "ring" else zero
    along = np.stack([np.sin(psi), np.cos(psi) * np.sin(beta), np.cos(psi) * np.cos(beta)], axis=-1)
    inwards = np.stack([zero, np.cos(beta), -np.sin(beta)], axis=-1)
    on_whisker = np.stack([x, zero, zero], axis=-1)
    spot = on_whisker + rods.wire.radius_mm(x)[:, None] * inwards
    if form.shape == "sphere":
        point = spot + rods.bar.radius_mm * inwards
        direction = along
    elif form.shape == "ring":
        turn = others[1][:, None]
        towards = np.cos(turn) * inwards + np.sin(turn) * np.cross(along, inwards)
        point = spot + rods.bar.radius_mm * inwards + 0.5 * form.ring_diameter_mm * towards
        direction = np.cross(along, towards)
    else:
        radius = np.exp(others[0])[:, None]
        side = np.sign(others[1])[:, None]
        sin = np.sin(form.half_angle_rad)
        cos = np.cos(form.half_angle_rad)
        point = spot + radius * cos / sin * side * along
        direction = cos * side * along - sin * inwards
    motor = rotation_z(touch)  # (n, 3, 3)

    def turned(vectors: np.ndarray) -> np.ndarray:
        """Rotate vectors (n, 3) by the motor angles."""
        return np.einsum("nij,nj->ni", motor, vectors)

    return Rounded(turned(point), turned(direction), form, turned(spot))


@dataclass(frozen=True)
class SilhouetteScore:
    """Score of hypothetical objects: edge strength along both sides of their silhouettes.

    objects_of: function of hypotheses (n, k) that returns the objects.
    """

    edge_maps: Sequence[EdgeMap]
    objects_of: Callable[[np.ndarray], Rounded]
    radius_mm: float

    def __call__(self, hypotheses: np.ndarray) -> np.ndarray:
        """Return the scores (n,) of hypotheses (n, k), from 0 to 1."""
        return score_in_batches(self._score, hypotheses, _BATCH)

    def _score(self, hypotheses: np.ndarray) -> np.ndarray:
        """Return the scores (n,) of a batch: means of cameras, geometric where one has no outline."""
        objects = self.objects_of(hypotheses)
        strength = np.array([self.both_sides(objects, one) for one in self.edge_maps])
        has_silhouette = np.isfinite(strength)  # (cameras, n)
        if np.all(has_silhouette):
            return np.mean(strength, axis=0)
        logs = np.where(has_silhouette, np.log(np.maximum(strength, _LEAST_STRENGTH)), 0.0)
        count = np.sum(has_silhouette, axis=0)
        mean = np.sum(logs, axis=0) / np.maximum(count, 1)
        return np.where(count > 0, np.exp(mean), 0.0)

    def both_sides(self, objects: Rounded, edges: EdgeMap) -> np.ndarray:
        """Compute the strength (n,) of both sides in one camera.

        It is their geometric mean, NaN where there is no silhouette.
        """
        camera = edges.camera
        reach_mm = _SILHOUETTE_MM[objects.form.shape]
        limb, normals = objects.limb(camera.centre_mm, self.radius_mm, reach_mm, _STATIONS)
        outwards = limb + _OUTWARDS_MM * normals  # (n, 2, stations, 3)
        both_mm = np.concatenate([limb.reshape(-1, 3), outwards.reshape(-1, 3)])
        px, outwards_px = np.split(camera.project(both_mm) / HALF, 2)
        normal_px = outwards_px - px
        normal_px /= np.linalg.norm(normal_px, axis=1, keepdims=True)
        x, y = np.nan_to_num(normal_px).T
        column, row = np.nan_to_num(px).T
        xx, xy, yy = edges.tensor_at(column, row).T
        strength = x * x * xx + 2.0 * x * y * xy + y * y * yy
        strength = strength.reshape(limb.shape[:-1])  # (n, 2, stations)
        strength[~np.isfinite(limb[..., 0])] = np.nan
        sides = np.mean(strength, axis=-1)
        return np.sqrt(np.prod(sides, axis=-1))
