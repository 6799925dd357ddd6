"""The axis of a straight bar in space, from its line in each camera.

Each camera gives points of the bar's middle line. The axis has four degrees of freedom, two shifts
across itself and two tilts; Gauss–Newton finds the one whose projected outline has its middle on
all the points, in units of their sigmas and with Cauchy weights against lines of something else. A
wide prior keeps what no camera determines.
"""

from collections.abc import Mapping

import numpy as np

from vision.geometry.camera import Camera, Cameras
from vision.geometry.contact import BarAxis, axis_frame
from vision.geometry.newton import cauchy_weights, gauss_newton
from vision.geometry.silhouette import edges
from vision.wire.points import LinePoints

# [mm, rad] Prior sigmas of the axis about where it was: wide, they keep only what no camera
# determines. Stated.
_PRIOR = np.array([5.0, 5.0, 0.5, 0.5])
# [mm, rad] Steps of differences; a smaller step of the axis is the last: a hundredth of a pixel.
# Derived.
_STEPS = np.array([1e-3, 1e-3, 1e-5, 1e-5])
# [sigmas] Scale of the Cauchy distribution that weighs residuals. Stated.
_CAUCHY_SIGMAS = 5.0


def settle_axis(
    axis: BarAxis,
    cameras: Cameras,
    lines: Mapping[str, LinePoints],
    radius_mm: float,
    rounds: int = 5,
) -> BarAxis:
    """Fit the axis whose outline passes through line points in each camera, from an axis nearby.

    lines: by camera, their `place` mm along the axis given. rounds: most Gauss–Newton steps. Where
    the cameras see the bar from nearly the same side, what they cannot determine stays as it was.
    """
    across = axis_frame(axis.direction)

    def rows_of(vector: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Compute residuals and Jacobian of each camera at a step from the begin."""
        return [
            _axis_rows(axis, across, vector, cameras[name], points, radius_mm)
            for name, points in lines.items()
            if len(points)
        ]

    return axis.shifted(across, gauss_newton(rows_of, _PRIOR, _STEPS, rounds)).upward()


def _axis_rows(
    axis: BarAxis,
    across: np.ndarray,
    vector: np.ndarray,
    camera: Camera,
    points: LinePoints,
    radius_mm: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Compute weighted residuals (n,) of line points, and their Jacobian (n, 4).

    Residuals are in sigmas, with Cauchy weights. vector (4,): shifts and tilts of the axis, see
    `Axis.shifted`.
    """
    steps = np.concatenate([np.zeros((1, 4)), np.diag(_STEPS)])
    shifted = axis.shifted(across, vector + steps)  # a batch of five axes
    on_axis = shifted.point_mm[:, None] + points.place[:, None] * shifted.direction[:, None]
    directions = np.broadcast_to(shifted.direction[:, None], on_axis.shape)  # (5, n, 3)
    one, other = edges(camera, on_axis.reshape(-1, 3), directions.reshape(-1, 3), radius_mm)
    middle, *stepped = 0.5 * (one + other).reshape(*on_axis.shape[:2], 2)
    residual = np.sum(points.normal * (points.px - middle), axis=1) / points.sigma_px
    weight = np.sqrt(cauchy_weights(residual, _CAUCHY_SIGMAS))
    by_axis = np.sum(points.normal * (np.array(stepped) - middle), axis=-1)  # (4, n)
    jacobian = (by_axis / _STEPS[:, None]).T / points.sigma_px[:, None]
    return residual * weight, jacobian * weight[:, None]
