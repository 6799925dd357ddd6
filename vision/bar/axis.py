"""The bar in space: found where the pictures differ from their background, then measured by its outline."""

from collections.abc import Mapping

import numpy as np

from vision.geometry.camera import Cameras
from vision.geometry.centreline import rotation_z
from vision.geometry.contact import BarAxis, axis_frame, shifted_axis, upward
from vision.geometry.errors import Refused
from vision.geometry.silhouette import outline
from vision.lines.points import LinePoints
from vision.pictures.change import HALF

_ALONG_MM = np.arange(-24.0, 24.1, 6.0)
_INSIDE = np.array([-0.75, 0.0, 0.75])
_OUTSIDE = np.array([-1.5, 1.5])
_STARTS, _LEAST_SCORE = 6, 0.25
_FIRST_STEP, _SHRINKS = np.array([1.0, 0.02, 0.05, 0.07]), 5  # half a step of the grid: mm, rad, rad, rad
_AROUND = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 4, indexing="ij"), axis=-1).reshape(-1, 4)
_MOST_CLIMBS = 20


def axis_from_angles(x_mm, touch_rad, beta_rad, psi_rad, reach_mm) -> BarAxis:
    """The bar that a straight whisker first touches at distance x, at motor angle touch, with these slopes.

    All arguments (n,); reach_mm: bar radius + whisker radius.
    """
    turn = rotation_z(np.asarray(touch_rad, dtype=float))
    zero = np.zeros_like(turn[..., 0, 0])
    a = np.stack(np.broadcast_arrays(np.sin(psi_rad) + zero, np.cos(psi_rad) * np.sin(beta_rad) + zero,
                                     np.cos(psi_rad) * np.cos(beta_rad) + zero), axis=-1)
    n = np.stack([zero, np.cos(beta_rad) + zero, -np.sin(beta_rad) + zero], axis=-1)
    p = np.stack([x_mm + zero, zero, zero], axis=-1) + reach_mm * n
    rotate = lambda v: np.einsum("...ij,...j->...i", turn, v)  # noqa: E731
    return BarAxis(rotate(p), rotate(a))


def find_bar(changes: Mapping[str, np.ndarray], cameras: Cameras, radius_mm: float, reach_mm: float,
             motor_rad: tuple[float, float], length_mm: float) -> BarAxis:
    """Coarse axis of the bar: the cylinder whose outline is filled with change, with no change beside it.

    changes: per camera, see `changed`; motor_rad: lowest and highest motor angle, between which it touches.
    Raises Refused where nothing like a bar is seen.
    """
    x = np.arange(10.0, length_mm, 0.7 * radius_mm)
    beta = np.radians(np.arange(-84.0, 85.0, 6.0))
    touch = np.linspace(*motor_rad, 3)
    psi = np.radians([-8.0, 0.0, 8.0])
    grid = np.stack(np.meshgrid(x, touch, beta, psi, indexing="ij"), axis=-1).reshape(-1, 4)
    scores = _score(grid, changes, cameras, radius_mm, reach_mm, _ALONG_MM[::2])
    found, score = _climb(grid[np.argsort(scores)[-_STARTS:]], changes, cameras, radius_mm, reach_mm)
    if score < _LEAST_SCORE:
        raise Refused(f"no bar of diameter {2 * radius_mm:g} mm is seen near the whisker (best match "
                      f"{score:.2f}, needed {_LEAST_SCORE:g}); record with the bar in view of every camera")
    return axis_from_angles(*found, reach_mm)


def _climb(starts, changes, cameras, radius_mm: float, reach_mm: float) -> tuple[np.ndarray, float]:
    """Best hypothesis (4,) and its score: from each start to the best neighbour, by ever smaller steps."""
    best, part = starts, np.ones(len(starts))
    score = np.full(len(starts), -np.inf)
    for _ in range(_MOST_CLIMBS):
        around = best[:, None] + part[:, None, None] * _FIRST_STEP * _AROUND
        scores = _score(around.reshape(-1, 4), changes, cameras, radius_mm, reach_mm).reshape(len(best), -1)
        chosen = np.argmax(scores, axis=1)
        better = scores[np.arange(len(best)), chosen]
        part = np.where(better > score + 1e-3, part, 0.5 * part)
        best, score = around[np.arange(len(best)), chosen], better
        if np.all(part < 0.5**_SHRINKS):
            break
    return best[np.argmax(score)], float(np.max(score))


def _score(angles, changes, cameras: Cameras, radius_mm: float, reach_mm: float, along_mm=_ALONG_MM) -> np.ndarray:
    """Mean over cameras of (change inside the outline) - (change beside it), (n,) for hypotheses (n, 4)."""
    axis = axis_from_angles(*angles.T, reach_mm)
    offsets = radius_mm * _INSIDE, radius_mm * _OUTSIDE
    scores = [standing_out(axis, changes[camera.name], camera, *offsets, along_mm) for camera in cameras]
    return sum(scores) / len(cameras)


def standing_out(axis: BarAxis, change, camera, inside_mm, outside_mm, along_mm=_ALONG_MM) -> np.ndarray:
    """(change inside the outline) - (change beside it), (n,) for axes (n, 3), read at these places beside each axis."""
    along, sideways = _axis_frame(axis, camera, along_mm)
    reach = float(np.max(np.abs(outside_mm)))
    px = camera.project(np.stack([along, along + reach * sideways[:, None]]).reshape(-1, 3))
    middle, side = px.T.reshape(2, 2, *along.shape[:2], 1).swapaxes(0, 1)  # (x and y, n, t, 1)
    step = (side - middle) / reach  # so near the axis a picture is as good as flat
    inside, outside = (_read(change, *(middle + offsets * step)) for offsets in (inside_mm, outside_mm))
    return inside.mean(axis=(1, 2)) - outside.mean(axis=(1, 2))


def _axis_frame(axis: BarAxis, camera, along_mm):
    """Points (n, t, 3) along each axis and the direction (n, 3) in which the camera sees its width."""
    along = axis.point_mm[:, None] + along_mm[:, None] * axis.direction[:, None]
    sideways = np.cross(axis.direction, axis.point_mm - camera.centre_mm)
    return along, sideways / np.linalg.norm(sideways, axis=-1, keepdims=True)


def _read(picture, x_px, y_px) -> np.ndarray:
    """Values (…) of a picture, given at every HALF-th pixel, at pixels (…); its rim's where outside or not known."""
    row, column = (np.fmin(np.fmax(px * (1.0 / HALF) + 0.5, 0.0), size - 1).astype(np.intp)
                   for px, size in zip((y_px, x_px), picture.shape))
    return picture.ravel().take(row * picture.shape[1] + column)


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
    weight = 1.0 / np.sqrt(1.0 + (left / 5.0) ** 2)
    columns = [np.sum(points.normal * (middle(vector + step[k] * np.eye(4)[k]) - here), axis=1) / step[k]
               for k in range(4)]
    return left * weight, np.stack(columns, axis=1) / points.sigma_px[:, None] * weight[:, None]
