"""What one camera alone shows of a whisk's wire: the lines of sight to its points, with their
uncertainty.

The places in the pictures came from all cameras; what is measured there is the one camera's.
Nothing else of the fit is here.
"""

from dataclasses import dataclass

import numpy as np

from vision.fit.blocks import WIRE_MODES_PX
from vision.fit.object_rows import CameraPoints
from vision.fit.problem import Problem, wire_modes
from vision.geometry.camera import Camera
from vision.geometry.centreline import rotation_z
from vision.geometry.polyline import tangents_by
from vision.geometry.rotation import unit
from vision.wire.points import LinePoints


@dataclass(frozen=True, eq=False)
class Sights:
    """Lines of sight of one camera to the wire, in the rig frame.

    motor_rad (f,): of each frame. frame (n,): each point's place among these. eye_mm (3,). sight
    (n, 3): unit. across (n, 3): unit normals of the planes of sight and wire. sigma_rad (n,):
    across. shared_rad (n, k): how far each moves across with one sigma of each cause that points
    share, light, lens and pose.
    """

    motor_rad: np.ndarray
    frame: np.ndarray
    eye_mm: np.ndarray
    sight: np.ndarray
    across: np.ndarray
    sigma_rad: np.ndarray
    shared_rad: np.ndarray


def sights_of(problem: Problem, name: str) -> Sights | None:
    """Return the lines of sight of one camera; None where it shows nothing of the wire, or was left
    out.
    """
    seen = _wire_points(problem, name)
    if seen is None:
        return None
    frame = seen.frame
    points = seen.points
    camera = problem.cameras[name]
    sight = camera.rays(points.px)
    further_along = camera.rays(points.px - tangents_by(points.normal))
    across = unit(np.cross(sight, further_along))
    rad_per_px = np.einsum("ni,ni->n", across, camera.rays(points.px + points.normal) - sight)
    shared_px = _shared_px(problem, name, points, problem.motor_rad[frame])
    return Sights(
        motor_rad=problem.motor_rad,
        frame=frame,
        eye_mm=camera.centre_mm,
        sight=sight,
        across=across,
        sigma_rad=points.sigma_px * np.abs(rad_per_px),
        shared_rad=shared_px * rad_per_px[:, None],
    )


def _wire_points(problem: Problem, name: str) -> CameraPoints | None:
    """Return the line points of the wire in one camera; None where it has none, or was left out."""
    if name not in problem.cameras:
        return None
    number = problem.cameras.index(name)
    seen = problem.seen_of_wire(number)
    has_points = any(len(one.points) for one in seen)
    return CameraPoints.joined(number, seen) if has_points else None


def _shared_px(problem: Problem, name: str, points: LinePoints, motor_rad) -> np.ndarray:
    """Return how far (n, k) px points move along their normals with one sigma of each cause they
    share.
    """
    modes = wire_modes(problem.wire.length_mm, points.place, motor_rad, problem.motor_rad)
    by_camera_px = _by_camera(problem, name, points, motor_rad)
    return np.concatenate([WIRE_MODES_PX * modes, points.shared_px, by_camera_px], axis=1)


def _by_camera(problem: Problem, name: str, points: LinePoints, motor_rad) -> np.ndarray:
    """Return how far (n, 15), px, points of an unbent wire move along their normals with one sigma
    of each principal component of lens and pose.
    """
    camera: Camera = problem.cameras[name]
    rows = problem.cameras.parameters_of(name)
    variances, vectors = np.linalg.eigh(problem.cameras.covariance[rows, rows])
    components = vectors * np.sqrt(np.maximum(variances, 0.0))
    straight_mm = points.place[:, None] * rotation_z(motor_rad)[:, :, 0]
    _, _, by_parameter = camera.project_with_jacobians(straight_mm)
    return np.einsum("ni,nip->np", points.normal, by_parameter) @ components
