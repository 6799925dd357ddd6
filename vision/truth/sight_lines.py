"""What one camera alone shows of a whisk's wire: the lines on which its points lie, with all that they may be off by.

Where to look in the pictures came from all cameras; what is measured there is the one camera's. Nothing else of the fit
is here.
"""

from dataclasses import dataclass

import numpy as np

from vision.fit.blocks import WIRE_MODES_PX
from vision.fit.problem import Problem, wire_modes
from vision.geometry.camera import Camera
from vision.geometry.centreline import rotation_z


@dataclass(frozen=True, eq=False)
class Sights:
    """Lines of sight of one camera to the wire, rig frame: motor_rad (f,) of each frame; frame (n,), each point's place
    among these; eye_mm (3,); sight (n, 3) unit; across (n, 3), unit normals of the planes of sight and seen line;
    sigma_rad (n,) across; shared_rad (n, k): by how much each moves with one sigma of each cause that points share,
    light, lens and pose."""

    motor_rad: np.ndarray
    frame: np.ndarray
    eye_mm: np.ndarray
    sight: np.ndarray
    across: np.ndarray
    sigma_rad: np.ndarray
    shared_rad: np.ndarray


def sights_of(problem: Problem, name: str) -> Sights | None:
    """One camera's; None where it shows nothing of the wire, or was left out."""
    if name not in problem.cameras:
        return None
    number, camera = problem.cameras.index(name), problem.cameras[name]
    mine = [
        one for one in problem.seen if one.camera == number and one.frame >= 0 and len(one.points)
    ]
    if not mine:
        return None
    frame = np.concatenate([np.full(len(one.points), one.frame) for one in mine])
    px, normal, sigma, place, of_light = (
        np.concatenate([getattr(one.points, field) for one in mine])
        for field in ("px", "normal", "sigma_px", "place", "shared_px")
    )
    sight = camera.rays(px)
    across = np.cross(sight, camera.rays(px + _right_angle(normal)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    per_px = np.einsum("ni,ni->n", across, camera.rays(px + normal) - sight)
    modes = WIRE_MODES_PX * wire_modes(
        problem.wire.length_mm, place, problem.motor_rad[frame], problem.motor_rad
    )
    of_camera = _by_camera(problem, name, place, problem.motor_rad[frame], normal)
    shared = np.concatenate([modes, of_light, of_camera], axis=1) * per_px[:, None]
    return Sights(
        problem.motor_rad, frame, camera.centre_mm, sight, across, sigma * np.abs(per_px), shared
    )


def _right_angle(normal: np.ndarray) -> np.ndarray:
    return np.stack([-normal[:, 1], normal[:, 0]], axis=1)


def _by_camera(problem: Problem, name: str, place_mm, motor_rad, normal) -> np.ndarray:
    """Pixels (n, 15) that points of an unbent wire move along their normals with one sigma of lens and pose each."""
    camera: Camera = problem.cameras[name]
    rows = problem.cameras.parameters_of(name)
    values, vectors = np.linalg.eigh(problem.cameras.covariance[rows, rows])
    straight = place_mm[:, None] * rotation_z(motor_rad)[:, :, 0]
    _, _, by_parameter = camera.project_with_jacobians(straight)
    return np.einsum("ni,nip->np", normal, by_parameter) @ (
        vectors * np.sqrt(np.maximum(values, 0.0))
    )
