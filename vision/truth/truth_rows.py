"""From the fit to rows: values with sigmas, statuses, and lines to draw on the pictures."""

from collections.abc import Sequence
from dataclasses import replace
from functools import singledispatch

import numpy as np

from vision.fit.covariance import shared_covariance, variance_by_cause
from vision.fit.line_noise import line_noise
from vision.geometry.camera import Camera
from vision.geometry.centreline import whole_rest_mm
from vision.geometry.reasons import Reason, joined
from vision.geometry.rotation import unit
from vision.geometry.rounded import Rounded
from vision.geometry.touched import Axis, Touched
from vision.pictures.pyramid import full_px
from vision.truth.at_angle import Smooth
from vision.truth.records import (
    FrameTruth,
    GaveWay,
    SeenObject,
    SharedSigmas,
    WhiskTruth,
    WireShape,
)
from vision.truth.value import FIELDS, IN_HUB, Value, propagated_sigma
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
# [s] Between two frames, where it is divided by. Stated.
_LEAST_STEP_S = 1e-9
# [mm] Of the bar that overlays draw, to either side of its point: a layout. Stated.
DRAWN_MM = 40.0
# [points] Of each of its edges. A layout.
DRAWN_POINTS = 81
_VECTORS = ("x", "y", "z")


def to_whisk(whisk: WhiskPictures, fitted: FittedWhisk) -> WhiskTruth:
    """Return the row of a whisk and its frames.

    Its d_x is NaN and its status says why where the fit does not determine it.
    """
    touch = _touch(whisk, fitted)
    beta = fitted.of_whisk("beta")
    frames = _frames(whisk, fitted, touch)
    lost = Reason("frame_lost_at_touch", _lost_at_touch(whisk, touch.value))
    outside = Reason("touch_outside_frames", _outside(fitted, touch.value))
    slope = Reason("slope_vague", _slope_unresolved(beta.sigma))
    slip = Reason("slip_vague", _slip_unresolved(frames))
    in_common = shared_covariance(fitted)
    is_known = not (lost or outside or slip) and not beta.sigma > _MOST_SLOPE_SIGMA_RAD
    truth = WhiskTruth(
        whisk.number,
        frames,
        cameras=len(whisk.views),
        frames_used=len(fitted.frames),
        status=joined(lost, outside, slope, slip),
        overlay=_overlay(whisk, fitted),
        budget=_budget(fitted),
        lines=line_noise(fitted.problem),
        shape=_shape(fitted),
        smooth=_smooth(fitted, in_common),
        velocity_mm_s=_velocity(whisk, fitted),
        problem=fitted.problem,
    )
    return _with_contact(truth, whisk, fitted, touch, beta, in_common) if is_known else truth


def _with_contact(
    truth: WhiskTruth,
    whisk: WhiskPictures,
    fitted: FittedWhisk,
    touch: Value,
    beta: Value,
    in_common: np.ndarray,
) -> WhiskTruth:
    """Return the row of a whisk with all that a known contact adds.

    in_common (size, size): the part of the parameters' covariance that all whisks share.
    """
    point = [fitted.of_whisk(name) for name in _VECTORS]
    by_parameter = np.stack([fitted.by_parameter.whisk[name] for name in _VECTORS])
    return replace(
        truth,
        touch_rad=touch,
        d_x_mm=fitted.of_whisk("d_x"),
        beta_rad=beta,
        psi_rad=fitted.of_whisk("psi"),
        point_mm=_stacked(point),
        point_covariance_mm2=by_parameter @ fitted.covariance @ by_parameter.T,
        shared=_shared_sigmas(whisk, fitted, in_common),
        gave=None if whisk.gives is None else _gave(fitted),
        rounded=_seen_object(fitted.problem.rods.bar, fitted),
    )


def _shared_sigmas(
    whisk: WhiskPictures, fitted: FittedWhisk, covariance: np.ndarray
) -> SharedSigmas:
    """Return the sigmas by a covariance (size, size) of the parameters that all whisks share."""

    def sigma(name: str) -> float:
        """Return the standard deviation of a quantity of the whisk."""
        return float(propagated_sigma(fitted.by_parameter.whisk[name], covariance))

    def by_camera_error(name: str) -> np.ndarray:
        """Return how a quantity of the whisk changes (k,) with each unit error of the cameras."""
        return fitted.by_parameter.whisk[name] @ fitted.by_camera_error

    return SharedSigmas(
        touch_rad=float(np.hypot(sigma("touch"), _clock_sigma_rad(whisk, fitted))),
        d_x_mm=sigma("d_x"),
        beta_rad=sigma("beta"),
        psi_rad=sigma("psi"),
        point_mm=np.array([sigma(name) for name in _VECTORS]),
        d_x_by_camera_error_mm=by_camera_error("d_x"),
        beta_by_camera_error_rad=by_camera_error("beta"),
        psi_by_camera_error_rad=by_camera_error("psi"),
    )


def _stacked(values: Sequence[Value]) -> Value:
    """Return three values, of numbers or arrays (n,), as one of vectors (..., 3)."""
    value = np.stack([one.value for one in values], axis=-1)
    return Value(value, np.stack([one.sigma for one in values], axis=-1))


@singledispatch
def _seen_object(touched: Touched, fitted: FittedWhisk) -> SeenObject | None:
    """Return where the object is, of a form that has a record for it; None of a bar."""
    return None


@_seen_object.register
def _seen_rounded(touched: Rounded, fitted: FittedWhisk) -> SeenObject:
    """Return where an object that is no straight bar is, with its stated sizes."""
    axis = fitted.axis
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
    """Return the velocity of a bar that moves, as stated and seen, mm/s (3,); None of another."""
    if whisk.stated_velocity is None:
        return None
    own = fitted.problem.blocks.motion.slice
    sigma = np.sqrt(np.diag(fitted.covariance)[own])
    return Value(whisk.stated_velocity.velocity_mm_s + fitted.state.vector[own], sigma)


def _gave(fitted: FittedWhisk) -> GaveWay:
    """Return how far a bar that gives way has come in each touching frame.

    It is counted away from the contact and across that.
    """
    touching = fitted.problem.touching
    axis = fitted.axes
    direction = axis.direction[0]
    across_bar = np.eye(3) - np.outer(direction, direction)
    normal = unit((axis.point_mm - _contacts_mm(fitted)) @ across_bar)
    return GaveWay(
        index=np.array(fitted.frames)[touching],
        theta_rad=fitted.problem.motor_rad[touching] - float(fitted.measured.whisk["touch"]),
        normal_mm=_came(fitted, normal),
        lateral_mm=_came(fitted, np.cross(direction, normal)),
    )


def _came(fitted: FittedWhisk, way: np.ndarray) -> Value:
    """Return how far the bar has come along unit vectors (f, 3), in each touching frame, mm."""
    problem = fitted.problem
    own = problem.blocks.motion.slice
    by_motion = problem.motion.by_values(fitted.state.vector[own])  # (k, f, 3)
    rows = np.einsum("kfi,fi->fk", by_motion, way)[problem.touching]
    came_mm = np.sum(fitted.shifts_mm * way, axis=1)[problem.touching]
    return Value(came_mm, propagated_sigma(rows, fitted.covariance[own, own]))


def _contacts_mm(fitted: FittedWhisk) -> np.ndarray:
    """Return the contact (f, 3), mm, in each of the fit's frames."""
    return np.stack([fitted.measured.frame[name] for name in _VECTORS], axis=1)


def _touch(whisk: WhiskPictures, fitted: FittedWhisk) -> Value:
    """Return the motor angle of first touch, rad; its sigma counts the clock's."""
    touch = fitted.of_whisk("touch")
    return Value(touch.value, float(np.hypot(touch.sigma, _clock_sigma_rad(whisk, fitted))))


def _clock_sigma_rad(whisk: WhiskPictures, fitted: FittedWhisk) -> float:
    """Return the part of touch's sigma that comes from the frames' clock, rad."""
    touch_rad = float(fitted.measured.whisk["touch"])
    speed_rad_s = _speed(whisk.time_s[fitted.frames], fitted.problem.motor_rad, touch_rad)
    return whisk.settings.clock_sigma_s * speed_rad_s


def _shape(fitted: FittedWhisk) -> WireShape:
    """Return the shape of the wire at rest, and its bends."""
    return WireShape(
        whole_rest_mm(fitted.rest_mm, fitted.problem.wire),
        np.array(fitted.frames),
        fitted.bend_rad,
        fitted.state.arcs_mm,
    )


def _speed(time_s: np.ndarray, motor_rad: np.ndarray, at_rad: float) -> float:
    """Return the motor's speed, rad/s, near an angle."""
    nearest = int(np.argmin(np.abs(motor_rad - at_rad)))
    later = min(max(nearest, 1), len(motor_rad) - 1)
    step_rad = motor_rad[later] - motor_rad[later - 1]
    step_s = time_s[later] - time_s[later - 1]
    return abs(step_rad) / max(step_s, _LEAST_STEP_S)


def _outside(fitted: FittedWhisk, touch_rad: float) -> str:
    """Return the reason where no frames bracket the touch."""
    motor_rad = fitted.problem.motor_rad
    is_bracketed = motor_rad.min() <= touch_rad <= motor_rad.max()
    return "" if is_bracketed else "touch lies outside the frames"


def _slope_unresolved(beta_sigma_rad: float) -> str:
    """Return the reason where a slope is held by the priors of whole lines alone.

    It may be off by far more than its sigma: nothing is linear there.
    """
    if beta_sigma_rad > _DOUBTED_SLOPE_SIGMA_RAD:
        return (
            f"the bar's slope is known to {np.degrees(beta_sigma_rad):.0f} deg only: "
            "no two cameras see it from different sides"
        )
    return ""


def _slip_unresolved(frames: FrameTruth) -> str:
    """Return the reason where slip is known to a millimetre or worse: nor is the contact then."""
    sigma_mm = float(np.max(frames.slip_mm.sigma[frames.touching], initial=0.0))
    if sigma_mm > _MOST_SLIP_SIGMA_MM:
        return f"slip is known to {sigma_mm:.1f} mm only, {_MOST_SLIP_SIGMA_MM:g} is allowed"
    return ""


def _lost_at_touch(whisk: WhiskPictures, touch_rad: float) -> str:
    """Return the reason where a frame next to touch was lost."""
    lost = sorted(set(whisk.indices) - set(whisk.frames))
    if not lost:
        return ""
    step = np.median(np.abs(np.diff(whisk.motor_rad[list(whisk.indices)])))
    near = [f for f in lost if abs(whisk.motor_rad[f] - touch_rad) < _MOST_GAP * step]
    return f"frame {near[0]} at touch was lost" if near else ""


def _smooth(fitted: FittedWhisk, in_common: np.ndarray) -> Smooth:
    """Return what the touching frames determine, whether or not there is a truth.

    in_common (size, size): the part of the parameters' covariance that all whisks share.
    """
    measured = fitted.measured
    by_parameter = fitted.by_parameter
    touching = fitted.problem.touching
    names = (*FIELDS, *IN_HUB)
    return Smooth(
        fitted.problem.motor_rad[touching] - measured.whisk["touch"],
        by_parameter.whisk["touch"],
        {name: measured.frame[name][touching] for name in names},
        {name: by_parameter.frame[name][touching] for name in names},
        fitted.covariance,
        in_common,
        fitted.by_camera_error,
        float(measured.whisk["d_x"]),
    )


def _frames(whisk: WhiskPictures, fitted: FittedWhisk, touch: Value) -> FrameTruth:
    """Return a row for every frame of the whisk, NaN for those not seen or not touching."""
    indices = np.array(whisk.indices)
    rows = _rows_of(whisk, fitted)
    touching = (rows >= 0) & fitted.problem.touching[rows]

    def column(name: str) -> Value:
        """Return a quantity of the fit's frames for the rows of the whisk."""
        found = fitted.of_frames(name)
        value = _column(found.value, rows, touching)
        return Value(value, _column(found.sigma, rows, touching))

    motor_rad = whisk.motor_rad[indices]
    return FrameTruth(
        index=indices,
        time_s=whisk.time_s[indices],
        motor_rad=motor_rad,
        touching=touching,
        theta_rad=Value(motor_rad - touch.value, np.full(len(indices), touch.sigma)),
        point_mm=_stacked([column(name) for name in _VECTORS]),
        arc_mm=_column(fitted.measured.frame["arc"], rows, touching),
        status=_statuses(whisk, fitted, rows),
        **{field: column(name) for name, field in FIELDS.items()},
    )


def _rows_of(whisk: WhiskPictures, fitted: FittedWhisk) -> np.ndarray:
    """Return the number (n,) of each frame of the whisk among those of the fit, -1 without one."""
    position = {f: k for k, f in enumerate(fitted.frames)}
    return np.array([position.get(f, -1) for f in whisk.indices])


def _column(values: np.ndarray, rows: np.ndarray, touching: np.ndarray) -> np.ndarray:
    """Return values (f,) of the fit's frames in rows (n,), NaN where not touching."""
    return np.where(touching, values[rows], np.nan)


def _statuses(whisk: WhiskPictures, fitted: FittedWhisk, rows: np.ndarray) -> tuple[str, ...]:
    """Return why a frame has no values, or a warning; empty where it touches, or surely not."""
    at_touch = fitted.problem.bent & ~fitted.problem.touching
    slip_mm = np.sqrt(fitted.exposure.variance_mm2)
    statuses = []
    for f, row in zip(whisk.indices, rows):
        if row < 0:
            statuses.append("long before touch" if f in whisk.motor else "no picture")
        elif at_touch[row]:
            statuses.append("at touch")
        elif slip_mm[row]:
            statuses.append(f"slipped during the exposure, by {slip_mm[row]:.3f} mm RMS")
        else:
            statuses.append("")
    return tuple(statuses)


def _budget(fitted: FittedWhisk) -> dict[str, float]:
    """Return the shares of d_x's variance by cause; those that are known add up to 1."""
    gradient = fitted.by_parameter.whisk["d_x"]
    parts = variance_by_cause(fitted, gradient)
    whole = np.nansum(list(parts.values()))
    return {name: part / whole for name, part in parts.items()}


def _overlay(
    whisk: WhiskPictures, fitted: FittedWhisk
) -> dict[int, dict[str, dict[str, np.ndarray]]]:
    """Return per frame and camera the wire, the object's two edges (m, 2) and the contact (2,) px."""
    drawn: dict = {int(f): {} for f in fitted.frames}
    for view in whisk.views:
        for f, lines in zip(fitted.frames, _overlay_in(view.camera, whisk, fitted)):
            drawn[int(f)][view.camera.name] = lines
    return drawn


def _overlay_in(
    camera: Camera, whisk: WhiskPictures, fitted: FittedWhisk
) -> list[dict[str, np.ndarray]]:
    """Return what `_overlay` draws in one camera, by frame of the fit, in px of the full picture."""
    scale = whisk.settings.picture_scale
    edges_px = _edges_px(fitted.axes, camera, whisk.rods.bar.radius_mm)
    contacts_px = camera.project(_contacts_mm(fitted))
    drawn = []
    for k in range(len(fitted.frames)):
        left, right = edges_px[min(k, len(edges_px) - 1)]
        drawn.append(
            {
                "wire": full_px(camera.project(fitted.curves.points_mm[k]), scale),
                "bar_left": full_px(left, scale),
                "bar_right": full_px(right, scale),
                "contact": full_px(contacts_px[k], scale),
            }
        )
    return drawn


def _edges_px(axes: Axis, camera: Camera, radius_mm: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return both edges (m, 2) px in each frame, once of an object that stands still."""
    edges_px = []
    for point_mm, direction in zip(axes.point_mm, axes.direction):
        axis = replace(axes, point_mm=point_mm, direction=direction)
        edges_px.append(axis.edges_px(camera, radius_mm, DRAWN_MM, DRAWN_POINTS))
    return edges_px
