"""Round things along a curve: whisker, bar, posts. Their edges are the exact silhouettes, integrated over the blur."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from bench.rig.layer import Front, Layer, draw_layers
from bench.rig.light import Light, Material, round_shade
from bench.rig.pinhole import Camera
from bench.rig.window import Window

_GAUSS = 0.5 / np.sqrt(3)  # Gauss–Legendre's two points across a sample


@dataclass(frozen=True, eq=False)
class Tube:
    """Points (n, 3) of the axis in the rig frame, close enough to be joined by straight lines; radii (n,); a
    material.
    """

    axis_mm: np.ndarray
    radius_mm: np.ndarray
    material: Material

    @classmethod
    def straight(
        cls,
        start_mm: np.ndarray,
        end_mm: np.ndarray,
        radius_mm: float,
        material: Material,
        stations: int = 160,
    ) -> "Tube":
        """A straight tube of one radius."""
        at = np.linspace(0, 1, stations)[:, None]
        axis = (1 - at) * np.asarray(start_mm, float) + at * np.asarray(end_mm, float)
        return cls(axis, np.full(stations, float(radius_mm)), material)

    def silhouette(self, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
        """Pixels of the two edges (n, 2) each: where the rays graze the round surface."""
        facing, aside, near = self._seen_from(camera.centre_mm)
        cos = (self.radius_mm / near)[:, None]
        sin = np.sqrt(1 - cos**2)
        return tuple(
            camera.project(
                self.axis_mm + self.radius_mm[:, None] * (cos * facing + s * sin * aside)
            )
            for s in (-1, 1)
        )

    def _tangent(self):
        tangent = np.gradient(self.axis_mm, axis=0, edge_order=2)
        return tangent / np.linalg.norm(tangent, axis=1)[:, None]

    def _seen_from(self, centre):
        """Unit vectors towards the camera and across (both normal to the axis), and the distance of the camera's axis
        line.
        """
        tangent, towards = self._tangent(), centre - self.axis_mm
        square = towards - (towards * tangent).sum(1)[:, None] * tangent
        near = np.linalg.norm(square, axis=1)
        facing = square / near[:, None]
        return facing, np.cross(tangent, facing), near

    def draw(self, window: Window, radiance: np.ndarray, light: Light) -> None:
        """Over what is drawn."""
        layer = self.layer(window, light)
        if layer is not None:
            at = layer.at
            radiance[at] += (layer.cover * (layer.tone - radiance[at])).astype(np.float32)

    def layer(self, window: Window, light: Light) -> "Layer | None":
        """What the tube is in the samples of a window; None where it is not in it."""
        edges = self.silhouette(window.camera)
        part = window.around(np.concatenate(edges), 4 * window.soft_px + 2)
        if part is None:
            return None
        frame = _Frame.of(edges)
        at, u, v = _band(part, frame, edges, 4.5 * window.soft_px + 1)
        along, side = frame.of_px(np.stack([u, v], -1))
        cover, across, per_px = frame.cover(along, side, window.soft_px)
        tone = self._shade(window.camera, light, frame, along, across, per_px / window.fine)
        depth = frame.at(along, np.linalg.norm(self.axis_mm - window.camera.centre_mm, axis=1))
        rows, columns = part.within(window)
        return Layer((at[0] + rows.start, at[1] + columns.start), cover, tone, depth)

    def _shade(self, camera, light, frame, along, across, sample):
        """Mean brightness over a sample's part of the tube: two Gauss points, both on the tube."""
        facing, aside, _ = self._seen_from(camera.centre_mm)
        towards = camera.centre_mm - self.axis_mm
        half = towards / np.linalg.norm(towards, axis=1)[:, None] + light.towards
        half /= np.linalg.norm(half, axis=1)[:, None]
        lamp = facing @ light.towards, aside @ light.towards
        mirror = (facing * half).sum(1), (aside * half).sum(1)
        # Along the picture of a tube these four change slowly; across it not at all.
        lamp, mirror = ([frame.at(along, c) for c in pair] for pair in (lamp, mirror))
        limit = np.maximum(1 - sample / 4, 0)
        points = (np.clip(across + s * sample * _GAUSS, -limit, limit) for s in (-1, 1))
        return 0.5 * sum(round_shade(light, self.material, p, *lamp, mirror) for p in points)


def draw_tubes(
    tubes: Sequence[Tube],
    window: Window,
    radiance: np.ndarray,
    light: Light,
    front: Front | None = None,
) -> None:
    """Several tubes over what is drawn: in each sample the nearer over the farther, all but behind an object."""
    if len(tubes) == 1 and front is None:
        tubes[0].draw(window, radiance, light)
        return
    layers = [layer for layer in (tube.layer(window, light) for tube in tubes) if layer is not None]
    draw_layers(
        layers if front is None else [front.left_of(layer, window) for layer in layers], radiance
    )


@dataclass(frozen=True, eq=False)
class _Frame:
    """The picture's plane turned so that a tube runs along the first axis; the two edges as functions of it."""

    start: np.ndarray
    turn: np.ndarray
    along: tuple[np.ndarray, np.ndarray]
    side: tuple[np.ndarray, np.ndarray]

    @classmethod
    def of(cls, edges) -> "_Frame":
        middle = 0.5 * (edges[0] + edges[1])
        ahead = (middle[-1] - middle[0]) / np.linalg.norm(middle[-1] - middle[0])
        turn = np.array([[ahead[0], ahead[1]], [-ahead[1], ahead[0]]])
        a, b = (((e - middle[0]) @ turn.T) for e in edges)
        return cls(middle[0], turn, (a[:, 0], b[:, 0]), (a[:, 1], b[:, 1]))

    def of_px(self, px):
        along, side = np.moveaxis((px - self.start) @ self.turn.T, -1, 0)
        return along, side

    def at(self, along, values):
        return np.interp(along, 0.5 * (self.along[0] + self.along[1]), values)

    def edge(self, i, along):
        """Side position of an edge and the cosine of its slope."""
        x, y = self.along[i], self.side[i]
        slope = np.gradient(y, x)
        return _straight_on(along, x, y), 1 / np.sqrt(1 + np.interp(along, x, slope) ** 2)

    def cover(self, along, side, soft):
        """Coverage under the blur; position across the tube, −1 on one silhouette and 1 on the other; how much a
        pixel is.
        """
        (low, cos_low), (high, cos_high) = self.edge(0, along), self.edge(1, along)
        sign = np.sign(high - low)
        cover = ndtr(sign * (side - low) * cos_low / soft) - ndtr(
            sign * (side - high) * cos_high / soft
        )
        start, end = (0.5 * (self.along[0][i] + self.along[1][i]) for i in (0, -1))
        cover = cover * ndtr((along - start) / soft) * ndtr((end - along) / soft)
        return cover, np.clip(2 * (side - low) / (high - low) - 1, -1, 1), 2 / np.abs(high - low)


def _straight_on(x, at, values):
    """Linear interpolation that goes straight on beyond both ends."""
    inside = np.interp(x, at, values)
    for end, inner, beyond in ((0, 1, x < at[0]), (-1, -2, x > at[-1])):
        slope = (values[end] - values[inner]) / (at[end] - at[inner])
        inside = np.where(beyond, values[end] + slope * (x - at[end]), inside)
    return inside


def _band(part, frame, edges, margin):
    """Samples of the window near the tube: their indices and positions."""
    half = 0.5 * max(np.linalg.norm(edges[0] - edges[1], axis=1)) + margin
    bend = 0.5 * (frame.side[0] + frame.side[1])
    u, v = part.u_px.astype(np.float32), part.v_px.astype(np.float32)
    du, dv = u - np.float32(frame.start[0]), v - np.float32(frame.start[1])
    side = np.add.outer(np.float32(frame.turn[1, 1]) * dv, np.float32(frame.turn[1, 0]) * du)
    near = np.nonzero((side > bend.min() - half) & (side < bend.max() + half))
    return near, part.u_px[near[1]], part.v_px[near[0]]
