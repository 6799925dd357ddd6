"""The first pass over a whisk by traces alone: the whisker's rest shape, then its bend by frame.

It does for traces what `vision.fit.first_bends` does for pictures: to a pixel or two, near enough for
the points of a trace that are the wire's. A trace that is of no wire which swings as the motor does is
named here, with what may be wrong with it.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from vision.fit.blocks import REST_PRIOR_MM
from vision.fit.first_bends import (
    PIECE_PX,
    BendModel,
    bends_in_order,
    fit_bend,
    fit_rest,
)
from vision.geometry.camera import Camera, Cameras
from vision.geometry.centreline import REST_POWERS, Curves, unbent_curves
from vision.geometry.contact import BarAxis
from vision.geometry.refusals import Refused
from vision.geometry.rods import Rods
from vision.geometry.touched import Axis
from vision.truth.misread_traces import misreadings
from vision.truth.trace_points import (
    NEAR_PX,
    BesideWire,
    Trace,
    averaged,
    beside_wire,
    closest_lines,
)
from vision.wire.points import LinePoints, Observed
from vision.wire.trace import NEAR_CLAMP_MM, observed

# [px] One sigma of a coarse point: trackers' 0.3 px and what is smooth. Stated.
_COARSE_PX = 0.5
# [1] Of −2 log prior density of a rest shape: seven of its sigmas. Stated.
_MOST_UNLIKELY = 49.0
# [1] Likewise: four sigmas, of a rest shape that explains what is wrong with a trace. Stated.
_LIKELY = 16.0
# [1] By which a misfit falls where a trace is surely meant otherwise: five sigmas. Stated.
_SURELY = 25.0
# [passes] Over the rest shape: places along the wire follow from the curve of the pass before. Derived.
_REST_PASSES = 3
# [passes] Over each bend, which begins nearer. Derived.
_BEND_PASSES = 2

Traces = Mapping[str, Trace]


@dataclass(frozen=True, eq=False)
class _TracedRest:
    """A rest shape (2, 4), mm, by traces.

    unlikeliness: −2 log of its prior density, up to a constant. misfit: that and the points' χ², of which each is bounded.
    """

    rest_mm: np.ndarray
    unlikeliness: float
    misfit: float


def find_traced_rest(
    traces: Traces, cameras: Cameras, rods: Rods, motor_rad: Mapping[int, float]
) -> np.ndarray:
    """Return the rest shape (2, 4), mm, by the traces of frames in which nothing touches.

    motor_rad: by frame. Raises Refused where the traces are of no wire that is held at the hub and
    swings as the motor does, saying what would make them one.
    """
    as_read = _fit_traced_rest(traces, cameras, rods, motor_rad)
    best = as_read
    cause = "is it of another trial or another camera?"
    for said, meant in _otherwise_meant(traces, cameras):
        other = _fit_traced_rest(meant, cameras, rods, motor_rad)
        if other.misfit < best.misfit and other.unlikeliness < _LIKELY:
            best = other
            cause = said
    is_misread = best.misfit < as_read.misfit - _SURELY
    if is_misread or not as_read.unlikeliness < _MOST_UNLIKELY:
        found = "the traces are of no wire that is held at the hub and swings as the motor does"
        raise Refused(f"{found}; {cause}", code="trace_elsewhere")
    return as_read.rest_mm


def follow_traced_bends(
    traces: Traces,
    cameras: Cameras,
    rods: Rods,
    axis: Axis,
    rest_mm: np.ndarray,
    motor_rad: Mapping[int, float],
) -> dict[int, np.ndarray]:
    """Return the bend (2,) in rad of every frame in order, each searched for near the extrapolation
    of the last two.
    """

    def find(frame: int, motor: float, bend_rad: np.ndarray) -> np.ndarray:
        """Return the bend of one frame, beginning near a guess."""
        for _ in range(_BEND_PASSES):
            model = BendModel.near(cameras.cameras, rest_mm, axis, rods.wire, motor, bend_rad)
            predicted = {frame: model.curves(bend_rad)}
            points = []
            for camera in cameras:
                points.append(_as_points(_beside(traces[camera.name], camera, predicted)))
            bend_rad = fit_bend(model, bend_rad, points)
        return bend_rad

    return bends_in_order(motor_rad, find)


def _fit_traced_rest(
    traces: Traces, cameras: Cameras, rods: Rods, motor_rad: Mapping[int, float]
) -> _TracedRest:
    """Return the rest shape that fits all traces best; one that is nowhere likely where a camera has no point."""
    nowhere = BarAxis(np.array([0.5 * rods.wire.length_mm, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    rest_mm = np.zeros((2, REST_POWERS))
    for _ in range(_REST_PASSES):
        seen = _resting_points(traces, cameras, rods, motor_rad, rest_mm)
        if len({one.camera for one in seen}) < len(cameras):
            return _TracedRest(rest_mm, np.inf, np.inf)
        rest_mm = fit_rest(seen, cameras, rods, nowhere, motor_rad)
    unlikeliness = float(np.sum((rest_mm / REST_PRIOR_MM) ** 2))
    chi2 = _bounded_chi2(traces, cameras, unbent_curves(rest_mm, motor_rad, rods.wire))
    return _TracedRest(rest_mm, unlikeliness, unlikeliness + chi2)


def _bounded_chi2(traces: Traces, cameras: Cameras, curves: Mapping[int, Curves]) -> float:
    """Return the χ² of all traces about a wire, each point's bounded by NEAR_PX."""
    chi2 = 0.0
    for camera in cameras:
        offset_px = _beside(traces[camera.name], camera, curves).offset_px
        chi2 += np.sum((np.minimum(np.abs(offset_px), NEAR_PX) / _COARSE_PX) ** 2)
    return float(chi2)


def _resting_points(
    traces: Traces,
    cameras: Cameras,
    rods: Rods,
    motor_rad: Mapping[int, float],
    rest_mm: np.ndarray,
) -> list[Observed]:
    """Return coarse points of all traces near a wire of a rest shape."""
    curves = unbent_curves(rest_mm, motor_rad, rods.wire)
    seen: list[Observed] = []
    for number, camera in enumerate(cameras):
        beside = _beside(traces[camera.name], camera, curves)
        seen += observed(_as_points(beside), beside.frame, number, list(curves))
    return seen


def _beside(trace: Trace, camera: Camera, curves: Mapping[int, Curves]) -> BesideWire:
    """Return a point for each segment of the line that is closest to the wire in each frame."""
    beside = closest_lines(beside_wire(trace, camera, curves))
    beside = beside.select(beside.place_mm > NEAR_CLAMP_MM)
    return averaged(beside, PIECE_PX) if len(beside.frame) else beside


def _as_points(beside: BesideWire) -> LinePoints:
    """Return coarse points as line points."""
    return LinePoints(
        px=beside.foot_px + beside.offset_px[:, None] * beside.normal,
        normal=beside.normal,
        sigma_px=np.full(len(beside.frame), _COARSE_PX),
        place=beside.place_mm,
    )


def _otherwise_meant(traces: Traces, cameras: Cameras) -> Iterator[tuple[str, dict[str, Trace]]]:
    """Yield what may be wrong, in words, and the traces as they are meant then.

    One thing may be wrong with all of them, or with one camera's.
    """
    of_all: dict[str, dict[str, Trace]] = {}
    for camera in cameras:
        for said, meant in misreadings(traces[camera.name], camera):
            of_all.setdefault(said, {})[camera.name] = meant
            if len(cameras) > 1:
                yield f"camera {camera.name}: {said}", {**traces, camera.name: meant}
    yield from of_all.items()
