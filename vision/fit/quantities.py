"""From the fit's parameters to what a user asks for, and how its uncertainty carries over.

Definitions are those of the contact conventions: slip along the bar, deflection between the virtual point and the
contact in the contact frame, phi the direction of the deflection, alpha the angle from contact normal to force.
"""

from dataclasses import dataclass

import numpy as np

from vision.fit.differences import perturbed
from vision.fit.problem import (
    Problem,
    State,
    bar_axes,
    bar_axis,
    curves_of,
    rest_shape,
    shift_at_mm,
    shifts_mm,
)
from vision.fit.touch import FirstTouch, first_touch
from vision.geometry.centreline import REST_POWERS, Curves, centrelines
from vision.geometry.contact import BarAxis, bar_at, clearance, contact_frame_angles


@dataclass(frozen=True)
class Measured:
    """Values by name: globals (…,) and per frame (…, f)."""

    whisk: dict[str, np.ndarray]
    frame: dict[str, np.ndarray]


def measure(problem: Problem, vector: np.ndarray, arcs_mm: np.ndarray) -> Measured:
    """All quantities for one parameter vector or a batch (b, size)."""
    touch = first_touch(problem, vector)
    axis = bar_axis(problem, vector)
    each = bar_axes(problem, vector)
    curves, _ = curves_of(problem, vector, arcs_mm)
    _, arc, point = clearance(curves, each)
    touched = bar_at(axis, touch.point_mm)
    beta, psi = contact_frame_angles(touched.direction, touch.motor_rad)
    whisk = {
        "touch": touch.motor_rad,
        "d_x": np.linalg.norm(touch.point_mm, axis=-1),
        "beta": beta,
        "psi": psi,
        **{name: touch.point_mm[..., k] for k, name in enumerate("xyz")},
    }
    came = shifts_mm(problem, vector) - shift_at_mm(problem, vector, touch.motor_rad)[..., None, :]
    slip = np.sum(
        (point - touch.point_mm[..., None, :] - came) * touched.direction[..., None, :], axis=-1
    )
    d_y, d_z = _deflection(problem, vector, touch, point)
    alpha = _angle_to_normal(_force(curves, touch, arc, d_y, d_z), bar_at(each, point), point, beta)
    frame = {
        "slip": slip,
        "longitudinal_slip": arc - touch.arc_mm[..., None],
        "d_y": d_y,
        "d_z": d_z,
        "arc": arc,
        "phi": np.arctan2(d_z, d_y),
        "alpha": alpha,
        **{name: point[..., k] for k, name in enumerate("xyz")},
    }
    return Measured(whisk, frame)


def _deflection(problem: Problem, vector, touch: FirstTouch, point):
    """d_y = V_y - P_y and d_z = P_z - V_z (…, f) in the contact frame."""
    shape = point.shape[:-1]
    rest = np.broadcast_to(rest_shape(problem, vector)[..., None, :, :], (*shape, 2, REST_POWERS))
    motor = np.broadcast_to(problem.motor_rad, shape)
    unbent = centrelines(
        rest, np.zeros((*shape, 2)), np.full(shape, problem.wire.length_mm / 2), motor, problem.wire
    )
    cosine, sine = np.cos(touch.motor_rad)[..., None], np.sin(touch.motor_rad)[..., None]

    def forward(v):
        return cosine * v[..., 0] + sine * v[..., 1]

    wanted = forward(touch.point_mm[..., None, :])
    arc = np.broadcast_to(touch.arc_mm[..., None], shape)
    for _ in range(3):
        virtual, tangent = (a[..., 0, :] for a in unbent.at(arc[..., None]))
        arc = arc + (wanted - forward(virtual)) / forward(tangent)
    virtual, _ = unbent.at(arc[..., None])
    away = virtual[..., 0, :] - point
    return -sine * away[..., 0] + cosine * away[..., 1], -away[..., 2]


def _force(curves: Curves, touch: FirstTouch, arc, d_y, d_z):
    """Way (…, f, 3) in which the contact's force on the whisker points, across it: that in which it was bent, from the
    virtual point to the contact."""
    _, tangent = curves.at(arc[..., None])
    along = tangent[..., 0, :] / np.linalg.norm(tangent[..., 0, :], axis=-1, keepdims=True)
    cosine, sine = np.cos(touch.motor_rad)[..., None], np.sin(touch.motor_rad)[..., None]
    bent = np.stack([sine * d_y, -cosine * d_y, d_z], axis=-1)
    return bent - np.sum(bent * along, axis=-1, keepdims=True) * along


def _angle_to_normal(force, axis: BarAxis, point, beta):
    """Angle (…, f) between the contact's force and its normal, uphill: |beta| - |phi| where psi = 0."""
    away = point - axis.point_mm
    normal = away - np.sum(away * axis.direction, axis=-1, keepdims=True) * axis.direction
    normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    uphill = -np.sum(force * axis.direction, axis=-1) * np.where(beta >= 0, 1.0, -1.0)[..., None]
    return np.arctan2(uphill, np.sum(force * normal, axis=-1))


@dataclass(frozen=True)
class Jacobians:
    """Derivatives by the parameters: whisk[name] (size,), frame[name] (f, size)."""

    whisk: dict[str, np.ndarray]
    frame: dict[str, np.ndarray]


def jacobians(problem: Problem, state: State) -> tuple[Measured, Jacobians]:
    """All quantities and their derivatives by finite differences, the frames' bends moved all at once."""
    moved, moves = perturbed(problem, state.vector, reach=True)
    all_rows = measure(problem, moved, state.arcs_mm)
    whisk = {name: np.zeros(problem.size) for name in all_rows.whisk}
    frame = {name: np.zeros((len(problem.motor_rad), problem.size)) for name in all_rows.frame}
    for number, move in enumerate(moves, start=1):
        shared, step, columns = move.is_shared, move.step, move.column
        for name, values in all_rows.whisk.items():
            if shared:
                whisk[name][columns[0]] = (values[number] - values[0]) / step
        for name, values in all_rows.frame.items():
            use = np.flatnonzero(columns >= 0)
            frame[name][use, columns[use]] = (
                _difference(name, values[number, use], values[0, use]) / step
            )
    here = Measured(
        {name: v[0] for name, v in all_rows.whisk.items()},
        {name: v[0] for name, v in all_rows.frame.items()},
    )
    return here, Jacobians(whisk, frame)


def _difference(name: str, moved, here):
    """Difference of values; of angles the short way round."""
    change = moved - here
    return (change + np.pi) % (2 * np.pi) - np.pi if name in ("phi", "alpha") else change
