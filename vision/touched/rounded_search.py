"""Where a ring, sphere or cone is in space, before any wire is known.

A search gives the dozen or so places where the object may be: of a sphere or a cone by its
silhouette (`vision.touched.silhouette_score`), of a ring by what it covers
(`vision.touched.coverage`). Each of these places is then fitted to the edges
(`vision.touched.rounded_fit`). Of spheres and cones the place with the highest detection score
wins. Of rings the one wins that covers best what differs from the picture without rods; it is
refused where a second place covers it as well.
"""

from collections.abc import Sequence

import numpy as np

from vision.geometry.refusals import Refused
from vision.geometry.rods import Bar, Rods
from vision.geometry.rounded import RoundedAxis
from vision.touched.coverage import ChangeMap, coverage_score, find_covering
from vision.touched.edge_map import compute_edge_map
from vision.touched.rounded_fit import REACHES_PX, RoundedFit, fit_to_edges
from vision.touched.search_scene import SearchScene
from vision.touched.silhouette_score import find_silhouettes

# [mm] Half the width of a bar whose edges are as sharp as those of the object. Stated.
_EDGE_MM = 3.0
# [px] Reaches of a ring that is also fitted close to where it covers what differs: its edges alone
# led 22 mm away from an upright one. By 4 and 4 a ring's d_x moves by 0.3 sigma. Study:
# thresholds.py touched.rounded_search _NEAR_REACHES_PX … --sessions FOLDER.
_NEAR_REACHES_PX = (5.0, 4.0, 4.0)
# [mm, rad] Prior sigmas of that fit. Twice as wide, a ring's slope moves by 0.1 sigma. Study:
# thresholds.py touched.rounded_search _NEAR_PRIOR … --sessions FOLDER.
_NEAR_PRIOR = np.array([1.5, 1.5, 0.02, 0.02, 1.5])
# [1] Least score of how well a ring covers what differs: true ones have 0.37 to 0.8. Study:
# rounded_seen.py.
_LEAST_COVERED = 0.3
# [1] A second place with more than this share of the best score is a refusal. Study:
# rounded_seen.py.
_AS_COVERED = 0.95
# [mm] Two places of a ring so far apart are different ones. Study: rounded_seen.py.
_APART_MM = 5.0
# [1] Least detection score: true places have 0.15 to 0.73, wrong ones 0.14 at most in seven
# scenes. Study: rounded_seen.py.
_LEAST_SCORE = 0.1
# [1] At a higher detection score no other place is tried. Study: rounded_seen.py.
_SURE_SCORE = 0.5
# [places] That are refined. 1 or 6 move no cone. Study: thresholds.py touched.rounded_search
# _REFINED … --sessions FOLDER.
_REFINED = 3
# [iterations] Of a refinement; one of 24 cones had converged 0.6 mm off. 3 or 10 move no cone.
# Study: thresholds.py touched.rounded_search _REFINEMENTS … --sessions FOLDER.
_REFINEMENTS = 5


def find_by_silhouette(scene: SearchScene) -> RoundedAxis:
    """Find a sphere or a cone, by the edges of its silhouette.

    Raises Refused where it is not seen.
    """
    rods = scene.rods
    as_sharp = Rods(rods.wire, Bar(2.0 * _EDGE_MM))
    middle_rad = scene.mid_motor_rad
    edge_maps = [compute_edge_map(view, as_sharp, middle_rad) for view in scene.views]
    places = find_silhouettes(edge_maps, scene)
    best = max(_refined_fits(places, scene), key=_score_of)
    if best.score < _LEAST_SCORE:
        raise _not_seen(rods)
    return best.place


def find_by_coverage(scene: SearchScene) -> RoundedAxis:
    """Find the ring that covers best what differs, after all likely places are fitted to the edges.

    Raises Refused where none covers it, or a second one as well.
    """
    rods = scene.rods
    maps = [ChangeMap.from_view(view) for view in scene.views]
    rings = _fitted_rings(find_covering(maps, scene), maps, scene)
    scores = np.array([coverage_score(maps, ring, scene.radius_mm) for ring in rings])
    highest = np.max(scores)
    best = rings[int(np.argmax(scores))]
    if highest < _LEAST_COVERED:
        raise _not_seen(rods)
    distance_mm = np.array([np.linalg.norm(ring.point_mm - best.point_mm) for ring in rings])
    if np.max(scores[distance_mm > _APART_MM], initial=0.0) > _AS_COVERED * highest:
        raise Refused(
            f"a {rods.bar.label} may be in either of two places; "
            "record with all of it in view of every camera",
            code="object_in_two_places",
        )
    return best


def _fitted_rings(
    places: Sequence[RoundedAxis], maps: Sequence[ChangeMap], scene: SearchScene
) -> list[RoundedAxis]:
    """Fit all places of a ring to the edges, and those that cover most also close to themselves."""

    def score(ring: RoundedAxis) -> float:
        """Return how well a ring covers what differs."""
        return coverage_score(maps, ring, scene.radius_mm)

    best_covering = sorted(places, key=score, reverse=True)[:_REFINED]
    fits = [fit_to_edges(place, scene, coarse=True) for place in places]
    for place in best_covering:
        fits.append(fit_to_edges(place, scene, _NEAR_REACHES_PX, _NEAR_PRIOR, coarse=True))
    return [fit.place for fit in fits]


def _refined_fits(places: Sequence[RoundedAxis], scene: SearchScene) -> list[RoundedFit]:
    """Fit places coarsely until one is surely the object; fit the best of them finely."""
    fits = []
    for place in places:
        fits.append(fit_to_edges(place, scene, coarse=True))
        if fits[-1].score > _SURE_SCORE:
            break
    is_sure = fits[-1].score > _SURE_SCORE
    fits.sort(key=_score_of, reverse=True)
    best = fits[: 1 if is_sure else _REFINED]
    reaches_px = (REACHES_PX[-1],) * _REFINEMENTS
    return [fit_to_edges(fit.place, scene, reaches_px, coarse=False) for fit in best]


def _score_of(fit: RoundedFit) -> float:
    """Return a fit's detection score, as a key to compare fits by."""
    return fit.score


def _not_seen(rods: Rods) -> Refused:
    """Return the refusal of pictures that do not show the object."""
    return Refused(
        f"no {rods.bar.label} is seen near the whisker; record with it in view of every camera",
        code="no_object_seen",
    )
