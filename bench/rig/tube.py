"""Round things along a curve: whisker, bar, posts. Their edges are the exact silhouettes, integrated
over the blur."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from bench.rig.layer import Layer, Occluder, draw_layers
from bench.rig.light import Light, Material, shade_surface
from bench.rig.pinhole import PinholeCamera
from bench.rig.rays import unit
from bench.rig.window import Window

_GAUSS = 0.5 / np.sqrt(3)  # Gauss–Legendre's two points across a sample
_STATIONS = 160  # of a straight tube's axis
_SIDES = np.array([-1.0, 1.0])[:, None, None]  # of the two silhouettes


@dataclass(frozen=True, eq=False)
class Tube:
    """A round body along a curve in the rig frame.

    axis_mm (n, 3): points close enough to be joined by straight lines. radius_mm (n,).
    """

    axis_mm: np.ndarray
    radius_mm: np.ndarray
    material: Material

    @classmethod
    def straight(
        cls, start_mm: np.ndarray, end_mm: np.ndarray, radius_mm: float, material: Material
    ) -> "Tube":
        """Return a straight tube of one radius between two points (3,)."""
        share = np.linspace(0, 1, _STATIONS)[:, None]
        axis = (1 - share) * np.asarray(start_mm, float) + share * np.asarray(end_mm, float)
        return cls(axis, np.full(_STATIONS, float(radius_mm)), material)

    def silhouette(self, camera: PinholeCamera) -> np.ndarray:
        """Return the pixels (2, n, 2) of both edges, where rays graze the round surface."""
        facing, across, distance = self._axes_towards(camera)
        cos = (self.radius_mm / distance)[:, None]
        sin = np.sqrt(1 - cos**2)
        normals = cos * facing + _SIDES * sin * across  # (2, n, 3)
        edges = self.axis_mm + self.radius_mm[:, None] * normals
        return camera.project(edges).reshape(2, -1, 2)

    def _axes_towards(self, camera):
        """Return unit vectors (n, 3) towards a camera and across, both normal to the axis, and the
        camera's distances (n,) from the axis' tangents."""
        tangent = unit(np.gradient(self.axis_mm, axis=0, edge_order=2))
        towards = camera.centre_mm - self.axis_mm
        along = (towards * tangent).sum(1)[:, None] * tangent
        distance = np.linalg.norm(towards - along, axis=1)
        facing = (towards - along) / distance[:, None]
        return facing, np.cross(tangent, facing), distance

    def draw(self, window: Window, radiance: np.ndarray, light: Light) -> None:
        """Draw the tube over what is there."""
        draw_tubes([self], window, radiance, light)

    def layer(self, window: Window, light: Light) -> Layer | None:
        """Return the tube's layer in the samples of a window; None where it is not in it."""
        edges = self.silhouette(window.camera)
        part = window.crop(edges.reshape(-1, 2), 4 * window.soft_px + 2)
        if part is None:
            return None
        strip = _Strip.from_edges(edges)
        index = strip.find_samples(part, 4.5 * window.soft_px + 1)
        along, side = strip.from_px(np.stack([part.u_px[index[1]], part.v_px[index[0]]], -1))
        cover, position, per_px = strip.cover(along, side, window.soft_px)
        sample = per_px / window.fine
        tone = self._shade(window.camera, light, strip, along, position, sample)
        distance = np.linalg.norm(self.axis_mm - window.camera.centre_mm, axis=1)
        depth = strip.interpolate(along, distance)
        return Layer(part.index_in(window, index), cover, tone, depth)

    def _shade(self, camera, light, strip, along, position, sample):
        """Return the mean brightness (n,) over each sample's part of the tube.

        along (n,): px along the strip. position (n,): −1 on one silhouette to 1 on the other; there
        sample (n,) is a sample's width. Two Gauss points are averaged, both on the tube.
        """
        lamp_facing, lamp_across, half_facing, half_across = self._light_cosines(
            camera, light, strip, along
        )
        limit = np.maximum(1 - sample / 4, 0)
        total = 0.0
        for step in (-_GAUSS, _GAUSS):
            sin = np.clip(position + step * sample, -limit, limit)
            cos = np.sqrt(np.maximum(1 - sin**2, 0))
            lamp = cos * lamp_facing + sin * lamp_across
            mirror = cos * half_facing + sin * half_across
            total = total + shade_surface(light, self.material, lamp, mirror, cos)
        return 0.5 * total

    def _light_cosines(self, camera, light, strip, along):
        """Return four cosines (n,) at places along the strip: between the axes towards and across
        the camera and the lamp, then the direction half-way to the lamp.

        Along the picture of a tube they change slowly; across it not at all.
        """
        facing, across, _ = self._axes_towards(camera)
        half = unit(unit(camera.centre_mm - self.axis_mm) + light.towards)
        lamp_facing = strip.interpolate(along, facing @ light.towards)
        lamp_across = strip.interpolate(along, across @ light.towards)
        half_facing = strip.interpolate(along, (facing * half).sum(1))
        half_across = strip.interpolate(along, (across * half).sum(1))
        return lamp_facing, lamp_across, half_facing, half_across


def draw_tubes(
    tubes: Sequence[Tube],
    window: Window,
    radiance: np.ndarray,
    light: Light,
    occluder: Occluder | None = None,
) -> None:
    """Draw tubes over what is there, in each sample the nearer over the farther.

    occluder: an object that is drawn already and hides what is behind it.
    """
    layers = []
    for tube in tubes:
        layer = tube.layer(window, light)
        if layer is not None:
            layers.append(layer if occluder is None else occluder.hide(layer, window))
    draw_layers(layers, radiance)


@dataclass(frozen=True, eq=False)
class _Strip:
    """The picture's plane turned so that a tube runs along its first axis.

    start (2,) px: its origin. turn (2, 2): from the picture's axes. along, side (2, n) px: places
    of the two edges on the first and the second axis.
    """

    start: np.ndarray
    turn: np.ndarray
    along: np.ndarray
    side: np.ndarray

    @classmethod
    def from_edges(cls, edges) -> "_Strip":
        """Return the strip of a tube's two edges (2, n, 2) px."""
        middle = 0.5 * (edges[0] + edges[1])
        x, y = unit(middle[-1] - middle[0])
        turn = np.array([[x, y], [-y, x]])
        along, side = np.moveaxis((edges - middle[0]) @ turn.T, -1, 0)
        return cls(middle[0], turn, along, side)

    def from_px(self, px):
        """Return the places along the strip and to its side, (n,) each, of pixels (n, 2)."""
        along, side = np.moveaxis((px - self.start) @ self.turn.T, -1, 0)
        return along, side

    def interpolate(self, along, values):
        """Interpolate values (n,) at the tube's stations to places along the strip."""
        return np.interp(along, self.along.mean(0), values)

    def edge(self, number, along):
        """Return the side of an edge at places along the strip, and the cosine of its slope."""
        x = self.along[number]
        y = self.side[number]
        slope = np.interp(along, x, np.gradient(y, x))
        return _extrapolate(along, x, y), 1 / np.sqrt(1 + slope**2)

    def cover(self, along, side, soft_px):
        """Return, of samples at places along the strip and to its side, (n,) each: how much of each
        the tube covers, its position from −1 on one silhouette to 1 on the other, and that by px."""
        low, cos_low = self.edge(0, along)
        high, cos_high = self.edge(1, along)
        sharpness = np.sign(high - low) / soft_px
        cover = ndtr((side - low) * cos_low * sharpness)
        cover -= ndtr((side - high) * cos_high * sharpness)
        start, end = self.along.mean(0)[[0, -1]]
        cover *= ndtr((along - start) / soft_px) * ndtr((end - along) / soft_px)
        position = np.clip(2 * (side - low) / (high - low) - 1, -1, 1)
        return cover, position, 2 / np.abs(high - low)

    def find_samples(self, window, margin):
        """Find the samples of a window within a margin, px, of the tube; return rows and columns."""
        width = np.hypot(self.along[0] - self.along[1], self.side[0] - self.side[1])
        reach = 0.5 * width.max() + margin
        middle = self.side.mean(0)
        u = window.u_px.astype(np.float32) - np.float32(self.start[0])
        v = window.v_px.astype(np.float32) - np.float32(self.start[1])
        sin, cos = self.turn[1].astype(np.float32)
        side = np.add.outer(cos * v, sin * u)  # (rows, columns): place to the strip's side
        is_inside = (side > middle.min() - reach) & (side < middle.max() + reach)
        return np.nonzero(is_inside)


def _extrapolate(x, at, values):
    """Interpolate values (n,) at places (n,) linearly, and straight on beyond both ends."""
    first_slope = (values[1] - values[0]) / (at[1] - at[0])
    last_slope = (values[-1] - values[-2]) / (at[-1] - at[-2])
    before = np.minimum(x - at[0], 0.0)
    beyond = np.maximum(x - at[-1], 0.0)
    return np.interp(x, at, values) + first_slope * before + last_slope * beyond
