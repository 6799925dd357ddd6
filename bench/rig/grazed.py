"""Rings, spheres and cones as a camera at the origin sees them; the outline is where rays graze the surface."""

import math
from dataclasses import dataclass

import numpy as np

from bench.rig.bar import Bar
from bench.rig.grazed_ring import SeenRing
from bench.rig.rays import Hits, Rays, Seen, across, sine_off, unit
from bench.rig.round_objects import Cone, Ring, Sphere

# mm below and above the height at which it is touched, along its axis: how much there is of a cone
_CONE_DOWN_MM, _CONE_UP_MM = 30.0, 60.0


def seen(thing: Bar, rotation: np.ndarray, translation_mm: np.ndarray) -> Seen:
    """A ring, sphere or cone of the rig frame in that of a camera."""
    turn = rotation.T
    kinds = {Ring: SeenRing, Sphere: SeenSphere, Cone: SeenCone}
    return kinds[type(thing)](thing.in_frame(np.column_stack([turn, -turn @ translation_mm])))


@dataclass(frozen=True, eq=False)
class SeenSphere:
    """A sphere: its outline is a conic."""

    thing: Sphere

    def points_mm(self) -> np.ndarray:
        """As `Seen.points_mm`."""
        polar, around = np.meshgrid(np.linspace(0, np.pi, 33), np.linspace(0, 2 * np.pi, 65))
        ways = np.stack(
            [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], -1
        )
        return self.thing.point_mm + self.thing.radius_mm * ways.reshape(-1, 3)

    def cover(self, rays: Rays) -> np.ndarray:
        """As `Seen.cover`."""
        centre = self.thing.point_mm
        return rays.within(
            (centre @ centre - self.thing.radius_mm**2) * np.eye(3) - np.outer(centre, centre)
        )

    def hits(self, rays: np.ndarray) -> Hits:
        """As `Seen.hits`."""
        centre, radius = self.thing.point_mm, self.thing.radius_mm
        square, towards = (rays * rays).sum(1), rays @ centre
        root = towards**2 - square * (centre @ centre - radius**2)
        depth = (towards - np.sqrt(np.where(root > 0, root, np.nan))) / square
        return Hits(depth, (depth[:, None] * rays - centre) / radius, np.ones(len(rays)))


@dataclass(frozen=True, eq=False)
class SeenCone:
    """A cone, from a flat base to its tip or to another flat end: its outline is that of both ends, two conics, and of
    the two planes through camera and tip that graze it."""

    thing: Cone

    def _ends(self) -> list[tuple[np.ndarray, float]]:
        """Centre (3,) and radius of base and upper end."""
        thing, sin = self.thing, math.sin(self.thing.half_angle_rad)
        touched = thing.radius_mm * (
            sin - 1 / sin
        )  # along the axis from the tip: the height of where it is touched
        heights = touched - _CONE_DOWN_MM, min(touched + _CONE_UP_MM, 0.0)
        tan = math.tan(thing.half_angle_rad)
        return [(thing.tip_mm + height * thing.axis, -height * tan) for height in heights]

    def points_mm(self) -> np.ndarray:
        """As `Seen.points_mm`."""
        angles = np.linspace(0, 2 * np.pi, 65)
        first, second = across(self.thing.axis)
        ways = np.outer(np.cos(angles), first) + np.outer(np.sin(angles), second)
        return np.concatenate([centre + radius * ways for centre, radius in self._ends()])

    def cover(self, rays: Rays) -> np.ndarray:
        """As `Seen.cover`."""
        ends = self._ends()
        cover = np.maximum(*(self._of_disc(rays, *end) for end in ends))
        planes = self._grazing(*ends[0])
        if not planes:
            return cover
        sides = rays.beside(planes[0]) * rays.beside(planes[1])
        for (centre, radius), (other, _) in zip(ends, ends[::-1]):
            if radius:
                touching = [
                    centre + radius * unit(plane - (plane @ self.thing.axis) * self.thing.axis)
                    for plane in planes
                ]
                chord = np.cross(*touching)
                sides = sides * rays.beside(-np.copysign(1.0, chord @ other) * chord)
        return np.maximum(cover, sides)

    def _of_disc(self, rays: Rays, centre: np.ndarray, radius: float) -> np.ndarray:
        """Of a flat end: the rays that meet its plane within its circle."""
        axis = self.thing.axis
        if not radius:
            return np.zeros_like(rays.x)
        way = (axis @ centre) * np.eye(3) - np.outer(centre, axis)
        return rays.within(way.T @ way - radius**2 * np.outer(axis, axis))

    def _grazing(self, centre: np.ndarray, radius: float) -> list[np.ndarray]:
        """Normals (3,) of the planes through camera and tip that graze it, pointing away from it; none where the
        camera looks at the tip from within its cone."""
        plane = np.stack(across(unit(self.thing.tip_mm)))
        axis = self.thing.axis
        form = (
            plane
            @ (np.outer(centre, centre) + radius**2 * (np.outer(axis, axis) - np.eye(3)))
            @ plane.T
        )
        (low, high), ways = np.linalg.eigh(form)
        if low >= 0 or high <= 0:
            return []
        normals = [
            (math.sqrt(high) * ways[:, 0] + side * math.sqrt(-low) * ways[:, 1]) @ plane
            for side in (-1, 1)
        ]
        return [-np.copysign(1.0, normal @ centre) * normal for normal in normals]

    def hits(self, rays: np.ndarray) -> Hits:
        """As `Seen.hits`."""
        sides, ends = self._side_hits(rays), [self._end_hits(rays, *end) for end in self._ends()]
        depth = np.fmin(sides, np.fmin(*ends))
        thing, point = self.thing, depth[:, None] * rays
        apart = point - thing.point_mm
        flat = apart - np.multiply.outer(apart @ thing.axis, thing.axis)
        outward = flat / np.linalg.norm(flat, axis=1)[:, None]
        sin, cos = math.sin(thing.half_angle_rad), math.cos(thing.half_angle_rad)
        ways = rays / np.linalg.norm(rays, axis=1)[:, None]
        normals, across = (
            cos * outward + sin * thing.axis,
            sine_off(ways, cos * thing.axis - sin * outward),
        )
        for sign, end in zip((-1, 1), ends):
            on_end = end == depth
            normals[on_end], across[on_end] = sign * thing.axis, np.abs(ways[on_end] @ thing.axis)
        return Hits(depth, normals, across)

    def _side_hits(self, rays: np.ndarray) -> np.ndarray:
        """Depths (n,) of the slanting surface, NaN where a ray misses it."""
        thing, square = self.thing, math.cos(self.thing.half_angle_rad) ** 2
        tip, along, tip_along = (
            thing.tip_mm,
            rays @ self.thing.axis,
            self.thing.tip_mm @ self.thing.axis,
        )
        a = along**2 - square * (rays * rays).sum(1)
        b = square * (rays @ tip) - along * tip_along
        root = b**2 - a * (tip_along**2 - square * (tip @ tip))
        root = np.sqrt(np.where(root > 0, root, np.nan))
        (low, _), (high, _) = self._ends()
        depths = []
        for sign in (-1, 1):
            depth = (-b + sign * root) / a
            height = depth * along
            there = (height > low @ thing.axis) & (height < high @ thing.axis)
            depths.append(np.where(there & (depth > 0), depth, np.nan))
        return np.fmin(*depths)

    def _end_hits(self, rays: np.ndarray, centre: np.ndarray, radius: float) -> np.ndarray:
        """Depths (n,) of a flat end, likewise."""
        depth = (centre @ self.thing.axis) / (rays @ self.thing.axis)
        within = np.linalg.norm(depth[:, None] * rays - centre, axis=1) < radius
        return np.where(within & (depth > 0), depth, np.nan)
