"""The bar's axis in space, by its outline in the pictures."""

from collections.abc import Mapping

import numpy as np

from vision.geometry.camera import Cameras
from vision.geometry.contact import BarAxis, axis_frame, shifted_axis, upward
from vision.geometry.newton import cauchy_weights
from vision.geometry.silhouette import outline
from vision.lines.points import LinePoints


def settle_axis(axis: BarAxis, cameras: Cameras, lines: Mapping[str, LinePoints], radius_mm: float,
                rounds: int = 5) -> BarAxis:
    """The axis whose outline passes through line points in each camera; `place` is mm along the axis given.

    Where the cameras see the bar from nearly the same side, what they cannot tell stays as it was.
    """
    across = axis_frame(axis.direction)
    step = np.array([1e-3, 1e-3, 1e-5, 1e-5])
    vector = np.zeros(4)
    for _ in range(rounds):
        rows = [_axis_rows(axis, across, vector, cameras[name], points, radius_mm, step)
                for name, points in lines.items() if len(points)]
        rows.append((-vector / [5.0, 5.0, 0.5, 0.5], np.diag(1.0 / np.array([5.0, 5.0, 0.5, 0.5]))))
        vector = vector + np.linalg.lstsq(np.concatenate([r[1] for r in rows]),
                                          np.concatenate([r[0] for r in rows]), rcond=None)[0]
    return upward(shifted_axis(axis, across, vector))


def _axis_rows(axis, across, vector, camera, points: LinePoints, radius_mm, step):
    """What is left between line points and outline over sigma, robustly weighted, and its Jacobian (n, 4)."""
    def middle(v):
        moved = shifted_axis(axis, across, v)
        on_axis = moved.point_mm + points.place[:, None] * moved.direction
        return outline(camera, on_axis, np.broadcast_to(moved.direction, on_axis.shape), radius_mm)[0]

    here = middle(vector)
    left = np.sum(points.normal * (points.px - here), axis=1) / points.sigma_px
    weight = np.sqrt(cauchy_weights(left, 5.0))
    columns = [np.sum(points.normal * (middle(vector + step[k] * np.eye(4)[k]) - here), axis=1) / step[k]
               for k in range(4)]
    return left * weight, np.stack(columns, axis=1) / points.sigma_px[:, None] * weight[:, None]
