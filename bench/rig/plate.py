"""Flat printed rectangles: the board, markers, faces of boxes. Every edge of the print is
integrated, none is sampled.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import ndtr

from bench.rig.layer import Layer
from bench.rig.light import Light
from bench.rig.window import Window

_LEAST_INVERSE_DEPTH = np.float32(1e-5)  # 1/mm: of rays that miss the plane in front of the camera
_TINY_MM = 1e-9  # a direction from a circle's centre is none nearer than that
_ROOT_2PI = np.float32(np.sqrt(2 * np.pi))  # of the normal density, as wide as the samples


@dataclass(frozen=True, eq=False)
class Print:
    """A pattern of rectangular cells.

    reflectance (rows, columns). x_mm (columns + 1,), y_mm (rows + 1,): edges of the cells.
    """

    reflectance: np.ndarray
    x_mm: np.ndarray
    y_mm: np.ndarray

    @classmethod
    def plain(cls, width_mm: float, height_mm: float, reflectance: float) -> "Print":
        """Return a print of one grey."""
        return cls(np.array([[reflectance]]), np.array([0.0, width_mm]), np.array([0.0, height_mm]))

    def shift(self, x_mm: float, y_mm: float) -> "Print":
        """Return the print with its coordinates shifted."""
        return Print(self.reflectance, self.x_mm + x_mm, self.y_mm + y_mm)

    def tone(self, across: "_Footprint", down: "_Footprint") -> np.ndarray:
        """Return the mean reflectance under each of some spots: of its cell and the eight neighbours."""
        if self.reflectance.size == 1:
            return np.float32(self.reflectance[0, 0])
        column = _Cells.find(self.x_mm, across)
        row = _Cells.find(self.y_mm, down)
        padded = np.pad(self.reflectance, 2, mode="edge").astype(np.float32)
        width = padded.shape[1]
        reflectance = padded.ravel()
        first = (row.cell + 1) * width + column.cell + 1  # of the nine cells
        tone = np.zeros_like(across.mm)
        for j, i in np.ndindex(3, 3):
            tone += column.weights[i] * row.weights[j] * reflectance[first + (j * width + i)]
        corner = first + row.is_last_nearer * width + column.is_last_nearer
        saddle = _saddle(reflectance, corner, width)
        return tone + saddle * _corner_share(across, down, column.edge_distance, row.edge_distance)

    def frame(self, margin_mm: float, reflectance: float) -> "Print":
        """Return the print with a margin of one grey all round."""
        edges = []
        for inner in (self.x_mm, self.y_mm):
            edges.append(np.concatenate([[inner[0] - margin_mm], inner, [inner[-1] + margin_mm]]))
        return Print(np.pad(self.reflectance, 1, constant_values=reflectance), *edges)


@dataclass(frozen=True, eq=False)
class CirclePrint:
    """Circles of one grey on paper of another.

    centres_mm (n, 2). paper, ink: reflectances. x_mm, y_mm (2,): the paper's edges.
    """

    centres_mm: np.ndarray
    radius_mm: float
    paper: float
    ink: float
    x_mm: np.ndarray
    y_mm: np.ndarray

    def tone(self, across: "_Footprint", down: "_Footprint") -> np.ndarray:
        """Return the mean reflectance under each of some spots, which are smaller than a circle.

        The circle's edge is taken as a parabola: where it curves away, less of the spot is on ink.
        """
        places = np.stack([across.mm, down.mm], axis=-1)  # (..., 2)
        distance_mm, nearest = cKDTree(self.centres_mm).query(places)
        from_centre = places - self.centres_mm[nearest]
        cosine, sine = np.moveaxis(
            from_centre / np.maximum(distance_mm, _TINY_MM)[..., None], -1, 0
        )
        normal = _size_towards(cosine, sine, across, down)
        along = _size_towards(-sine, cosine, across, down)
        beyond_mm = distance_mm - self.radius_mm + 0.5 * along**2 / self.radius_mm
        is_ink = ndtr(-beyond_mm / normal)
        return (self.paper + (self.ink - self.paper) * is_ink).astype(np.float32)


def _size_towards(
    x: np.ndarray, y: np.ndarray, across: "_Footprint", down: "_Footprint"
) -> np.ndarray:
    """Return the size of each spot towards the unit vector (x, y) on the print."""
    return np.hypot(x * across.by_x + y * down.by_x, x * across.by_y + y * down.by_y)


@dataclass(frozen=True, eq=False)
class Plate:
    """A print in space.

    pose (3, 4), T_rig_plate: its x and y run along the print, its z away from the print's viewer.
    """

    print: Print | CirclePrint
    pose: np.ndarray

    def corners_mm(self) -> np.ndarray:
        """Return the corners (4, 3) in the rig frame."""
        left, right = self.print.x_mm[[0, -1]]
        top, bottom = self.print.y_mm[[0, -1]]
        corners = np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
        return self._in_rig(corners)

    def _in_rig(self, points_mm):
        """Convert points (n, 2) of the print to the rig frame, (n, 3)."""
        return points_mm @ self.pose[:, :2].T + self.pose[:, 3]

    def faces(self, point_mm: np.ndarray) -> bool:
        """Return whether the print is visible from a point (3,)."""
        return float((point_mm - self.pose[:, 3]) @ self.pose[:, 2]) < 0

    def draw(self, window: Window, radiance: np.ndarray, light: Light) -> None:
        """Draw the print over what is there, where the camera is in front of it."""
        camera = window.camera
        corners = self.corners_mm()
        is_ahead = (camera.in_camera(corners)[:, 2] > 1).all()
        if not is_ahead or not self.faces(camera.centre_mm):
            return
        part = window.crop(camera.project(corners), 4 * window.soft_px + 2)
        if part is None:
            return
        across, down = self._footprints(part, *part.rays())
        cover = _coverage(self.print, across, down)
        tone = np.float32(light.shade_flat(-self.pose[:, 2])) * self.print.tone(across, down)
        canvas = radiance[part.slices_in(window)]
        canvas += cover * (tone - canvas)

    def hide(self, layer: Layer, window: Window) -> Layer:
        """Return a layer of a window, uncovered where the plate is before it."""
        camera = window.camera
        if not self.faces(camera.centre_mm):
            return layer
        x, y = (ray[layer.index] for ray in window.rays())
        across, down = self._footprints(window, x, y)
        points = self._in_rig(np.column_stack([across.mm, down.mm]))
        is_nearer = np.linalg.norm(points - camera.centre_mm, axis=1) < layer.depth_mm
        hidden = _coverage(self.print, across, down) * is_nearer
        return replace(layer, cover=layer.cover * (1 - hidden))

    def _footprints(self, window, x, y):
        """Return the footprints of a window's rays x, y on the print's two axes."""
        camera = window.camera
        across, down, depth = self._rays_to_print(camera)  # rows of the homography
        inverse_depth = depth[0] * x + depth[1] * y + depth[2]
        scale = 1 / np.maximum(inverse_depth, _LEAST_INVERSE_DEPTH)
        focal_px = np.diag(camera.matrix)[:2].astype(np.float32)
        soft = np.float32(window.soft_px) / focal_px  # of rays
        footprints = []
        for row in (across, down):
            mm = (row[0] * x + row[1] * y + row[2]) * scale
            by_x = (row[0] - mm * depth[0]) * scale * soft[0]
            by_y = (row[1] - mm * depth[1]) * scale * soft[1]
            footprints.append(_Footprint(mm, by_x, by_y))
        return footprints

    def _rays_to_print(self, camera):
        """Return the matrix (3, 3) that takes a ray (x, y, 1) to (across, down, 1) over the depth."""
        axes = camera.rotation @ self.pose[:, :2]
        origin = camera.in_camera(self.pose[:, 3])
        return np.linalg.inv(np.column_stack([axes, origin])).astype(np.float32)


@dataclass(frozen=True, eq=False)
class _Footprint:
    """The Gaussian spots that samples' blurs are on a plane, along one of its axes.

    mm: their middles. by_x, by_y: mm by one sigma of the blur along the picture's x and y. All have
    the samples' shape.
    """

    mm: np.ndarray
    by_x: np.ndarray
    by_y: np.ndarray

    @cached_property
    def soft_mm(self) -> np.ndarray:
        """Return the spots' sigmas."""
        return np.sqrt(self.by_x**2 + self.by_y**2)


def _coverage(print_, across, down):
    """Return how much of each spot is on a print."""
    return _inside(print_.x_mm, across) * _inside(print_.y_mm, down)


def _inside(edges, spot):
    """Return how much of each spot lies between the first and the last of edges."""
    beyond_first = ndtr((spot.mm - np.float32(edges[0])) / spot.soft_mm)
    before_last = ndtr((np.float32(edges[-1]) - spot.mm) / spot.soft_mm)
    return beyond_first * before_last


def _saddle(reflectance, cell, width):
    """Return how much the two cells on one diagonal are brighter than those on the other.

    reflectance (n,): of all cells, row by row. cell: number of the upper left one. width: of a row.
    """
    saddle = reflectance[cell] - reflectance[cell + 1]
    saddle += reflectance[cell + width + 1] - reflectance[cell + width]
    return saddle


def _corner_share(across, down, x, y):
    """Return the share of each spot in two opposite cells at a corner that its correlation adds.

    x, y: distances from the corner, in sigmas. The leading terms of the bivariate normal integral.
    """
    density = np.exp(-0.5 * (x**2 + y**2)) / _ROOT_2PI**2
    covariance = across.by_x * down.by_x + across.by_y * down.by_y
    correlation = covariance / (across.soft_mm * down.soft_mm)
    third = correlation**2 / 6 * (x**2 - 1) * (y**2 - 1)
    return density * correlation * (1 + 0.5 * correlation * x * y + third)


@dataclass(frozen=True, eq=False)
class _Cells:
    """The cells of a print, along one axis, in which spots lie.

    cell: number of each spot's cell. weights: share of the spot in the cell before, in its own and
    in the one after. is_last_nearer: whether the cell's last edge is nearer than its first.
    edge_distance: from the spot's middle to the nearer edge, in sigmas, positive beyond it.
    """

    cell: np.ndarray
    weights: tuple[np.ndarray, np.ndarray, np.ndarray]
    is_last_nearer: np.ndarray
    edge_distance: np.ndarray

    @classmethod
    def find(cls, edges, spot):
        """Find the cells between edges (n,) in which spots lie."""
        edges = edges.astype(np.float32)
        last_cell = len(edges) - 2
        cell = np.searchsorted(edges, spot.mm.ravel()).reshape(spot.mm.shape) - 1
        cell = np.clip(cell, 0, last_cell)
        from_first = (spot.mm - edges[cell]) / spot.soft_mm
        to_last = (edges[cell + 1] - spot.mm) / spot.soft_mm
        before = np.where(cell == 0, np.float32(0), ndtr(-from_first))
        after = np.where(cell == last_cell, np.float32(0), ndtr(-to_last))
        is_last_nearer = to_last < from_first
        distance = np.where(is_last_nearer, -to_last, from_first)
        return cls(cell, (before, 1 - before - after, after), is_last_nearer, distance)
