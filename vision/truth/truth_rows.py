"""From the fit to rows: values with sigmas, statuses, and lines to draw on the pictures."""

from dataclasses import replace
from functools import singledispatch

import numpy as np

from vision.fit.covariance import variance_by_cause
from vision.fit.line_noise import line_noise
from vision.fit.problem import bar_axes, bar_axis, bends, curves_of, rest_shape, shifts_mm
from vision.geometry.camera import Camera
from vision.geometry.reasons import Reason, joined
from vision.geometry.rounded import Rounded
from vision.geometry.touched import Axis, Touched
from vision.pictures.pyramid import full_px
from vision.truth.at_angle import Smooth
from vision.truth.records import FrameTruth, GaveWay, SeenObject, WhiskTruth, WireShape
from vision.truth.value import FIELDS, Value
from vision.truth.whisk_pictures import FittedWhisk, WhiskPictures

# [frame intervals] Of the median one, beyond which a frame was lost: between one and two.
# Derived.
_MOST_GAP = 1.5
# [rad] Beyond this sigma of the slope the status says so: two scenes of 380 were off by 9 and
# 49°, the latter at a stated 10°. Study: coverage.py points.
_DOUBTED_SLOPE_SIGMA_RAD = np.radians(3.0)
# [rad] Beyond this one nothing that is propagated linearly holds, and there is no truth: in one
# scene touch was 18 of its sigmas off. Study: coverage.py points.
_MOST_SLOPE_SIGMA_RAD = np.radians(20.0)
# [mm] Nor beyond this one of slip: in one view, with slip known to 5 mm, slope was 24° off at a
# stated 0.04°. Study: coverage.py alone.
_MOST_SLIP_SIGMA_MM = 1.0
# [mm] Of the bar that overlays draw, to either side of its point: a layout. Stated.
_DRAWN_MM = 40.0
# [points] Of each of its edges. A layout.
_DRAWN_POINTS = 81
_VECTORS = ("x", "y", "z")


def to_whisk(whisk: WhiskPictures, fitted: FittedWhisk) -> WhiskTruth:
    """The row of a whisk and its frames; its d_x is NaN and its status says why where the fit does not tell it."""
    touch, beta = _touch(whisk, fitted), fitted.of_whisk("beta")
    frames = _frames(whisk, fitted, touch)
    reasons = [
        Reason("frame_lost_at_touch", _lost_at_touch(whisk, touch.value)),
        Reason("touch_outside_frames", _outside(fitted, touch.value)),
        Reason("slope_vague", _slope_unresolved(beta.sigma)),
        Reason("slip_vague", _slip_unresolved(frames)),
    ]
    lost, outside, _, slip = reasons
    is_known = not (lost or outside or slip) and not beta.sigma > _MOST_SLOPE_SIGMA_RAD
    truth = _at_touch(fitted, touch, beta) | {"smooth": _smooth(fitted)} if is_known else {}
    return WhiskTruth(
        whisk.number,
        frames,
        cameras=len(whisk.views),
        frames_used=len(fitted.frames),
        status=joined(*reasons),
        overlay=_overlay(whisk, fitted),
        budget=_budget(fitted),
        lines=line_noise(fitted.problem),
        shape=_shape(fitted),
        velocity_mm_s=_velocity(whisk, fitted),
        gave=_gave(fitted) if whisk.gives is not None and is_known else None,
        rounded=_seen_object(fitted.problem.rods.bar, fitted) if is_known else None,
        problem=fitted.problem,
        **truth,
    )


@singledispatch
def _seen_object(touched: Touched, fitted: FittedWhisk) -> SeenObject | None:
    """Return where the object is, of a form that has a record for it; None of a bar."""
    return None


@_seen_object.register
def _seen_rounded(touched: Rounded, fitted: FittedWhisk) -> SeenObject:
    """Return where an object that is no straight bar is, with its stated sizes."""
    axis = bar_axis(fitted.problem, fitted.state.vector)
    sizes = touched.sizes
    return SeenObject(
        touched.name,
        axis.point_mm,
        axis.direction,
        touched.radius_mm,
        0.5 * sizes.ring_diameter_mm,
        sizes.half_angle_rad,
    )


def _velocity(whisk: WhiskPictures, fitted: FittedWhisk) -> Value | None:
    """Of a bar that moves, as told and seen, mm/s (3,)."""
    if whisk.told is None:
        return None
    own = fitted.problem.blocks.motion.slice
    sigma = np.sqrt(np.diag(fitted.covariance)[own])
    return Value(whisk.told.velocity_mm_s + fitted.state.vector[own], sigma)


def _gave(fitted: FittedWhisk) -> GaveWay:
    """How far a bar that gives way has come in each touching frame, away from the contact and across that."""
    problem = fitted.problem
    by = problem.motion.by_values(fitted.state.vector[problem.blocks.motion.slice])
    keep, axis = problem.touching, bar_axes(problem, fitted.state.vector)
    point = np.stack([fitted.measured.frame[name] for name in _VECTORS], axis=1)
    direction = axis.direction[0]
    normal = (axis.point_mm - point) @ (np.eye(3) - np.outer(direction, direction))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    own, came = (
        fitted.covariance[problem.blocks.motion.slice, problem.blocks.motion.slice],
        shifts_mm(problem, fitted.state.vector),
    )
    found = []
    for way in (normal, np.cross(direction, normal)):
        rows = np.einsum("kfi,fi->fk", by, way)[keep]
        sigma = np.sqrt(np.einsum("fk,kl,fl->f", rows, own, rows))
        found.append(Value(np.sum(came * way, axis=1)[keep], sigma))
    index = np.array(fitted.frames)[keep]
    return GaveWay(index, problem.motor_rad[keep] - float(fitted.measured.whisk["touch"]), *found)


def _touch(whisk: WhiskPictures, fitted: FittedWhisk) -> Value:
    """Motor angle of first touch, rad; a clock that is off moves it."""
    touch = fitted.of_whisk("touch")
    speed_rad_s = _speed(whisk.time_s[fitted.frames], fitted.problem.motor_rad, touch.value)
    return Value(
        touch.value, float(np.hypot(touch.sigma, whisk.settings.clock_sigma_s * speed_rad_s))
    )


def _at_touch(fitted: FittedWhisk, touch: Value, beta: Value) -> dict[str, Value | np.ndarray]:
    point = [fitted.of_whisk(name) for name in _VECTORS]
    by = np.stack([fitted.by_parameter.whisk[name] for name in _VECTORS])
    return {
        "touch_rad": touch,
        "d_x_mm": fitted.of_whisk("d_x"),
        "beta_rad": beta,
        "psi_rad": fitted.of_whisk("psi"),
        "point_mm": Value(np.array([p.value for p in point]), np.array([p.sigma for p in point])),
        "point_covariance_mm2": by @ fitted.covariance @ by.T,
    }


def _shape(fitted: FittedWhisk) -> WireShape:
    problem, state = fitted.problem, fitted.state
    return WireShape(
        rest_shape(problem, state.vector),
        np.array(fitted.frames),
        bends(problem, state.vector),
        state.arcs_mm,
    )


def _speed(time_s, motor_rad, at_rad: float) -> float:
    """Motor speed in rad/s near an angle."""
    nearest = int(np.clip(np.argmin(np.abs(motor_rad - at_rad)), 1, len(motor_rad) - 1))
    return abs(motor_rad[nearest] - motor_rad[nearest - 1]) / max(
        time_s[nearest] - time_s[nearest - 1], 1e-9
    )


def _outside(fitted: FittedWhisk, touch_rad: float) -> str:
    """A touch that no frame brackets is a guess."""
    motor_rad = fitted.problem.motor_rad
    return (
        "" if motor_rad.min() <= touch_rad <= motor_rad.max() else "touch lies outside the frames"
    )


def _slope_unresolved(beta_sigma_rad: float) -> str:
    """A slope that only the priors of whole lines hold may be off by far more: nothing is linear there."""
    if beta_sigma_rad > _DOUBTED_SLOPE_SIGMA_RAD:
        return (
            f"the bar's slope is known to {np.degrees(beta_sigma_rad):.0f} deg only: no two cameras see it from "
            "different sides"
        )
    return ""


def _slip_unresolved(frames: FrameTruth) -> str:
    """Slip that is known to a millimetre or worse is not known, nor is where the whisker touches."""
    sigma_mm = float(np.max(frames.slip_mm.sigma[frames.touching], initial=0.0))
    if sigma_mm > _MOST_SLIP_SIGMA_MM:
        return f"slip is known to {sigma_mm:.1f} mm only, {_MOST_SLIP_SIGMA_MM:g} is allowed"
    return ""


def _lost_at_touch(whisk: WhiskPictures, touch_rad: float) -> str:
    """Reason where a frame next to touch was lost."""
    lost = sorted(set(whisk.indices) - set(whisk.frames))
    if not lost:
        return ""
    step = np.median(np.abs(np.diff(whisk.motor_rad[list(whisk.indices)])))
    near = [f for f in lost if abs(whisk.motor_rad[f] - touch_rad) < _MOST_GAP * step]
    return f"frame {near[0]} at touch was lost" if near else ""


def _smooth(fitted: FittedWhisk) -> Smooth:
    """What `WhiskTruth.at` needs of the touching frames."""
    problem, measured, by = fitted.problem, fitted.measured, fitted.by_parameter
    keep = problem.touching
    return Smooth(
        problem.motor_rad[keep] - measured.whisk["touch"],
        by.whisk["touch"],
        {name: measured.frame[name][keep] for name in FIELDS},
        {name: by.frame[name][keep] for name in FIELDS},
        fitted.covariance,
    )


def _frames(whisk: WhiskPictures, fitted: FittedWhisk, touch: Value) -> FrameTruth:
    """A row for every frame of the whisk, NaN for those not seen or not touching."""
    indices = np.array(whisk.indices)
    position = {f: k for k, f in enumerate(fitted.frames)}
    rows = np.array([position.get(f, -1) for f in whisk.indices])
    touching = (rows >= 0) & fitted.problem.touching[rows]
    columns = {
        name: Value(_column(of.value, rows, touching), _column(of.sigma, rows, touching))
        for name in (*_VECTORS, *FIELDS)
        for of in [fitted.of_frames(name)]
    }
    point = [columns[name] for name in _VECTORS]
    motor = whisk.motor_rad[indices]
    return FrameTruth(
        index=indices,
        time_s=whisk.time_s[indices],
        motor_rad=motor,
        touching=touching,
        theta_rad=Value(motor - touch.value, np.full(len(indices), touch.sigma)),
        point_mm=Value(
            np.stack([p.value for p in point], axis=1), np.stack([p.sigma for p in point], axis=1)
        ),
        arc_mm=_column(fitted.measured.frame["arc"], rows, touching),
        status=_statuses(whisk, fitted, rows),
        **{field: columns[name] for name, field in FIELDS.items()},
    )


def _column(values, rows, touching) -> np.ndarray:
    """Of the fit's frames (f,) those in these rows (n,), NaN where not touching."""
    return np.where(touching, values[rows], np.nan)


def _statuses(whisk: WhiskPictures, fitted: FittedWhisk, rows) -> tuple[str, ...]:
    """Why a frame has no values, or what is doubtful of them; empty where it touches, or surely does not."""
    at_touch = fitted.problem.bent & ~fitted.problem.touching
    slipped = [
        f"slipped during the exposure, by {rms:.3f} mm RMS" if rms else ""
        for rms in np.sqrt(fitted.exposure.variance_mm2)
    ]
    seen = ["at touch" if near else moved for near, moved in zip(at_touch, slipped)]
    return tuple(
        seen[row] if row >= 0 else "long before touch" if f in whisk.motor else "no picture"
        for f, row in zip(whisk.indices, rows)
    )


def _budget(fitted: FittedWhisk) -> dict[str, float]:
    """Shares of d_x's variance by cause; those that are known add up to 1."""
    parts = variance_by_cause(
        fitted.problem, fitted.state, fitted.uncertainty, fitted.by_parameter.whisk["d_x"]
    )
    whole = np.nansum(list(parts.values()))
    return {name: part / whole for name, part in parts.items()}


def _overlay(
    whisk: WhiskPictures, fitted: FittedWhisk
) -> dict[int, dict[str, dict[str, np.ndarray]]]:
    """Return per frame and camera the wire, the object's two edges (m, 2) and the contact (2,) px."""
    curves, _ = curves_of(fitted.problem, fitted.state.vector, fitted.state.arcs_mm)
    axes = bar_axes(fitted.problem, fitted.state.vector)
    contacts = np.stack([fitted.measured.frame[name] for name in _VECTORS], axis=1)
    scale = whisk.settings.picture_scale
    drawn: dict = {int(f): {} for f in fitted.frames}
    for view in whisk.views:
        camera = view.camera
        edges_px = _edges_px(axes, camera, whisk.rods.bar.radius_mm)
        for k, f in enumerate(fitted.frames):
            left, right = edges_px[min(k, len(edges_px) - 1)]
            lines = {
                "wire": camera.project(curves.points_mm[k]),
                "bar_left": left,
                "bar_right": right,
                "contact": camera.project(contacts[k : k + 1])[0],
            }
            drawn[int(f)][camera.name] = {name: full_px(px, scale) for name, px in lines.items()}
    return drawn


def _edges_px(axes: Axis, camera: Camera, radius_mm: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return both edges (m, 2) px in each frame, once of an object that stands still."""
    edges_px = []
    for point_mm, direction in zip(axes.point_mm, axes.direction):
        axis = replace(axes, point_mm=point_mm, direction=direction)
        edges_px.append(axis.edges_px(camera, radius_mm, _DRAWN_MM, _DRAWN_POINTS))
    return edges_px
