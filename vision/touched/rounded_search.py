"""Where a ring, sphere or cone is in space, before any wire is known.

A search gives the dozen or so places where the object may be: of a sphere or a cone by its
silhouette (`vision.touched.rounded_places`), of a ring by what it covers (`vision.touched.rings`).
Each of these places is then fitted to the edges: the edges beside the predicted silhouette are
measured in every camera, the object is moved so that its silhouette passes through them, and both
are repeated within ever shorter reach until the object moves no more. Of spheres and cones the
place with the highest detection score wins: how much more probable edges are on its silhouette than
anywhere near it. Of rings the one wins that covers best what differs from the picture without rods;
it is refused where a second place covers it as well.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.geometry.camera import Camera, Cameras
from vision.geometry.contact import axis_frame, shifted_axis
from vision.geometry.grazing import sights_beside
from vision.geometry.newton import cauchy_weights, gauss_newton
from vision.geometry.refusals import Refused
from vision.geometry.rods import Bar, Rods
from vision.geometry.rounded import Rounded
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.change import HALF
from vision.pictures.view import View
from vision.touched.edge_map import compute_edge_map
from vision.touched.rings import ChangeMap, coverage_score, find_rings
from vision.touched.rounded_places import find_places
from vision.touched.search_scene import SearchScene
from vision.touched.silhouette_edges import (
    SEGMENTS_OF_SIDE,
    SilhouetteEdges,
    measure_silhouette_edges,
)
from vision.wire.points import LinePoints

# [mm] Half the width of a bar whose edges are as sharp as those of the object. Stated.
_EDGE_MM = 3.0
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
    """An object fitted to edges, and its detection score from -1 to 1, mean of the cameras."""

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

    motor_rad (n,): motor angles of all frames. still: function that returns a view's picture (h, w)
    of what stands still, at every HALF-th pixel. Raises Refused where the object is not seen, or a
    ring may be in either of two places.
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
            f"no {_name(rods)} is seen near the whisker; record with it in view of every camera",
            code="no_object_seen",
        )
    return best.place


def _refined_fits(places: Sequence[Rounded], scene: SearchScene) -> list[RoundedFit]:
    """Fit places coarsely until one is surely the object; fit the best of them finely."""
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
    places = find_rings(maps, rods, scene.motor_range_rad)

    def score(ring: Rounded) -> float:
        """Return how well a ring covers what differs."""
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
            f"no {_name(rods)} is seen near the whisker; record with it in view of every camera",
            code="no_object_seen",
        )
    distance_mm = np.array([np.linalg.norm(ring.point_mm - best.point_mm) for ring in rings])
    if np.max(scores[distance_mm > _APART_MM], initial=0.0) > _AS_COVERED * highest:
        raise Refused(
            f"a {_name(rods)} may be in either of two places; "
            "record with all of it in view of every camera",
            code="object_in_two_places",
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

    reaches_px: of each iteration, how far from the predicted silhouette edges are measured; a fit
    may converge at the shortest reach only. prior (5,): sigmas of an iteration, mm and rad. coarse:
    measure the edges quickly.
    """
    for reach_px in reaches_px:
        silhouettes = measure_silhouette_edges(
            scene.views,
            place,
            scene.radius_mm,
            scene.wires_px,
            scene.settings,
            reach_px,
            coarse=coarse,
        )
        silhouettes = {
            name: silhouette for name, silhouette in silhouettes.items() if silhouette.segments
        }
        if not any(len(silhouette.points) for silhouette in silhouettes.values()):
            return RoundedFit(place, 0.0)
        before = place
        edges = {name: silhouette.points for name, silhouette in silhouettes.items()}
        place = fit_silhouette(place, scene.cameras, edges, scene.radius_mm, prior)
        moved_mm = np.linalg.norm(place.point_mm - before.point_mm)
        if reach_px == _REACHES_PX[-1] and moved_mm < _CONVERGED_MM:
            break
    scores = [
        _detection_score(place, scene.cameras[name], silhouette, scene.radius_mm)
        for name, silhouette in silhouettes.items()
    ]
    return RoundedFit(place, sum(scores) / len(scene.views))


def _detection_score(
    place: Rounded, camera: Camera, silhouette: SilhouetteEdges, radius_mm: float
) -> float:
    """Compute how much more probable edges are on the silhouette than elsewhere, -1 to 1.

    It is the mean log likelihood ratio over all segments that a whole silhouette has, over the most
    that one counts.
    """
    residual = _residuals(place, camera, silhouette.points, radius_mm)
    density = np.sqrt(2.0 * np.pi) * silhouette.points.sigma_px
    log_ratio = np.log(2.0 * _REACHES_PX[-1] / density) - 0.5 * residual**2
    total = np.sum(np.clip(log_ratio, -_MOST_NATS, _MOST_NATS))
    return float(total) / (2 * SEGMENTS_OF_SIDE * _MOST_NATS)


def fit_silhouette(
    place: Rounded,
    cameras: Cameras,
    edges: Mapping[str, LinePoints],
    radius_mm: float,
    prior: np.ndarray = _PRIOR,
) -> Rounded:
    """Fit the object whose silhouette passes through the edge points in each camera.

    edges: by camera. prior (5,): sigmas of two shifts across, two tilts and a shift along, mm and
    rad; what the edges do not determine stays as it was.
    """
    across = axis_frame(place.direction)

    def rows_of(vector: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Compute residuals and Jacobian of each camera at a step from the begin."""
        here = shifted_object(place, across, vector)
        return [
            _weighted_rows(here, across, cameras[name], points, radius_mm)
            for name, points in edges.items()
            if len(points)
        ]

    return shifted_object(place, across, gauss_newton(rows_of, prior, _STEPS, _GAUSS_NEWTON))


def shifted_object(place: Rounded, across: np.ndarray, vector: np.ndarray) -> Rounded:
    """Return the object moved by a vector (..., 5), mm and rad.

    The numbers are two shifts across its axis, two tilts, and a shift along it.
    """
    shifted = shifted_axis(place, across, vector)
    return replace(shifted, point_mm=shifted.point_mm + vector[..., 4:] * place.direction)


def _residuals(places: Rounded, camera: Camera, points: LinePoints, radius_mm: float) -> np.ndarray:
    """Compute how far edge points lie outside an object's silhouette, in sigmas.

    Returns (n,), of a batch of objects (m, n).
    """
    near = sights_beside(camera, places, points.px, points.place)
    outside_px = (near.outside_mm - radius_mm) * near.px_per_mm(camera, points.normal)
    return outside_px / points.sigma_px


def _weighted_rows(
    place: Rounded, across: np.ndarray, camera: Camera, points: LinePoints, radius_mm: float
) -> tuple[np.ndarray, np.ndarray]:
    """Compute weighted residuals (n,) of edge points, and minus their Jacobian (n, 5).

    Residuals are in sigmas, with Cauchy weights.
    """
    steps = np.concatenate([np.zeros((1, 5)), np.diag(_STEPS)])
    places = shifted_object(place, across, steps)
    residual, *stepped = _residuals(places, camera, points, radius_mm)
    weight = np.sqrt(cauchy_weights(residual, _CAUCHY_SIGMAS))
    columns = -(np.array(stepped) - residual).T / _STEPS
    return residual * weight, columns * weight[:, None]
