"""From the fit's parameters to what a user asks for, and how its uncertainty carries over.

Definitions are those of the contact conventions: slip along the bar, deflection between the virtual
point and the contact in the contact frame, phi the direction of the deflection, alpha the angle
from contact normal to force.
"""

from dataclasses import dataclass

import numpy as np

from vision.fit.differences import perturb
from vision.fit.problem import (
    Problem,
    State,
    bar_axes,
    bar_axis,
    curves_of,
    resting_curves,
    shift_at_mm,
    shifts_mm,
    wire_of,
)
from vision.fit.touch import FirstTouch, first_touch
from vision.geometry.centreline import Curves, rotation_z
from vision.geometry.contact import BarAxis, clearance, contact_frame_angles
from vision.geometry.rods import Wire
from vision.geometry.rotation import across, unit

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
    _, arc, point = clearance(curves, each, wire_of(problem, vector, 2))
    touched = bar_axis(problem, vector).bar_at(touch.point_mm)
    beta, psi = contact_frame_angles(touched.direction, touch.motor_rad)
    contact_moved = _contact_moved_mm(problem, vector, touch, point)
    d_y, d_z = _deflection(problem, vector, touch, point)
    along, across_y = _in_hub(problem, touch, point, d_y)
    force = _force_direction(curves, wire_of(problem, vector, 1), touch, arc, d_y, d_z)
    frame = {
        "slip": np.sum(contact_moved * touched.direction[..., None, :], axis=-1),
        "longitudinal_slip": arc - touch.arc_mm[..., None],
        "d_y": d_y,
        "d_z": d_z,
        "along": along,
        "across_y": across_y,
        "arc": arc,
        "phi": np.arctan2(d_z, d_y),
        "alpha": _angle_to_normal(force, each.bar_at(point), point, beta),
        **_by_axis(point),
    }
    return Measured(_at_touch(touch, beta, psi), frame)


def _at_touch(touch: FirstTouch, beta: np.ndarray, psi: np.ndarray) -> dict[str, np.ndarray]:
    """Return the quantities of the whisk (…), which are those at touch."""
    return {
        "touch": touch.motor_rad,
        "d_x": np.linalg.norm(touch.point_mm, axis=-1),
        "beta": beta,
        "psi": psi,
        **_by_axis(touch.point_mm),
    }


def _by_axis(points_mm: np.ndarray) -> dict[str, np.ndarray]:
    """Return the coordinates (…) of points (…, 3) by name."""
    return dict(zip("xyz", np.moveaxis(points_mm, -1, 0)))


def _contact_moved_mm(
    problem: Problem, vector: np.ndarray, touch: FirstTouch, point_mm: np.ndarray
) -> np.ndarray:
    """Return how far (…, f, 3) the contact, at points (…, f, 3), has moved on the bar since
    touch.
    """
    at_touch = shift_at_mm(problem, vector, touch.motor_rad)[..., None, :]
    bar_moved = shifts_mm(problem, vector) - at_touch  # (…, f, 3), (…, 1, 3) where it stands
    return point_mm - touch.point_mm[..., None, :] - bar_moved


def _deflection(
    problem: Problem, vector: np.ndarray, touch: FirstTouch, point_mm: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return d_y = V_y - P_y and d_z = P_z - V_z (…, f), mm, in the contact frame.

    P is the contact point (…, f, 3). V, the virtual point, is that of the resting whisker which is
    as far along the contact frame's x axis as the contact at touch.
    """
    motor = np.broadcast_to(problem.motor_rad, point_mm.shape[:-1])
    unbent = resting_curves(problem, vector[..., None, :], motor)
    x, y, _ = np.moveaxis(rotation_z(touch.motor_rad)[..., None, :, :], -1, 0)  # (…, 1, 3)
    offset = _virtual_point(unbent, touch, x) - point_mm
    return np.sum(offset * y, axis=-1), -offset[..., 2]


def _in_hub(
    problem: Problem, touch: FirstTouch, point_mm: np.ndarray, d_y: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return how far contacts (…, f, 3) are along and across the unbent whisker (…, f), mm.

    Both are measured from the wire, so that errors of touch and distance cancel in them.
    """
    theta = problem.motor_rad - touch.motor_rad[..., None]
    cos = np.cos(theta)
    sin = np.sin(theta)
    x = rotation_z(touch.motor_rad)[..., None, :, 0]
    d_x = np.linalg.norm(touch.point_mm, axis=-1)[..., None]
    beyond = np.sum(point_mm * x, axis=-1) - d_x  # past where the unbent whisker would touch
    return d_x / cos - d_y * sin + beyond * cos, d_y * cos + beyond * sin


def _virtual_point(unbent: Curves, touch: FirstTouch, x: np.ndarray) -> np.ndarray:
    """Find the points (…, f, 3) of unbent curves that are as far along x as the contact at touch.

    x (…, 1, 3): unit, of the contact frame.
    """
    arc = np.broadcast_to(touch.arc_mm[..., None], unbent.points_mm.shape[:-2])
    for _ in range(_ROUNDS):
        point, tangent = unbent.at(arc[..., None])  # (…, f, 1, 3)
        to_touch = touch.point_mm[..., None, :] - point[..., 0, :]
        along = np.sum(tangent[..., 0, :] * x, axis=-1)
        arc = arc + np.sum(to_touch * x, axis=-1) / along
    return unbent.at(arc[..., None])[0][..., 0, :]


def _force_direction(
    curves: Curves,
    wire: Wire,
    touch: FirstTouch,
    arc_mm: np.ndarray,
    d_y: np.ndarray,
    d_z: np.ndarray,
) -> np.ndarray:
    """Return the direction (…, f, 3) of the contact's force on the whisker, of any length.

    Across the whisker it is that in which it was bent: from the virtual point to the contact. Along
    it the normal of a surface that tapers has a part.
    """
    _, tangent = curves.at(arc_mm[..., None])
    along = unit(tangent[..., 0, :])
    to_rig = rotation_z(touch.motor_rad)[..., None, :, :]  # from the contact frame
    deflection = d_z[..., None] * to_rig[..., 2] - d_y[..., None] * to_rig[..., 1]
    bent = across(deflection, along)
    size = np.linalg.norm(bent, axis=-1) * wire.radius_by_arc(arc_mm)
    return bent + size[..., None] * along


def _angle_to_normal(
    force: np.ndarray, axis: BarAxis, point_mm: np.ndarray, beta_rad: np.ndarray
) -> np.ndarray:
    """Return the angle (…, f) from the contact's normal to its force, uphill: |beta| - |phi| where
    psi = 0."""
    from_axis = point_mm - axis.point_mm
    along_mm = np.sum(from_axis * axis.direction, axis=-1, keepdims=True)
    normal = unit(from_axis - along_mm * axis.direction)
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
    perturbed = perturb(problem, state.vector, reach=True)
    values = measure(problem, perturbed.vectors, state.arcs_mm)
    frames = np.arange(len(problem.motor_rad))
    whisk = {}
    for name, value in values.whisk.items():  # (copies,)
        whisk[name] = perturbed.shared_gradient(value[1:] - value[0])
    frame = {}
    for name, value in values.frame.items():  # (copies, f)
        frame[name] = perturbed.jacobian(_difference(name, value[1:], value[0]), frames)
    return values.one(0), Jacobians(whisk, frame)


def _difference(name: str, after: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Return the difference of values; of angles the short way round."""
    change = after - before
    if name in ("phi", "alpha"):
        return (change + np.pi) % (2 * np.pi) - np.pi
    return change
