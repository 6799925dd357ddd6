"""A rounded object in space before any wire is known: looked for by its outline, then settled by its edges."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from vision.geometry.camera import Camera, Cameras
from vision.geometry.centreline import resting_lines, rotation_z
from vision.geometry.contact import axis_frame, shifted_axis
from vision.geometry.grazing import sights_beside
from vision.geometry.newton import cauchy_weights, settle
from vision.geometry.refusals import Refused
from vision.geometry.rods import Bar, Rods
from vision.geometry.rounded import Form, Rounded
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.change import HALF
from vision.pictures.view import View
from vision.touched.find import Clear, clear_edges, coarse_to_fine, half_steps, spread_out
from vision.touched.rings import Differs, filled, likely_rings
from vision.touched.silhouette_edges import (
    SEGMENTS_OF_SIDE,
    SilhouetteEdges,
    measure_silhouette_edges,
)
from vision.wire.points import LinePoints

# [mm] Half the width of a bar whose edges are as sharp as what is looked for. Stated.
_EDGE_MM = 3.0
# [half-widths, 1] By how much edges are spread, look by look, and how many places go on. Set by
# eye. Study: rounded_seen.py.
_SPREADS, _KEPT = (0.5, 0.2, 0.08), (24, 20, 12)
# [places] That are climbed from, of a grid. Set by eye. Study: rounded_seen.py.
_STARTS = 32
# Of each side of an outline that a place is judged by; up to so far from where it is touched: cones end.
_STATIONS, _OUTLINE_MM = 8, {"sphere": 30.0, "cone": 20.0}
# [rad] Slopes of the grid, as of a bar's. Stated.
_BETA_RAD = np.radians(np.arange(-78.0, 79.0, 6.0))
# [mm, 1] How thick a cone may be where it is touched; of what is told of it. Study:
# rounded_seen.py.
_CONE_RADII_MM, _ABOUT = (
    np.array([3.0, 6.0, 12.0, 24.0]),
    np.array([0.6, 1.0, 1.7]),
)
# [index] A layout: of the number that says on which side a cone's tip is.
_WAY = 4
# [mm] Steps of the grid along the whisker and along its swing: less than edges are spread.
# Stated.
_X_MM, _TOUCH_MM = 2.4, 2.4
# [places] Arrays that stay in the processor's cache. Not measured.
_AT_ONCE = 4000
# [px] Round by round, as a place is settled: rings came from 17 mm off. Study: rounded_seen.py.
_REACHES_PX = (9.0, 7.0, 5.0, *[4.0] * 8)
# [mm, rad] Of a round: keeps what no camera tells as it was. Stated.
_PRIOR = np.array([8.0, 8.0, 0.5, 0.5, 8.0])
# [px; mm, rad] Of a ring, which is also settled so near to where it fills what differs: its edges
# alone led 22 mm away from an upright one. Set by eye. Study: rounded_seen.py.
_NEAR_PX, _NEAR_PRIOR = (5.0, 4.0, 4.0), np.array([1.5, 1.5, 0.02, 0.02, 1.5])
# [1, 1, mm] How well a ring fills what differs: true ones 0.37 to 0.8; a second place so far away
# and filled so nearly as well is a status. Study: rounded_seen.py.
_LEAST_FILLED, _AS_FILLED, _APART_MM = 0.3, 0.95, 5.0
# [mm, rad] Of differences; a smaller step is the last. Stated.
_STEPS = np.array([1e-3, 1e-3, 1e-5, 1e-5, 1e-3])
# [steps] Gauss–Newton within a round; it ends before. Stated.
_ROUNDS = 6
# [nats] By one stretch for or against a place: odds of 20 to one. Derived.
_MOST_SAID = 3.0
# [mm] By so much a settled place moves at most: the fit does the rest. Stated.
_SETTLED_MM = 0.1
# [1] How clear a place is that holds the object: true ones 0.15 to 0.73, wrong ones 0.14 at most
# in seven scenes; beyond the second no other is asked for. Study: rounded_seen.py.
_LEAST_CLEAR, _SURE = 0.1, 0.5
# [places, looks] That are looked at closer by; one of 24 cones had been settled 0.6 mm beside.
# Set by eye. Study: rounded_seen.py.
_POLISHED, _POLISHES = 3, 5
# [wires] Over the stroke: where an outline may show the wire, too. Stated.
_WIRES = 8
_NAMES = {
    "ring": "ring of {ring:g} mm",
    "sphere": "sphere of {thick:g} mm",
    "cone": "cone of {angle:g} deg half-angle",
}


def see_rounded(
    views: Sequence[View],
    cameras: Cameras,
    rods: Rods,
    motor_rad: np.ndarray,
    settings: VisionSettings,
    still: Callable[[View], np.ndarray],
) -> Rounded:
    """Where it stands, by the pictures of all frames. still: a view's picture of what stands still, at every HALF-th
    pixel. Raises Refused where none is seen."""
    span = float(np.min(motor_rad)), float(np.max(motor_rad))
    wires = {
        view.camera.name: resting_lines(view.camera, rods.wire, np.linspace(*span, _WIRES))
        for view in views
    }
    if rods.bar.form.shape == "ring":
        return _see_ring(
            [Differs.of(view, still(view)) for view in views],
            views,
            cameras,
            rods,
            span,
            wires,
            settings,
        )
    small = Rods(rods.wire, Bar(2.0 * _EDGE_MM))
    clear = [
        clear_edges(view.camera, still(view), view.background[::HALF, ::HALF], small, sum(span) / 2)
        for view in views
    ]
    found: list[tuple[Rounded, float]] = []
    for axis in likely_places(clear, rods, span):
        found.append(settled(axis, views, cameras, rods, wires, settings))
        if found[-1][1] > _SURE:
            break
    best = sorted(found, key=lambda one: one[1], reverse=True)[
        : _POLISHED if found[-1][1] <= _SURE else 1
    ]
    axis, clearness = max(
        (polished(axis, views, cameras, rods, wires, settings) for axis, _ in best),
        key=lambda one: one[1],
    )
    if clearness < _LEAST_CLEAR:
        raise Refused(
            f"no {_name(rods)} is seen near the whisker; record with it in view of every camera",
            code="no_object_seen",
        )
    return axis


def _name(rods: Rods) -> str:
    form = rods.bar.form
    return _NAMES[form.shape].format(
        ring=form.ring_diameter_mm,
        thick=rods.bar.diameter_mm,
        angle=np.degrees(form.half_angle_rad),
    )


def _see_ring(
    seen: Sequence[Differs], views, cameras: Cameras, rods: Rods, span, wires, settings
) -> Rounded:
    """Of the places where a ring fills what differs, settled by its edges, that which fills it the best. Raises Refused
    where none does, or another as well."""
    places, radius_mm = (
        likely_rings(seen, rods, span, partial(placed, rods.bar.form, rods)),
        rods.bar.radius_mm,
    )
    looks = [(place, ()) for place in places]
    fullest = sorted(places, key=lambda one: -filled(seen, one, radius_mm))[:_POLISHED]
    looks += [(place, (_NEAR_PX, _NEAR_PRIOR)) for place in fullest]
    found = [settled(place, views, cameras, rods, wires, settings, *how)[0] for place, how in looks]
    shares = np.array([filled(seen, one, radius_mm) for one in found])
    best = found[int(np.argmax(shares))]
    if np.max(shares) < _LEAST_FILLED:
        raise Refused(
            f"no {_name(rods)} is seen near the whisker; record with it in view of every camera",
            code="no_object_seen",
        )
    apart = np.array([np.linalg.norm(one.point_mm - best.point_mm) for one in found]) > _APART_MM
    if np.max(shares[apart], initial=0.0) > _AS_FILLED * np.max(shares):
        raise Refused(
            f"a {_name(rods)} may be in either of two places; record with all of it in view of every camera",
            code="object_in_two_places",
        )
    return best


def polished(
    axis: Rounded,
    views: Sequence[View],
    cameras: Cameras,
    rods: Rods,
    wires: Mapping[str, Sequence[np.ndarray]],
    settings: VisionSettings,
) -> tuple[Rounded, float]:
    """`settled` by closer looks."""
    radius_mm = rods.bar.radius_mm
    for _ in range(_POLISHES):
        limbs = measure_silhouette_edges(views, axis, radius_mm, wires, settings, _REACHES_PX[-1])
        before = axis
        axis = settle_by_limbs(
            axis, cameras, {name: limb.points for name, limb in limbs.items()}, radius_mm
        )
        if np.linalg.norm(axis.point_mm - before.point_mm) < _SETTLED_MM:
            break
    return axis, sum(
        _clearness(axis, cameras[name], limb, radius_mm) for name, limb in limbs.items()
    ) / len(views)


def settled(
    axis: Rounded,
    views: Sequence[View],
    cameras: Cameras,
    rods: Rods,
    wires: Mapping[str, Sequence[np.ndarray]],
    settings: VisionSettings,
    reaches_px: Sequence[float] = _REACHES_PX,
    prior: np.ndarray = _PRIOR,
) -> tuple[Rounded, float]:
    """The object whose outline passes through the edges near that of a first one, and how clearly it is there, from
    -1 to 1: see `_clearness`, mean of the cameras."""
    radius_mm = rods.bar.radius_mm
    for reach_px in reaches_px:
        limbs = measure_silhouette_edges(
            views, axis, radius_mm, wires, settings, reach_px, coarse=True
        )
        limbs = {name: limb for name, limb in limbs.items() if limb.segments}
        if not any(len(limb.points) for limb in limbs.values()):
            return axis, 0.0
        before = axis
        axis = settle_by_limbs(
            axis, cameras, {name: limb.points for name, limb in limbs.items()}, radius_mm, prior
        )
        if (
            reach_px == _REACHES_PX[-1]
            and np.linalg.norm(axis.point_mm - before.point_mm) < _SETTLED_MM
        ):
            break
    return axis, sum(
        _clearness(axis, cameras[name], limb, radius_mm) for name, limb in limbs.items()
    ) / len(views)


def _clearness(axis: Rounded, camera: Camera, limb: SilhouetteEdges, radius_mm: float) -> float:
    """How much more probable edges are where an outline is than anywhere within reach: the mean logarithm over all
    stretches that a whole outline has, over the most that a stretch may say."""
    left, _ = _rows(axis, np.zeros((2, 3)), camera, limb.points, radius_mm, none=True)
    there = (
        np.log(2.0 * _REACHES_PX[-1] / (np.sqrt(2.0 * np.pi) * limb.points.sigma_px))
        - 0.5 * left**2
    )
    return float(np.sum(np.clip(there, -_MOST_SAID, _MOST_SAID))) / (
        2 * SEGMENTS_OF_SIDE * _MOST_SAID
    )


def settle_by_limbs(
    axis: Rounded,
    cameras: Cameras,
    limbs: Mapping[str, LinePoints],
    radius_mm: float,
    prior: np.ndarray = _PRIOR,
) -> Rounded:
    """The object whose outline passes through edges in each camera; what they cannot tell stays as it was."""
    across = axis_frame(axis.direction)

    def rows_of(vector):
        here = moved(axis, across, vector)
        return [
            _rows(here, across, cameras[name], points, radius_mm)
            for name, points in limbs.items()
            if len(points)
        ]

    return moved(axis, across, settle(rows_of, prior, _STEPS, _ROUNDS))


def moved(axis: Rounded, across: np.ndarray, vector: np.ndarray) -> Rounded:
    """Moved by two shifts, two tilts and a shift along itself, (…, 5)."""
    there = shifted_axis(axis, across, vector)
    return replace(there, point_mm=there.point_mm + vector[..., 4:] * axis.direction)


def _rows(
    axis: Rounded, across, camera: Camera, points: LinePoints, radius_mm: float, none: bool = False
):
    """What is left between points and outline over sigma, robustly weighted, and its Jacobian (n, 5)."""
    steps = np.zeros((1, 5)) if none else np.concatenate([np.zeros((1, 5)), np.diag(_STEPS)])
    near = sights_beside(camera, moved(axis, across, steps), points.px, points.place)
    off = (near.outside_mm - radius_mm) * near.px_per_mm(camera, points.normal) / points.sigma_px
    weight = 1.0 if none else np.sqrt(cauchy_weights(off[0], 5.0))
    columns = -(off[1:] - off[0]).T / (1.0 if none else _STEPS)
    return off[0] * weight, columns * (weight if none else weight[:, None])


def likely_places(
    clear: Sequence[Clear], rods: Rods, motor_rad: tuple[float, float]
) -> list[Rounded]:
    """Spheres or cones whose outlines stand out the most in all cameras, of those that the whisker would touch."""
    values, axis_of = hypotheses(rods, motor_rad)
    steps = half_steps(values)
    steps[_WAY:] = 0.0  # a tip is above or below, and nowhere between

    def score(spread: float) -> Callable:
        return partial(
            _clear_in_all,
            [spread_out(one, spread * one.half_px) for one in clear],
            axis_of,
            rods.bar.radius_mm,
        )

    looks = (
        (score(spread), spread / _SPREADS[0], 1.0, kept) for spread, kept in zip(_SPREADS, _KEPT)
    )
    found = axis_of(coarse_to_fine(values, steps, looks, 4.0, _STARTS))
    return [
        replace(
            found,
            point_mm=found.point_mm[k],
            direction=found.direction[k],
            spot_mm=found.spot_mm[k],
        )
        for k in range(len(found.point_mm))
    ]


def hypotheses(rods: Rods, motor_rad: tuple[float, float]) -> tuple[list[np.ndarray], Callable]:
    """Values of the numbers that say where the object is, and the objects (n, 3) that these (n, k) mean: where along
    the whisker it is first touched, mm; at which motor angle; the slope there; and of a cone what
    its shape leaves free."""
    length, form = rods.wire.length_mm, rods.bar.form
    x = np.arange(10.0, length, _X_MM)
    touch = np.linspace(
        *motor_rad, max(3, int(np.ceil(np.ptp(motor_rad) * 0.5 * length / _TOUCH_MM)))
    )
    more = {
        "sphere": [],
        "cone": [
            np.log(0.5 * form.about_mm * _ABOUT if form.about_mm else _CONE_RADII_MM),
            np.array([-1.0, 1.0]),
        ],
    }[form.shape]
    return [x, touch, _BETA_RAD, *more], partial(placed, form, rods)


def placed(form: Form, rods: Rods, each: np.ndarray) -> Rounded:
    """The objects (n, 3) that a straight whisker first touches so, see `hypotheses`."""
    x, touch, beta, *more = each.T
    zero = np.zeros_like(x)
    psi = more[0] if form.shape == "ring" else zero
    along = np.stack([np.sin(psi), np.cos(psi) * np.sin(beta), np.cos(psi) * np.cos(beta)], axis=-1)
    inwards = np.stack([zero, np.cos(beta), -np.sin(beta)], axis=-1)
    spot = np.stack([x, zero, zero], axis=-1) + rods.wire.radius_mm(x)[:, None] * inwards
    direction = along
    if form.shape == "sphere":
        point = spot + rods.bar.radius_mm * inwards
    elif form.shape == "ring":
        turn = more[1][:, None]
        towards = np.cos(turn) * inwards + np.sin(turn) * np.cross(along, inwards)
        point = spot + rods.bar.radius_mm * inwards + 0.5 * form.ring_diameter_mm * towards
        direction = np.cross(along, towards)
    else:
        radius, way = np.exp(more[0])[:, None], np.sign(more[1])[:, None]
        sin, cos = np.sin(form.half_angle_rad), np.cos(form.half_angle_rad)
        point = spot + radius * cos / sin * way * along
        direction = cos * way * along - sin * inwards
    turn = rotation_z(touch)
    point, direction, spot = (
        np.einsum("nij,nj->ni", turn, one) for one in (point, direction, spot)
    )
    return Rounded(point, direction, form, spot)


def _clear_in_all(
    clear: Sequence[Clear], axis_of: Callable, radius_mm: float, each: np.ndarray
) -> np.ndarray:
    """How clear both sides of the outlines of hypotheses (n, k) are, mean (n,) over the cameras, up to 1, geometric
    where some see no outline."""
    groups = np.array_split(each, -(-len(each) // _AT_ONCE))
    found = []
    for some in groups:
        each_sees = np.array([_outline_clear(axis_of(some), one, radius_mm) for one in clear])
        seen = np.isfinite(each_sees)
        if np.all(seen):
            found.append(np.mean(each_sees, axis=0))
            continue
        each_sees = np.where(seen, np.log(np.maximum(each_sees, 1e-3)), 0.0)
        mean = np.sum(each_sees, axis=0) / np.maximum(np.sum(seen, axis=0), 1)
        found.append(np.where(np.any(seen, axis=0), np.exp(mean), 0.0))
    return np.concatenate(found)


def _outline_clear(axis: Rounded, seen: Clear, radius_mm: float) -> np.ndarray:
    camera = seen.camera
    limb, normals = axis.limb(camera.centre_mm, radius_mm, _OUTLINE_MM[axis.form.shape], _STATIONS)
    px = camera.project(
        np.concatenate([limb.reshape(-1, 3), (limb + 0.2 * normals).reshape(-1, 3)])
    )
    px, beyond = np.split(px / HALF, 2)
    normal = beyond - px
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    x, y = np.nan_to_num(normal).T
    height, width = seen.field.shape[:2]
    column, row = (
        (np.fmin(np.fmax(one, 0.0), size - 1.0) + 0.5).astype(np.intp)
        for one, size in zip(np.nan_to_num(px.T), (width, height))
    )
    there = seen.field.reshape(-1, 3).take(row * width + column, axis=0).T
    edge = (x * x * there[0] + 2.0 * x * y * there[1] + y * y * there[2]).reshape(*limb.shape[:-1])
    edge[~np.isfinite(limb[..., 0])] = np.nan
    return np.sqrt(np.prod(np.mean(edge, axis=-1), axis=-1))
