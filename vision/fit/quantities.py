"""From the fit's parameters to what a user asks for, and how its uncertainty carries over.

Definitions are those of the contact conventions: slip along the bar, deflection between the virtual
point and the contact in the contact frame, phi the direction of the deflection, alpha the angle
from contact normal to force.
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
from vision.geometry.contact import BarAxis, clearance, contact_frame_angles

# [rounds] Of Newton's method for the virtual point: the resting whisker is nearly straight.
# Derived.
_ROUNDS = 3


@dataclass(frozen=True)
class Measured:
    """Values by name: of the whisk (…,) and of its frames (…, f)."""

    whisk: dict[str, np.ndarray]
    frame: dict[str, np.ndarray]

    def one(self, number: int) -> "Measured":
        """Return the values of one parameter vector of a batch."""
        whisk = {name: values[number] for name, values in self.whisk.items()}
        frame = {name: values[number] for name, values in self.frame.items()}
        return Measured(whisk, frame)


def measure(problem: Problem, vector: np.ndarray, arcs_mm: np.ndarray) -> Measured:
    """Return all quantities for one parameter vector (size,) or a batch (b, size)."""
    touch = first_touch(problem, vector)
    each = bar_axes(problem, vector)
    curves, _ = curves_of(problem, vector, arcs_mm)
    _, arc, point = clearance(curves, each)
    touched = bar_axis(problem, vector).bar_at(touch.point_mm)
    beta, psi = contact_frame_angles(touched.direction, touch.motor_rad)
    whisk = {
        "touch": touch.motor_rad,
        "d_x": np.linalg.norm(touch.point_mm, axis=-1),
        "beta": beta,
        "psi": psi,
    }
    bar_at_touch = shift_at_mm(problem, vector, touch.motor_rad)[..., None, :]
    bar_moved = shifts_mm(problem, vector) - bar_at_touch
    contact_moved = point - touch.point_mm[..., None, :] - bar_moved
    d_y, d_z = _deflection(problem, vector, touch, point)
    force = _force_direction(curves, touch, arc, d_y, d_z)
    frame = {
        "slip": np.sum(contact_moved * touched.direction[..., None, :], axis=-1),
        "longitudinal_slip": arc - touch.arc_mm[..., None],
        "d_y": d_y,
        "d_z": d_z,
        "arc": arc,
        "phi": np.arctan2(d_z, d_y),
        "alpha": _angle_to_normal(force, each.bar_at(point), point, beta),
    }
    for k, name in enumerate("xyz"):
        whisk[name] = touch.point_mm[..., k]
        frame[name] = point[..., k]
    return Measured(whisk, frame)


def _deflection(
    problem: Problem, vector: np.ndarray, touch: FirstTouch, point_mm: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return d_y = V_y - P_y and d_z = P_z - V_z (…, f), mm, in the contact frame.

    P is the contact point (…, f, 3). V, the virtual point, is that of the resting whisker which is
    as far along the contact frame's x axis as the contact at touch.
    """
    shape = point_mm.shape[:-1]
    rest = rest_shape(problem, vector)[..., None, :, :]
    rest = np.broadcast_to(rest, (*shape, 2, REST_POWERS))
    motor = np.broadcast_to(problem.motor_rad, shape)
    middle = np.full(shape, problem.wire.length_mm / 2)
    unbent = centrelines(rest, np.zeros((*shape, 2)), middle, motor, problem.wire)
    cosine = np.cos(touch.motor_rad)[..., None]
    sine = np.sin(touch.motor_rad)[..., None]
    at_touch = touch.point_mm[..., None, :]
    wanted = cosine * at_touch[..., 0] + sine * at_touch[..., 1]
    arc = np.broadcast_to(touch.arc_mm[..., None], shape)
    for _ in range(_ROUNDS):
        virtual, tangent = unbent.at(arc[..., None])  # (…, f, 1, 3)
        here = cosine * virtual[..., 0, 0] + sine * virtual[..., 0, 1]
        slope = cosine * tangent[..., 0, 0] + sine * tangent[..., 0, 1]
        arc = arc + (wanted - here) / slope
    virtual, _ = unbent.at(arc[..., None])
    offset = virtual[..., 0, :] - point_mm
    return -sine * offset[..., 0] + cosine * offset[..., 1], -offset[..., 2]


def _force_direction(
    curves: Curves, touch: FirstTouch, arc_mm: np.ndarray, d_y: np.ndarray, d_z: np.ndarray
) -> np.ndarray:
    """Return the direction (…, f, 3) of the contact's force on the whisker, across it, of any
    length.

    It is that in which the whisker was bent: from the virtual point to the contact.
    """
    _, tangent = curves.at(arc_mm[..., None])
    tangent = tangent[..., 0, :]
    along = tangent / np.linalg.norm(tangent, axis=-1, keepdims=True)
    cosine = np.cos(touch.motor_rad)[..., None]
    sine = np.sin(touch.motor_rad)[..., None]
    deflection = np.stack([sine * d_y, -cosine * d_y, d_z], axis=-1)
    return deflection - np.sum(deflection * along, axis=-1, keepdims=True) * along


def _angle_to_normal(
    force: np.ndarray, axis: BarAxis, point_mm: np.ndarray, beta_rad: np.ndarray
) -> np.ndarray:
    """Return the angle (…, f) from the contact's normal to its force, uphill: |beta| - |phi| where
    psi = 0."""
    from_axis = point_mm - axis.point_mm
    along_mm = np.sum(from_axis * axis.direction, axis=-1, keepdims=True)
    normal = from_axis - along_mm * axis.direction
    normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    sign = np.where(beta_rad >= 0, 1.0, -1.0)[..., None]
    uphill = -np.sum(force * axis.direction, axis=-1) * sign
    return np.arctan2(uphill, np.sum(force * normal, axis=-1))


@dataclass(frozen=True)
class Jacobians:
    """Derivatives by the parameters: whisk[name] (size,), frame[name] (f, size)."""

    whisk: dict[str, np.ndarray]
    frame: dict[str, np.ndarray]


def jacobians(problem: Problem, state: State) -> tuple[Measured, Jacobians]:
    """Return all quantities and their derivatives by finite differences, all frames' bends at
    once.
    """
    vectors, moves = perturbed(problem, state.vector, reach=True)
    values = measure(problem, vectors, state.arcs_mm)
    here = values.one(0)
    whisk = {name: np.zeros(problem.size) for name in here.whisk}
    frame = {name: np.zeros((len(problem.motor_rad), problem.size)) for name in here.frame}
    for number, move in enumerate(moves, start=1):
        moved = values.one(number)
        if move.is_shared:
            for name, column in whisk.items():
                change = moved.whisk[name] - here.whisk[name]
                column[move.column[0]] = change / move.step
        frames = np.flatnonzero(move.column >= 0)
        for name, rows in frame.items():
            change = _difference(name, moved.frame[name][frames], here.frame[name][frames])
            rows[frames, move.column[frames]] = change / move.step
    return here, Jacobians(whisk, frame)


def _difference(name: str, after: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Return the difference of values; of angles the short way round."""
    change = after - before
    if name in ("phi", "alpha"):
        return (change + np.pi) % (2 * np.pi) - np.pi
    return change
