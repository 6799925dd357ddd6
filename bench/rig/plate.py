"""Flat printed rectangles: the board, markers, faces of boxes. Every edge of the print is integrated, none is
sampled.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from bench.rig.layer import Layer
from bench.rig.light import Light
from bench.rig.window import Window

_NEVER = 1e-5  # 1/mm
_ROOT_2PI = np.float32(np.sqrt(2 * np.pi))  # of the normal density, as wide as the samples


@dataclass(frozen=True, eq=False)
class Print:
    """A pattern of rectangular cells: reflectances (rows, columns) between edges in mm (columns + 1; rows + 1)."""

    reflectance: np.ndarray
    x_mm: np.ndarray
    y_mm: np.ndarray

    @classmethod
    def plain(cls, width_mm: float, height_mm: float, reflectance: float) -> "Print":
        """A print of one grey."""
        return cls(np.array([[reflectance]]), np.array([0.0, width_mm]), np.array([0.0, height_mm]))

    def moved(self, x_mm: float, y_mm: float) -> "Print":
        """The same print with its coordinates shifted."""
        return Print(self.reflectance, self.x_mm + x_mm, self.y_mm + y_mm)

    def framed(self, margin_mm: float, reflectance: float) -> "Print":
        """With a margin of one tone all round."""
        x, y = (
            np.concatenate([[e[0] - margin_mm], e, [e[-1] + margin_mm]])
            for e in (self.x_mm, self.y_mm)
        )
        return Print(np.pad(self.reflectance, 1, constant_values=reflectance), x, y)


@dataclass(frozen=True, eq=False)
class Plate:
    """A print in space. `pose` (3, 4), T_rig_plate: its x, y along the print, its z away from the viewer of the
    print.
    """

    print: Print
    pose: np.ndarray

    def corners_mm(self) -> np.ndarray:
        """(4, 3) in the rig frame."""
        x, y = self.print.x_mm[[0, -1]], self.print.y_mm[[0, -1]]
        flat = np.array([[x[0], y[0], 0], [x[1], y[0], 0], [x[1], y[1], 0], [x[0], y[1], 0]])
        return flat @ self.pose[:, :3].T + self.pose[:, 3]

    def faces(self, point_mm: np.ndarray) -> bool:
        """Whether the print is seen from a point."""
        return float((point_mm - self.pose[:, 3]) @ self.pose[:, 2]) < 0

    def draw(self, window: Window, radiance: np.ndarray, light: Light) -> None:
        """Over what is drawn, where the camera is in front of the print."""
        camera = window.camera
        if (
            not self.faces(camera.centre_mm)
            or (camera.in_camera(self.corners_mm())[:, 2] <= 1).any()
        ):
            return
        part = window.around(camera.project(self.corners_mm()), 4 * window.soft_px + 2)
        if part is None:
            return
        cover, tone = _printed(
            self.print, *_on_plane(camera, self.pose, *part.rays(), part.soft_px)
        )
        canvas = radiance[part.within(window)]
        canvas += cover * (np.float32(light.flat(-self.pose[:, 2])) * tone - canvas)

    def hides(self, window: Window, layer: Layer) -> np.ndarray:
        """How much (n,) of each sample of a layer in a window is behind it."""
        camera = window.camera
        if not self.faces(camera.centre_mm):
            return np.zeros(len(layer.cover))
        x, y = (ray[layer.at] for ray in window.rays())
        across, down, soft_across, soft_down, _ = _on_plane(camera, self.pose, x, y, window.soft_px)
        cover = _inside(self.print.x_mm, across, soft_across) * _inside(
            self.print.y_mm, down, soft_down
        )
        points = (
            self.pose[:, 3]
            + np.multiply.outer(across, self.pose[:, 0])
            + np.multiply.outer(down, self.pose[:, 1])
        )
        return cover * (np.linalg.norm(points - camera.centre_mm, axis=1) < layer.depth_mm)


def _on_plane(camera, pose, x, y, soft_px):
    """Where samples' rays meet the plane (mm), the two axes' blur (mm) there, and the correlation of the two."""
    to_camera = camera.rotation @ pose[:, :2]
    place = camera.rotation @ pose[:, 3] + camera.translation_mm
    inverse = np.linalg.inv(np.column_stack([to_camera, place])).astype(np.float32)
    # The third component is one over the depth; rays that miss the plane in front of the camera get one far away on it.
    scale = 1 / np.maximum(
        inverse[2, 0] * x + inverse[2, 1] * y + inverse[2, 2], np.float32(_NEVER)
    )
    across, down = ((inverse[i, 0] * x + inverse[i, 1] * y + inverse[i, 2]) * scale for i in (0, 1))
    soft = np.float32(soft_px) / np.float32([camera.matrix[0, 0], camera.matrix[1, 1]])
    (a0, a1), (d0, d1) = (
        (
            (inverse[i, 0] - p * inverse[2, 0]) * scale * soft[0],
            (inverse[i, 1] - p * inverse[2, 1]) * scale * soft[1],
        )
        for i, p in ((0, across), (1, down))
    )
    soft_across, soft_down = np.sqrt(a0**2 + a1**2), np.sqrt(d0**2 + d1**2)
    return across, down, soft_across, soft_down, (a0 * d0 + a1 * d1) / (soft_across * soft_down)


def _printed(print_, x, y, soft_x, soft_y, correlation):
    """Coverage and mean reflectance under a Gaussian of these widths: the cell of each sample and its eight
    neighbours.
    """
    cover = _inside(print_.x_mm, x, soft_x) * _inside(print_.y_mm, y, soft_y)
    if print_.reflectance.size == 1:
        return cover, np.float32(print_.reflectance[0, 0])
    column, weights_x, corner_x, near_x = _cells(print_.x_mm, x, soft_x)
    row, weights_y, corner_y, near_y = _cells(print_.y_mm, y, soft_y)
    table = np.pad(print_.reflectance, 2, mode="edge").astype(np.float32)
    width = table.shape[1]
    flat, at = table.ravel(), (row + 1) * width + column + 1
    tone = np.zeros_like(x)
    for j, wy in enumerate(weights_y):
        for i, wx in enumerate(weights_x):
            tone += wx * wy * flat[at + (j * width + i)]
    # Towards a corner the two edges' blurs are correlated: the leading terms of the bivariate normal integral.
    corner = (row + 1 + corner_y) * width + column + 1 + corner_x
    saddle = flat[corner] - flat[corner + 1] - flat[corner + width] + flat[corner + width + 1]
    density = np.exp(-0.5 * (near_x**2 + near_y**2)) / _ROOT_2PI**2
    terms = correlation * (
        1
        + 0.5 * correlation * near_x * near_y
        + correlation**2 / 6 * (near_x**2 - 1) * (near_y**2 - 1)
    )
    tone += saddle * density * terms
    return cover, tone


def _cells(edges, x, soft):
    """Cell of each sample, weights of the cell before, itself and the one after, which of its edges is nearer, and
    how far.
    """
    edges = edges.astype(np.float32)
    cell = np.clip(np.searchsorted(edges, x.ravel()).reshape(x.shape) - 1, 0, len(edges) - 2)
    low, high = (x - edges[cell]) / soft, (edges[cell + 1] - x) / soft
    before, after = ndtr(-low), ndtr(-high)
    first, last = cell == 0, cell == len(edges) - 2
    before[first], after[last] = 0, 0
    is_high = high < low
    return (
        cell,
        (before, 1 - before - after, after),
        is_high.astype(int),
        np.where(is_high, -high, low),
    )


def _inside(edges, x, soft):
    return ndtr((x - np.float32(edges[0])) / soft) * ndtr((np.float32(edges[-1]) - x) / soft)
