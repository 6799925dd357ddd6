"""The axis of a straight bar in space, from its line in each camera.

Each camera gives points of the bar's middle line. The axis has four degrees of freedom, two shifts
across itself and two tilts; Gauss–Newton finds the one whose projected outline has its middle on
all the points, in units of their sigmas and with Cauchy weights against lines of something else. A
wide prior keeps what no camera determines.

A camera and the axis span a plane. Any two such planes, each of another camera, meet in an axis.
"""

from collections.abc import Iterable, Mapping

import numpy as np

from vision.geometry.camera import Camera, Cameras
from vision.geometry.contact import BarAxis, axis_frame
from vision.geometry.newton import gauss_newton, not_converged
from vision.geometry.rotation import unit
from vision.geometry.silhouette import edges
from vision.touched.pieces import ARM_MM
from vision.wire.points import LinePoints

# [mm, rad] Prior sigmas of the axis about where it was: wide, they keep only what no camera
# determines. Stated.
_PRIOR = np.array([5.0, 5.0, 0.5, 0.5])
# [mm, rad] Steps of differences; a smaller step of the axis is the last: a hundredth of a pixel.
# Derived.
_STEPS = np.array([1e-3, 1e-3, 1e-5, 1e-5])
# [steps] Gauss–Newton: 184 fits took 4 at most; one that takes more does not converge. Stated.
_GAUSS_NEWTON = 50


def settle_axis(
    axis: BarAxis,
    cameras: Cameras,
    lines: Mapping[str, LinePoints],
    radius_mm: float,
) -> BarAxis:
    """Fit the axis whose outline passes through line points in each camera, from an axis nearby.

    lines: by camera, their `place` mm along the axis given. Where the cameras see the bar from
    nearly the same side, what they cannot determine stays as it was. Raises Refused where the fit
    does not converge.
    """
    across = axis_frame(axis.direction)
    used = {name: points for name, points in lines.items() if len(points)}
    if not used:
        return axis.upward()

    def residuals_of(vectors: np.ndarray) -> np.ndarray:
        """Compute the residuals (m, n) of all cameras' line points for vectors (m, 4)."""
        axes = axis.shifted(across, vectors)
        residuals = [_residuals(axes, cameras[name], used[name], radius_mm) for name in used]
        return np.concatenate(residuals, axis=1)

    vector, has_converged = gauss_newton(residuals_of, _PRIOR, _STEPS, _GAUSS_NEWTON)
    if not has_converged:
        raise not_converged(_GAUSS_NEWTON)
    return axis.shifted(across, vector).upward()


def sight_planes(cameras: Iterable[Camera], axis: BarAxis) -> np.ndarray:
    """Return the unit normals (c, 3) of the planes that cameras span with an axis."""
    sights = np.array([axis.point_mm - camera.centre_mm for camera in cameras])
    return unit(np.cross(axis.direction, sights))


def offset_px(camera: Camera, axis: BarAxis, other: BarAxis) -> float:
    """Return how far a camera sees one axis from another, px: the largest offset within ARM_MM.

    Without distortion, which is alike for two axes that are near to each other.
    """
    (normal,) = sight_planes([camera], other)
    sights = unit(axis.points_at([-ARM_MM, ARM_MM]) - camera.centre_mm)
    focal_px = float(np.mean(camera.lens[:2]))
    return focal_px * float(np.max(np.abs(sights @ normal)))


def meeting_axis(camera: Camera, axis: BarAxis, other_camera: Camera, other: BarAxis) -> BarAxis:
    """Return the axis that one camera sees where it sees an axis, another camera where the other is.

    It is the farther off the nearer the planes of both are to one, where it is NaN.
    """
    (normal,) = sight_planes([camera], axis)
    (other_normal,) = sight_planes([other_camera], other)
    direction = unit(np.cross(normal, other_normal))
    planes = np.stack([normal, other_normal, direction])
    distances = [
        normal @ camera.centre_mm,
        other_normal @ other_camera.centre_mm,
        direction @ axis.point_mm,
    ]
    return BarAxis(np.linalg.solve(planes, distances), direction).upward()


def _residuals(axes: BarAxis, camera: Camera, points: LinePoints, radius_mm: float) -> np.ndarray:
    """Compute how far line points lie from the middle of an outline, in sigmas.

    Returns (m, n) of a batch of axes (m, 3).
    """
    points_mm = axes.points_at(points.place)  # (m, n, 3)
    one, other = edges(camera, points_mm, axes.direction[:, None], radius_mm)
    middle_px = 0.5 * (one + other)
    return np.sum(points.normal * (points.px - middle_px), axis=-1) / points.sigma_px
