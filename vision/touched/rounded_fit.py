"""Fit a ring, sphere or cone to the edges near its silhouette, from a place nearby.

The edges near the predicted silhouette are measured in every camera, the object is moved so that
its silhouette passes through them, and both are repeated within ever shorter reach until the object
moves no more. The detection score of a place is how much more probable edges are on its silhouette
than anywhere near it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vision.geometry.camera import Camera, Cameras
from vision.geometry.contact import axis_frame
from vision.geometry.grazing import sights_beside
from vision.geometry.newton import gauss_newton
from vision.geometry.rounded import RoundedAxis
from vision.touched.search_scene import SearchScene
from vision.touched.silhouette_edges import SEGMENTS_OF_SIDE, measure_silhouette_edges
from vision.wire.points import LinePoints

# [px] Within which edges are measured, iteration by iteration: rings came from 17 mm off. Study:
# rounded_seen.py.
REACHES_PX = (9.0, 7.0, 5.0, *[4.0] * 8)
# [mm, rad] Prior sigmas of one iteration: keep what no camera determines. Stated.
_PRIOR = np.array([8.0, 8.0, 0.5, 0.5, 8.0])
# [mm, rad] Steps of differences; a smaller Gauss–Newton step is the last. Stated.
_STEPS = np.array([1e-3, 1e-3, 1e-5, 1e-5, 1e-3])
# [steps] Gauss–Newton within an iteration: three in ten take more and go on in the next. Stated.
_GAUSS_NEWTON = 6
# [nats] Of one segment of a silhouette for or against a place: odds of 20 to one. Derived.
_MOST_NATS = 3.0
# [mm] A fit that moves the object by less has converged: the whisk's fit does the rest. Stated.
_CONVERGED_MM = 0.1


@dataclass(frozen=True)
class RoundedFit:
    """An object fitted to edges, and its detection score from -1 to 1, mean of the cameras."""

    place: RoundedAxis
    score: float


def fit_to_edges(
    place: RoundedAxis,
    scene: SearchScene,
    reaches_px: Sequence[float] = REACHES_PX,
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
        silhouettes = measure_silhouette_edges(scene.object_views, place, reach_px, coarse=coarse)
        edges = {name: one.points for name, one in silhouettes.items() if one.segments}
        if not any(len(points) for points in edges.values()):
            return RoundedFit(place, 0.0)
        before = place
        place, has_converged = fit_silhouette(place, scene.cameras, edges, scene.radius_mm, prior)
        moved_mm = np.linalg.norm(place.point_mm - before.point_mm)
        if has_converged and reach_px == REACHES_PX[-1] and moved_mm < _CONVERGED_MM:
            break
    total = 0.0
    for name, points in edges.items():
        total += _detection_score(place, scene.cameras[name], points, scene.radius_mm)
    return RoundedFit(place, total / len(scene.views))


def _detection_score(
    place: RoundedAxis, camera: Camera, points: LinePoints, radius_mm: float
) -> float:
    """Compute how much more probable edge points are on the silhouette than elsewhere, -1 to 1.

    It is the mean log likelihood ratio over all segments that a whole silhouette has, over the most
    that one counts.
    """
    residual = _residuals(place, camera, points, radius_mm)
    density = np.sqrt(2.0 * np.pi) * points.sigma_px
    log_ratio = np.log(2.0 * REACHES_PX[-1] / density) - 0.5 * residual**2
    total = np.sum(np.clip(log_ratio, -_MOST_NATS, _MOST_NATS))
    return float(total) / (2 * SEGMENTS_OF_SIDE * _MOST_NATS)


def fit_silhouette(
    place: RoundedAxis,
    cameras: Cameras,
    edges: Mapping[str, LinePoints],
    radius_mm: float,
    prior: np.ndarray = _PRIOR,
) -> tuple[RoundedAxis, bool]:
    """Fit the object whose silhouette passes through the edge points in each camera.

    edges: by camera. prior (5,): sigmas of two shifts across, two tilts and a shift along, mm and
    rad; what the edges do not determine stays as it was. The second value returned is whether the
    fit has converged.
    """
    across = axis_frame(place.direction)
    used = {name: points for name, points in edges.items() if len(points)}
    if not used:
        return place, True

    def moved(axis: RoundedAxis, vectors: np.ndarray) -> RoundedAxis:
        """Return an object moved by vectors (..., 5)."""
        return axis.shifted(across, vectors, vectors[..., 4:])

    def residuals_of(vectors: np.ndarray) -> np.ndarray:
        """Compute the residuals (m, n) of all cameras' edge points for vectors (m, 5).

        All but the first vector are small steps from the place that the first one gives.
        """
        here = moved(place, vectors[0])
        places = moved(here, vectors - vectors[0])
        residuals = [_residuals(places, cameras[name], used[name], radius_mm) for name in used]
        return np.concatenate(residuals, axis=1)

    vector, has_converged = gauss_newton(residuals_of, prior, _STEPS, _GAUSS_NEWTON)
    return moved(place, vector), has_converged


def _residuals(
    places: RoundedAxis, camera: Camera, points: LinePoints, radius_mm: float
) -> np.ndarray:
    """Compute how far edge points lie outside an object's silhouette, in sigmas.

    Returns (n,), of a batch of objects (m, n).
    """
    near = sights_beside(camera, places, points.px, points.place)
    outside_px = (near.outside_mm - radius_mm) * near.px_per_mm(camera, points.normal)
    return outside_px / points.sigma_px
