"""The bar's axis in space, by its outline in the pictures."""

from collections.abc import Mapping

import numpy as np

from vision.geometry.camera import Cameras
from vision.geometry.contact import BarAxis, axis_frame, shifted_axis, upward
from vision.geometry.newton import cauchy_weights, settle
from vision.geometry.silhouette import edges
from vision.wire.points import LinePoints

# [mm, rad] Of the axis from where it was: wide, keeps only what no camera tells. Stated.
_PRIOR = np.array([5.0, 5.0, 0.5, 0.5])
# [mm, rad] Of differences; a smaller step of the axis is the last: a hundredth of a pixel.
# Derived.
_STEPS = np.array([1e-3, 1e-3, 1e-5, 1e-5])


def settle_axis(
    axis: BarAxis,
    cameras: Cameras,
    lines: Mapping[str, LinePoints],
    radius_mm: float,
    rounds: int = 5,
) -> BarAxis:
    """The axis whose outline passes through line points in each camera; `place` is mm along the axis given.

    Where the cameras see the bar from nearly the same side, what they cannot tell stays as it was.
    """
    across = axis_frame(axis.direction)

    def rows_of(vector):
        return [
            _axis_rows(axis, across, vector, cameras[name], points, radius_mm)
            for name, points in lines.items()
            if len(points)
        ]

    return upward(shifted_axis(axis, across, settle(rows_of, _PRIOR, _STEPS, rounds)))


def _axis_rows(axis, across, vector, camera, points: LinePoints, radius_mm):
    """What is left between line points and outline over sigma, robustly weighted, and its Jacobian (n, 4)."""
    moved = shifted_axis(axis, across, vector + np.concatenate([np.zeros((1, 4)), np.diag(_STEPS)]))
    on_axis = moved.point_mm[:, None] + points.place[:, None] * moved.direction[:, None]
    directions = np.broadcast_to(moved.direction[:, None], on_axis.shape)
    one, other = edges(camera, on_axis.reshape(-1, 3), directions.reshape(-1, 3), radius_mm)
    here, *there = 0.5 * (one + other).reshape(*on_axis.shape[:2], 2)
    left = np.sum(points.normal * (points.px - here), axis=1) / points.sigma_px
    weight = np.sqrt(cauchy_weights(left, 5.0))
    columns = [
        np.sum(points.normal * (px - here), axis=1) / step for px, step in zip(there, _STEPS)
    ]
    return left * weight, np.stack(columns, axis=1) / points.sigma_px[:, None] * weight[:, None]
