"""Where a ring, sphere or cone is in space, before any wire is known.

A sphere or a cone is searched by its silhouette. A hypothesis is where the straight whisker first touches the object: a
distance along the whisker, a motor angle, the slope there, and what the shape leaves free of a cone. Its score is the
mean edge strength along both sides of its silhouette, the geometric mean of both, averaged over the cameras, refined
from coarse to fine (`vision.touched.grid_search`). A ring is searched by what it covers (`vision.touched.rings`). The
dozen or so places that remain are then fitted to the edges: the edges beside the predicted silhouette are measured in every
camera, the object is moved so that its silhouette passes through them, and both are repeated within ever shorter reach.
Of spheres and cones the place with the highest detection score wins, of rings the one that covers best what differs
from the picture without rods.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from vision.geometry.camera import Camera, Cameras
from vision.geometry.centreline import rotation_z
from vision.geometry.contact import axis_frame, shifted_axis
from vision.geometry.grazing import sights_beside
from vision.geometry.newton import cauchy_weights, settle
from vision.geometry.refusals import Refused
from vision.geometry.rods import Bar, Rods
from vision.geometry.rounded import Form, Rounded
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.change import HALF
from vision.pictures.view import View
from vision.touched.edge_map import EdgeMap, compute_edge_map
from vision.touched.grid_search import (
    SearchPass,
    coarse_to_fine,
    half_steps,
    score_in_batches,
    touch_angles,
)
from vision.touched.limb import STRETCHES, Limb, measure_limbs
from vision.touched.rings import ChangeMap, coverage_score, find_rings
from vision.touched.search_scene import SearchScene
from vision.wire.points import LinePoints

# [mm] Half the width of a bar whose edges are as sharp as those of the object. Stated.
_EDGE_MM = 3.0
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
# [px] Within which edges are measured, iteration by iteration: rings came from 17 mm off. Study:
# rounded_seen.py.
_REACHES_PX = (9.0, 7.0, 5.0, *[4.0] * 8)
# [mm, rad] Prior sigmas of one iteration: keep what no camera determines. Stated.
_PRIOR = np.array([8.0, 8.0, 0.5, 0.5, 8.0])
# [px] Reaches of a ring that is also fitted close to where it covers what differs: its edges alone
# led 22 mm away from an upright one. Set by eye. Study: rounded_seen.py.
_NEAR_REACHES_PX = (5.0, 4.0, 4.0)
# [mm, rad] Prior sigmas of that fit. Set by eye. Study: rounded_seen.py.
_NEAR_PRIOR = np.array([1.5, 1.5, 0.02, 0.02, 1.5])
# [1] Least score of how well a ring covers what differs: true ones have 0.37 to 0.8. Study:
# rounded_seen.py.
_LEAST_COVERED = 0.3
# [1] A second place with more than this share of the best score is a refusal. Study:
# rounded_seen.py.
_AS_COVERED = 0.95
# [mm] Two places of a ring so far apart are different ones. Study: rounded_seen.py.
_APART_MM = 5.0
# [mm, rad] Steps of differences; a smaller Gauss–Newton step is the last. Stated.
_STEPS = np.array([1e-3, 1e-3, 1e-5, 1e-5, 1e-3])
# [steps] Gauss–Newton within an iteration; it ends earlier. Stated.
_GAUSS_NEWTON = 6
# [sigmas] Scale of the Cauchy distribution that weighs residuals. Stated.
_CAUCHY_SIGMAS = 5.0
# [nats] Of one segment of a silhouette for or against a place: odds of 20 to one. Derived.
_MOST_NATS = 3.0
# [mm] A fit that moves the object by less has converged: the whisk's fit does the rest. Stated.
_CONVERGED_MM = 0.1
# [1] Least detection score: true places have 0.15 to 0.73, wrong ones 0.14 at most in seven
# scenes. Study: rounded_seen.py.
_LEAST_SCORE = 0.1
# [1] At a higher detection score no other place is tried. Study: rounded_seen.py.
_SURE_SCORE = 0.5
# [places] That are refined. Set by eye. Study: rounded_seen.py.
_REFINED = 3
# [iterations] Of a refinement; one of 24 cones had converged 0.6 mm off. Set by eye. Study:
# rounded_seen.py.
_REFINEMENTS = 5
_NAMES = {
    "ring": "ring of {ring:g} mm",
    "sphere": "sphere of {thick:g} mm",
    "cone": "cone of {angle:g} deg half-angle",
}


@dataclass(frozen=True)
class RoundedFit:
    """An object fitted to edges, and its detection score from -1 to 1, see `_detection_score`: mean of the cameras."""

    place: Rounded
    score: float


def see_rounded(
    views: Sequence[View],
    cameras: Cameras,
    rods: Rods,
    motor_rad: np.ndarray,
    settings: VisionSettings,
    still: Callable[[View], np.ndarray],
) -> Rounded:
    """Find a ring, sphere or cone by the pictures of all frames.

    motor_rad (n,): motor angles of all frames. still: function that returns a view's picture (h, w) of what stands
    still, at every HALF-th pixel. Raises Refused where the object is not seen, or a ring may be in either of two places.
    """
    scene = SearchScene(views, cameras, rods, motor_rad, settings)
    if rods.bar.form.shape == "ring":
        maps = [ChangeMap.from_pictures(view, still(view)) for view in views]
        return _see_ring(maps, scene)
    as_sharp = Rods(rods.wire, Bar(2.0 * _EDGE_MM))
    edge_maps = []
    for view in views:
        background = view.background[::HALF, ::HALF]
        edges = compute_edge_map(
            view.camera, still(view), background, as_sharp, scene.mid_motor_rad
        )
        edge_maps.append(edges)
    places = find_places(edge_maps, rods, scene.motor_range_rad)
    best = max(_refined_fits(places, scene), key=_score_of)
    if best.score < _LEAST_SCORE:
        raise Refused(
            f"no {_name(rods)} is seen near the whisker; record with it in view of every camera"
        )
    return best.place


def _refined_fits(places: Sequence[Rounded], scene: SearchScene) -> list[RoundedFit]:
    """Fit places coarsely until one is surely the object, and return the best of them fitted finely."""
    fits = []
    for place in places:
        fits.append(fit_to_edges(place, scene, coarse=True))
        if fits[-1].score > _SURE_SCORE:
            break
    is_sure = fits[-1].score > _SURE_SCORE
    fits.sort(key=_score_of, reverse=True)
    best = fits[: 1 if is_sure else _REFINED]
    reaches_px = (_REACHES_PX[-1],) * _REFINEMENTS
    return [fit_to_edges(fit.place, scene, reaches_px, coarse=False) for fit in best]


def _score_of(fit: RoundedFit) -> float:
    """Return a fit's detection score, as a key to compare fits by."""
    return fit.score


def _name(rods: Rods) -> str:
    """Return the object's name with its size, for a message."""
    form = rods.bar.form
    return _NAMES[form.shape].format(
        ring=form.ring_diameter_mm,
        thick=rods.bar.diameter_mm,
        angle=np.degrees(form.half_angle_rad),
    )


def _see_ring(maps: Sequence[ChangeMap], scene: SearchScene) -> Rounded:
    """Find the ring that covers best what differs, after all likely places are fitted to the edges.

    Raises Refused where none covers it, or a second one as well.
    """
    rods = scene.rods
    objects_of = partial(touched_first, rods.bar.form, rods)
    places = find_rings(maps, rods, scene.motor_range_rad, objects_of)

    def score(ring: Rounded) -> float:
        return coverage_score(maps, ring, scene.radius_mm)

    best_covering = sorted(places, key=score, reverse=True)[:_REFINED]
    fits = [fit_to_edges(place, scene, coarse=True) for place in places]
    for place in best_covering:
        fits.append(fit_to_edges(place, scene, _NEAR_REACHES_PX, _NEAR_PRIOR, coarse=True))
    rings = [fit.place for fit in fits]
    scores = np.array([score(ring) for ring in rings])
    highest = np.max(scores)
    best = rings[int(np.argmax(scores))]
    if highest < _LEAST_COVERED:
        raise Refused(
            f"no {_name(rods)} is seen near the whisker; record with it in view of every camera"
        )
    distance_mm = np.array([np.linalg.norm(ring.point_mm - best.point_mm) for ring in rings])
    if np.max(scores[distance_mm > _APART_MM], initial=0.0) > _AS_COVERED * highest:
        raise Refused(
            f"a {_name(rods)} may be in either of two places; record with all of it in view of every camera"
        )
    return best


def fit_to_edges(
    place: Rounded,
    scene: SearchScene,
    reaches_px: Sequence[float] = _REACHES_PX,
    prior: np.ndarray = _PRIOR,
    *,
    coarse: bool,
) -> RoundedFit:
    """Fit an object to the edges near its silhouette, measured anew in each iteration.

    reaches_px: of each iteration, how far from the predicted silhouette edges are measured; a fit may converge at the
    shortest reach only. prior (5,): sigmas of an iteration, mm and rad. coarse: measure the edges quickly.
    """
    for reach_px in reaches_px:
        limbs = measure_limbs(
            scene.views,
            place,
            scene.radius_mm,
            scene.wires_px,
            scene.settings,
            reach_px,
            rough=coarse,
        )
        limbs = {name: limb for name, limb in limbs.items() if limb.asked}
        if not any(len(limb.points) for limb in limbs.values()):
            return RoundedFit(place, 0.0)
        before = place
        edges = {name: limb.points for name, limb in limbs.items()}
        place = fit_silhouette(place, scene.cameras, edges, scene.radius_mm, prior)
        moved_mm = np.linalg.norm(place.point_mm - before.point_mm)
        if reach_px == _REACHES_PX[-1] and moved_mm < _CONVERGED_MM:
            break
    scores = [
        _detection_score(place, scene.cameras[name], limb, scene.radius_mm)
        for name, limb in limbs.items()
    ]
    return RoundedFit(place, sum(scores) / len(scene.views))


def _detection_score(place: Rounded, camera: Camera, limb: Limb, radius_mm: float) -> float:
    """Compute how much more probable edges are on the silhouette than anywhere within reach, from -1 to 1.

    It is the mean log likelihood ratio over all segments that a whole silhouette has, over the most that one counts.
    """
    residual = _residuals(place, camera, limb.points, radius_mm)
    density = np.sqrt(2.0 * np.pi) * limb.points.sigma_px
    log_ratio = np.log(2.0 * _REACHES_PX[-1] / density) - 0.5 * residual**2
    total = np.sum(np.clip(log_ratio, -_MOST_NATS, _MOST_NATS))
    return float(total) / (2 * STRETCHES * _MOST_NATS)


def fit_silhouette(
    place: Rounded,
    cameras: Cameras,
    edges: Mapping[str, LinePoints],
    radius_mm: float,
    prior: np.ndarray = _PRIOR,
) -> Rounded:
    """Return the object whose silhouette passes through the edge points in each camera, by Gauss–Newton.

    edges: by camera. prior (5,): sigmas of two shifts across, two tilts and a shift along, mm and rad; what the edges
    do not determine stays as it was.
    """
    across = axis_frame(place.direction)

    def rows_of(vector: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        here = shifted_object(place, across, vector)
        return [
            _weighted_rows(here, across, cameras[name], points, radius_mm)
            for name, points in edges.items()
            if len(points)
        ]

    return shifted_object(place, across, settle(rows_of, prior, _STEPS, _GAUSS_NEWTON))


def shifted_object(place: Rounded, across: np.ndarray, vector: np.ndarray) -> Rounded:
    """Return the object moved by two shifts across, two tilts and a shift along its axis, vector (..., 5)."""
    shifted = shifted_axis(place, across, vector)
    return replace(shifted, point_mm=shifted.point_mm + vector[..., 4:] * place.direction)


def _residuals(places: Rounded, camera: Camera, points: LinePoints, radius_mm: float) -> np.ndarray:
    """Compute how far, in sigmas, edge points (n,) lie outside an object's silhouette: (n,), of a batch (m, n)."""
    near = sights_beside(camera, places, points.px, points.place)
    outside_px = (near.outside_mm - radius_mm) * near.px_per_mm(camera, points.normal)
    return outside_px / points.sigma_px


def _weighted_rows(
    place: Rounded, across: np.ndarray, camera: Camera, points: LinePoints, radius_mm: float
) -> tuple[np.ndarray, np.ndarray]:
    """Compute the residuals (n,) of edge points over sigma, robustly weighted, and minus their Jacobian (n, 5)."""
    steps = np.concatenate([np.zeros((1, 5)), np.diag(_STEPS)])
    places = shifted_object(place, across, steps)
    residual, *stepped = _residuals(places, camera, points, radius_mm)
    weight = np.sqrt(cauchy_weights(residual, _CAUCHY_SIGMAS))
    columns = -(np.array(stepped) - residual).T / _STEPS
    return residual * weight, columns * weight[:, None]


def find_places(
    edge_maps: Sequence[EdgeMap], rods: Rods, motor_rad: tuple[float, float]
) -> list[Rounded]:
    """Find spheres or cones whose silhouettes have the strongest edges in all cameras, the best first.

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

    They are where along the whisker it is first touched, mm; at which motor angle, rad; the slope there, rad; and of a
    cone the log of its radius there, mm, and on which side its tip is, -1 or 1.
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

    Numbers of a hypothesis: see `hypothesis_values`; of a ring a tilt, rad, and its turn about the tangent, rad, follow
    the slope.
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
        return np.einsum("nij,nj->ni", motor, vectors)

    return Rounded(turned(point), turned(direction), form, turned(spot))


@dataclass(frozen=True)
class SilhouetteScore:
    """Score of hypothetical objects: edge strength along both sides of their silhouettes, over all cameras.

    objects_of: function of hypotheses (n, k) that returns the objects.
    """

    edge_maps: Sequence[EdgeMap]
    objects_of: Callable[[np.ndarray], Rounded]
    radius_mm: float

    def __call__(self, hypotheses: np.ndarray) -> np.ndarray:
        """Return the scores (n,) of hypotheses (n, k), from 0 to 1."""
        return score_in_batches(self._score, hypotheses, _BATCH)

    def _score(self, hypotheses: np.ndarray) -> np.ndarray:
        """Return the scores (n,) of a batch: the mean of the cameras, geometric where one has no silhouette."""
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
        """Compute the strength (n,) of both sides in one camera: their geometric mean, NaN without a silhouette."""
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
