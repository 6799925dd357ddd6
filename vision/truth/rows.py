"""From the fit to rows: values with sigmas, statuses, and lines to draw on the pictures."""

from collections.abc import Collection, Sequence

import numpy as np

from vision.fit.problem import Problem, State, bar_axis, curves_of
from vision.fit.quantities import Jacobians, Measured
from vision.fit.uncertainty import Uncertainty, variance_by_cause
from vision.geometry.centreline import Curves
from vision.geometry.settings import VisionSettings
from vision.geometry.silhouette import normals, outline
from vision.truth.at_angle import Smooth
from vision.truth.records import FrameTruth, WhiskTruth

_MOST_GAP = 1.5  # of the median frame interval, beyond which a frame was lost
# Beyond this sigma of the slope two scenes of 380 were off by 9 and 49 degrees, the latter at a stated 10.
_TOLD_RAD = np.radians(3.0)
# Beyond this one nothing that is propagated linearly holds: in one scene touch was 18 of its sigmas off.
_MOST_UNTOLD_RAD = np.radians(20.0)
# Nor beyond this one of slip: in one view, with slip known to 5 mm, slope was 24 degrees off at a stated 0.04.
_MOST_UNTOLD_MM = 1.0
_VECTORS = ("x", "y", "z")
_PLAIN = ("slip", "longitudinal_slip", "d_y", "d_z", "phi", "alpha")


def to_whisk(number: int, indices: Sequence[int], seen: Sequence[int], time_s, motor_rad, problem: Problem,
             state: State, measured: Measured, by_parameter: Jacobians, known: Uncertainty, views,
             bar_radius_mm: float, settings: VisionSettings, far: Collection[int] = ()) -> WhiskTruth:
    """The row of a whisk and its frames. seen: the frames in the fit; far: those left out of it, long before touch."""
    covariance = known.covariance
    sigma = {name: float(np.sqrt(j @ covariance @ j)) for name, j in by_parameter.whisk.items()}
    value = {name: float(v) for name, v in measured.whisk.items()}
    clock = settings.clock_sigma_s * _speed(time_s[list(seen)], problem.motor_rad, value["touch"])
    sigma["touch"] = float(np.hypot(sigma["touch"], clock))
    frames = _frames(indices, seen, far, time_s, motor_rad, problem, measured, by_parameter, covariance,
                     value["touch"], sigma["touch"])
    lost = _lost_at_touch(indices, [*far, *seen], motor_rad, value["touch"])
    outside = _outside(problem, value)
    slip_untold = _slip_untold(frames)
    status = "; ".join(filter(None, [lost, outside, _slope_untold(sigma["beta"]), slip_untold]))
    untold = bool(lost or outside or slip_untold) or sigma["beta"] > _MOST_UNTOLD_RAD
    truth = {} if untold else {
        "d_x_mm": value["d_x"], "d_x_sigma_mm": sigma["d_x"], "touch_rad": value["touch"],
        "touch_sigma_rad": sigma["touch"], "beta_rad": value["beta"], "beta_sigma_rad": sigma["beta"],
        "psi_rad": value["psi"], "psi_sigma_rad": sigma["psi"],
        "point_mm": np.array([value[k] for k in _VECTORS]),
        "point_sigma_mm": np.array([sigma[k] for k in _VECTORS])}
    return WhiskTruth(number, frames, cameras=len(views), frames_used=len(seen), status=status,
                      overlay=_overlay(problem, state, measured, seen, views, bar_radius_mm),
                      smooth=None if untold else _smooth(problem, measured, by_parameter, covariance),
                      budget=_budget(problem, state, known, by_parameter.whisk["d_x"]), **truth)


def _speed(time_s, motor_rad, at_rad: float) -> float:
    """Motor speed in rad/s near an angle."""
    nearest = int(np.clip(np.argmin(np.abs(motor_rad - at_rad)), 1, len(motor_rad) - 1))
    return abs(motor_rad[nearest] - motor_rad[nearest - 1]) / max(time_s[nearest] - time_s[nearest - 1], 1e-9)


def _outside(problem: Problem, value) -> str:
    """A touch that no frame brackets is a guess."""
    if not problem.motor_rad.min() <= value["touch"] <= problem.motor_rad.max():
        return "touch lies outside the frames"
    return ""


def _slope_untold(beta_sigma_rad: float) -> str:
    """A slope that only the priors of whole lines hold may be off by far more: nothing is linear there."""
    if beta_sigma_rad > _TOLD_RAD:
        return (f"the bar's slope is known to {np.degrees(beta_sigma_rad):.0f} deg only: no two cameras see it from "
                "different sides")
    return ""


def _slip_untold(frames: FrameTruth) -> str:
    """Slip that is known to a millimetre or worse is not known, nor is where the whisker touches."""
    sigma_mm = float(np.max(frames.slip_sigma_mm[frames.touching], initial=0.0))
    if sigma_mm > _MOST_UNTOLD_MM:
        return f"slip is known to {sigma_mm:.1f} mm only, {_MOST_UNTOLD_MM:g} is allowed"
    return ""


def _lost_at_touch(indices, seen, motor_rad, touch_rad: float) -> str:
    """Reason where a frame next to touch was lost."""
    lost = sorted(set(indices) - set(seen))
    if not lost:
        return ""
    step = np.median(np.abs(np.diff(motor_rad[list(indices)])))
    near = [f for f in lost if abs(motor_rad[f] - touch_rad) < _MOST_GAP * step]
    return f"frame {near[0]} at touch was lost" if near else ""


def _smooth(problem: Problem, measured: Measured, by_parameter: Jacobians, covariance) -> Smooth:
    keep = problem.touching
    touch = by_parameter.whisk["touch"]
    return Smooth(problem.motor_rad[keep] - measured.whisk["touch"], touch,
                  {name: measured.frame[name][keep] for name in _PLAIN},
                  {name: by_parameter.frame[name][keep] for name in _PLAIN}, covariance)


def _frames(indices, seen, far, time_s, motor_rad, problem: Problem, measured: Measured, by_parameter: Jacobians,
            covariance, touch_rad: float, touch_sigma_rad: float) -> FrameTruth:
    """A row for every frame of the whisk, NaN for those not seen or not touching."""
    indices = np.array(list(indices))
    position = {f: k for k, f in enumerate(seen)}
    rows = np.array([position.get(f, -1) for f in indices])
    touching = np.array([r >= 0 and bool(problem.touching[r]) for r in rows])
    bent = np.array([r >= 0 and bool(problem.bent[r]) for r in rows])

    def column(values):
        out = np.full(len(indices), np.nan)
        out[touching] = values[rows[touching]]
        return out

    sigmas = {name: np.sqrt(np.maximum(np.einsum("fi,ij,fj->f", j, covariance, j), 0.0))
              for name, j in by_parameter.frame.items()}
    status = tuple("long before touch" if f in far else "no picture" if r < 0 else "" if t or not b else "at touch"
                   for f, r, t, b in zip(indices, rows, touching, bent))
    plain = {}
    for name in _PLAIN:
        unit = "rad" if name in ("phi", "alpha") else "mm"
        plain[f"{name}_{unit}"] = column(measured.frame[name])
        plain[f"{name}_sigma_{unit}"] = column(sigmas[name])
    motor = np.asarray(motor_rad)[indices]
    return FrameTruth(
        index=indices, time_s=np.asarray(time_s)[indices], motor_rad=motor, theta_rad=motor - touch_rad,
        theta_sigma_rad=np.full(len(indices), touch_sigma_rad), touching=touching,
        point_mm=np.stack([column(measured.frame[k]) for k in _VECTORS], axis=1),
        point_sigma_mm=np.stack([column(sigmas[k]) for k in _VECTORS], axis=1),
        arc_mm=column(measured.frame["arc"]), status=status, **plain)


def _budget(problem: Problem, state: State, known: Uncertainty, gradient) -> dict[str, float]:
    """Shares of the variance by cause; those that are told add up to 1."""
    parts = variance_by_cause(problem, state, known, gradient)
    whole = np.nansum(list(parts.values()))
    return {name: part / whole for name, part in parts.items()}


def _overlay(problem: Problem, state: State, measured: Measured, seen, views, bar_radius_mm: float) -> dict:
    """Per frame and camera: wire, the bar's two edges (m, 2) and the contact (2,) in pixels."""
    curves, _ = curves_of(problem, state.vector, state.arcs_mm)
    axis = bar_axis(problem, state.vector)
    place = np.linspace(-40.0, 40.0, 81)
    along = axis.point_mm + place[:, None] * axis.direction
    drawn: dict = {}
    for k, f in enumerate(seen):
        one = Curves(curves.arc_mm, curves.points_mm[k], curves.tangents[k])
        contact = np.array([[measured.frame[name][k] for name in _VECTORS]])
        drawn[int(f)] = {view.camera.name: _drawn(view.camera, one, along, axis, contact, bar_radius_mm)
                         for view in views}
    return drawn


def _drawn(camera, curve: Curves, along, axis, contact, bar_radius_mm: float) -> dict[str, np.ndarray]:
    middle, half = outline(camera, along, np.broadcast_to(axis.direction, along.shape), bar_radius_mm)
    aside = half[:, None] * normals(middle)
    return {"wire": camera.project(curve.points_mm), "bar_left": middle - aside, "bar_right": middle + aside,
            "contact": camera.project(contact)[0]}
