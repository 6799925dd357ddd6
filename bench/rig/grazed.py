"""A ring, a sphere and a cone as a camera at the origin sees them: how much of a sample their outline covers, and where
rays meet them first. Rays are (x, y, 1) in the camera's frame; the outline is where they graze the surface.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.special import ndtr

from bench.rig.bar import Bar
from bench.rig.rounded import Cone, Ring, Sphere

# mm below and above the height at which it is touched, along its axis: how much there is of a cone
_CONE_DOWN_MM, _CONE_UP_MM = 30.0, 60.0
_STATIONS = 64  # of a ring, from which the nearest to a ray is looked for
_COARSE = 8  # samples: every so many one is asked first, how near the ring is
_NEAR_MM, _MOST_STEPS = 1e-4, 100  # of marching along a ray to a ring


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays x, y (rows, columns) through samples, undistorted; `focal_px` (2,) and the blur of an edge, px."""

    x: np.ndarray
    y: np.ndarray
    focal_px: np.ndarray
    soft_px: float

    def covered(self, level: np.ndarray, by_x: np.ndarray, by_y: np.ndarray) -> np.ndarray:
        """How much of each sample is where a function of the rays is negative, by its derivatives there."""
        return ndtr(-level / (self.soft_px * np.hypot(by_x / self.focal_px[0], by_y / self.focal_px[1])))

    def beside(self, normal: np.ndarray) -> np.ndarray:
        """How much of each sample is on the negative side of a plane through the camera, by its normal (3,)."""
        return self.covered(normal[0] * self.x + normal[1] * self.y + normal[2], normal[0], normal[1])

    def within(self, conic: np.ndarray) -> np.ndarray:
        """How much of each sample is within a conic (3, 3), negative there."""
        by_x, by_y, rest = (row[0] * self.x + row[1] * self.y + row[2] for row in conic)
        return self.covered(0.5 * (self.x * by_x + self.y * by_y + rest), by_x, by_y)


@dataclass(frozen=True, eq=False)
class Hits:
    """Where rays (n,) meet a surface first: depths mm, NaN where they miss it; its normals there (n, 3); and how far
    the eye stands off the surface's straight or least curved direction, 0 to 1: what its darkening is measured by."""

    depth_mm: np.ndarray
    normals: np.ndarray
    across: np.ndarray


class Seen(Protocol):
    """An object in the camera's frame."""

    def points_mm(self) -> np.ndarray:
        """Points (n, 3) about which it lies, to some thousandths of its size."""

    def cover(self, rays: Rays) -> np.ndarray:
        """How much of each sample it covers (rows, columns)."""

    def hits(self, rays: np.ndarray) -> Hits:
        """Where rays (n, 3) meet it first."""


def seen(thing: Bar, rotation: np.ndarray, translation_mm: np.ndarray) -> Seen:
    """A ring, sphere or cone of the rig frame in that of a camera."""
    turn = rotation.T
    kinds = {Ring: SeenRing, Sphere: SeenSphere, Cone: SeenCone}
    return kinds[type(thing)](thing.seen_from(np.column_stack([turn, -turn @ translation_mm])))


@dataclass(frozen=True, eq=False)
class SeenSphere:
    """A sphere: its outline is a conic."""

    thing: Sphere

    def points_mm(self) -> np.ndarray:
        """As `Seen.points_mm`."""
        polar, around = np.meshgrid(np.linspace(0, np.pi, 33), np.linspace(0, 2 * np.pi, 65))
        ways = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], -1)
        return self.thing.point_mm + self.thing.radius_mm * ways.reshape(-1, 3)

    def cover(self, rays: Rays) -> np.ndarray:
        """As `Seen.cover`."""
        centre = self.thing.point_mm
        return rays.within((centre @ centre - self.thing.radius_mm**2) * np.eye(3) - np.outer(centre, centre))

    def hits(self, rays: np.ndarray) -> Hits:
        """As `Seen.hits`."""
        centre, radius = self.thing.point_mm, self.thing.radius_mm
        square, towards = (rays * rays).sum(1), rays @ centre
        root = towards**2 - square * (centre @ centre - radius**2)
        depth = (towards - np.sqrt(np.where(root > 0, root, np.nan))) / square
        return Hits(depth, (depth[:, None] * rays - centre) / radius, np.ones(len(rays)))


@dataclass(frozen=True, eq=False)
class SeenRing:
    """A ring: what is within its radius of a circle. A ray grazes it where it passes the circle at that distance."""

    thing: Ring

    def _circle(self, angles: np.ndarray) -> np.ndarray:
        """Points (..., 3) of the circle."""
        first, second = _across(self.thing.axis)
        ways = np.multiply.outer(np.cos(angles), first) + np.multiply.outer(np.sin(angles), second)
        return self.thing.point_mm + self.thing.ring_radius_mm * ways

    def points_mm(self) -> np.ndarray:
        """As `Seen.points_mm`: of the circle and a ball round each."""
        balls = np.concatenate([np.eye(3), -np.eye(3)]) * self.thing.radius_mm * math.sqrt(3)
        return (self._circle(np.linspace(0, 2 * np.pi, 129))[:, None] + balls).reshape(-1, 3)

    def cover(self, rays: Rays) -> np.ndarray:
        """As `Seen.cover`."""
        near = self._near(rays)
        cover = np.zeros(rays.x.shape)
        ways = np.stack([rays.x[near], rays.y[near], np.ones(near.sum())], -1)
        circle = self._circle(self._nearest(ways))
        point = ((circle * ways).sum(1) / (ways * ways).sum(1))[:, None] * ways
        away = np.linalg.norm(point - circle, axis=1)
        normal = (point - circle) / away[:, None]
        by_x, by_y = (point[:, 2] * normal[:, i] for i in (0, 1))
        cover[near] = rays.covered(away - self.thing.radius_mm, by_x, by_y)
        return cover

    def _near(self, rays: Rays) -> np.ndarray:
        """Samples (rows, columns) that the ring may cover: those about a coarser grid's that pass near it."""
        x, y = (a[::_COARSE, ::_COARSE] for a in (rays.x, rays.y))
        ways = np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3)
        circle = self._circle(self._nearest(ways))
        depth = (circle * ways).sum(1) / (ways * ways).sum(1)
        away = np.linalg.norm(depth[:, None] * ways - circle, axis=1)
        step = max(np.abs(np.diff(rays.x, axis=1)).max(initial=0), np.abs(np.diff(rays.y, axis=0)).max(initial=0))
        margin = (2 * _COARSE * step + 10 * rays.soft_px / rays.focal_px.min()) * depth
        near = (away < self.thing.radius_mm + margin).reshape(x.shape)
        rows, columns = rays.x.shape
        return np.repeat(np.repeat(near, _COARSE, 0), _COARSE, 1)[:rows, :columns]

    def _nearest(self, ways: np.ndarray) -> np.ndarray:
        """Angles (n,) of the circle's points that are nearest to rays (n, 3). A ray comes near it twice at most: the
        two lowest of stations that are lower than their neighbours, then Newton's method."""
        square = _HalfSquare.of(ways, self.thing, _across(self.thing.axis))
        found = [square.lowest(angles) for angles in square.low_stations()]
        return np.where(square.at(found[0]) <= square.at(found[1]), *found)

    def hits(self, rays: np.ndarray) -> Hits:
        """As `Seen.hits`: by steps along the ray as long as the surface is far."""
        thing, length = self.thing, np.linalg.norm(rays, axis=1)
        unit = rays / length[:, None]
        at = unit @ thing.point_mm - thing.ring_radius_mm - thing.radius_mm
        end = at + 2 * (thing.ring_radius_mm + thing.radius_mm)
        going = np.arange(len(rays))
        for _ in range(_MOST_STEPS):
            outside = thing.outside_mm(at[going, None] * unit[going])
            at[going] += outside
            going = going[(outside > _NEAR_MM) & (at[going] < end[going])]
            if not len(going):
                break
        points = at[:, None] * unit
        way = points - thing.foot_mm(points)
        normals = way / np.linalg.norm(way, axis=1)[:, None]
        along = np.cross(thing.axis, normals)
        along /= np.linalg.norm(along, axis=1)[:, None]
        return Hits(np.where(at < end, at / length, np.nan), normals, _off(unit, along))


@dataclass(frozen=True, eq=False)
class _HalfSquare:
    """Half the squares of the distances (n,) between rays and points of a circle, by the points' angle, but for what is
    the same of all angles: p·cos + q·sin − (a + b·cos + c·sin)²/2."""

    p: float
    q: float
    a: np.ndarray
    b: np.ndarray
    c: np.ndarray

    @classmethod
    def of(cls, ways: np.ndarray, ring: Ring, across: tuple[np.ndarray, np.ndarray]) -> "_HalfSquare":
        """Of rays (n, 3) and a ring's circle, angles from the first of two ways (3,) across its axis."""
        first, second = (ring.ring_radius_mm * way for way in across)
        unit, centre = ways / np.linalg.norm(ways, axis=1)[:, None], ring.point_mm
        return cls(centre @ first, centre @ second, unit @ centre, unit @ first, unit @ second)

    def at(self, angles: np.ndarray | float) -> np.ndarray:
        """Of one angle a ray, or of one for all."""
        cos, sin = np.cos(angles), np.sin(angles)
        return self.p * cos + self.q * sin - 0.5 * (self.a + self.b * cos + self.c * sin) ** 2

    def low_stations(self) -> tuple[np.ndarray, np.ndarray]:
        """The lowest and the next lowest (n,) of the stations that are lower than their neighbours."""
        stations = np.linspace(0, 2 * np.pi, _STATIONS, endpoint=False)
        lowest, lower = (np.full(len(self.a), np.inf) for _ in range(2))
        first, second = np.zeros(len(self.a)), np.zeros(len(self.a))
        before, here = self.at(stations[-1]), self.at(stations[0])
        for angle, after in zip(stations, np.roll(stations, -1)):
            value = self.at(after)
            low = (here <= before) & (here < value)
            best = low & (here < lowest)
            next_best = low & ~best & (here < lower)
            lower, second = np.where(best, lowest, lower), np.where(best, first, second)
            lower[next_best], second[next_best] = here[next_best], angle
            lowest[best], first[best] = here[best], angle
            before, here = here, value
        return first, np.where(np.isfinite(lower), second, first)

    def lowest(self, angles: np.ndarray) -> np.ndarray:
        """Where it is lowest near angles (n,)."""
        for _ in range(6):
            cos, sin = np.cos(angles), np.sin(angles)
            along, turned = self.a + self.b * cos + self.c * sin, self.c * cos - self.b * sin
            slope = self.q * cos - self.p * sin - along * turned
            bend = -self.p * cos - self.q * sin - turned**2 + along * (self.b * cos + self.c * sin)
            most = 2 * np.pi / _STATIONS
            step = np.where(bend > 0, slope / np.where(bend > 0, bend, 1), np.sign(slope) * most)
            angles = angles - np.clip(step, -most, most)
        return angles


@dataclass(frozen=True, eq=False)
class SeenCone:
    """A cone, from a flat base to its tip or to another flat end: its outline is that of both ends, two conics, and of
    the two planes through camera and tip that graze it."""

    thing: Cone

    def _ends(self) -> list[tuple[np.ndarray, float]]:
        """Centre (3,) and radius of base and upper end."""
        thing, sin = self.thing, math.sin(self.thing.half_angle_rad)
        touched = thing.radius_mm * (sin - 1 / sin)  # along the axis from the tip: the height of where it is touched
        heights = touched - _CONE_DOWN_MM, min(touched + _CONE_UP_MM, 0.0)
        tan = math.tan(thing.half_angle_rad)
        return [(thing.tip_mm + height * thing.axis, -height * tan) for height in heights]

    def points_mm(self) -> np.ndarray:
        """As `Seen.points_mm`."""
        angles = np.linspace(0, 2 * np.pi, 65)
        first, second = _across(self.thing.axis)
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
                touching = [centre + radius * _unit(plane - (plane @ self.thing.axis) * self.thing.axis)
                            for plane in planes]  # fmt: skip
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
        plane = np.stack(_across(_unit(self.thing.tip_mm)))
        axis = self.thing.axis
        form = plane @ (np.outer(centre, centre) + radius**2 * (np.outer(axis, axis) - np.eye(3))) @ plane.T
        (low, high), ways = np.linalg.eigh(form)
        if low >= 0 or high <= 0:
            return []
        normals = [(math.sqrt(high) * ways[:, 0] + side * math.sqrt(-low) * ways[:, 1]) @ plane for side in (-1, 1)]
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
        unit = rays / np.linalg.norm(rays, axis=1)[:, None]
        normals, across = cos * outward + sin * thing.axis, _off(unit, cos * thing.axis - sin * outward)
        for sign, end in zip((-1, 1), ends):
            on_end = end == depth
            normals[on_end], across[on_end] = sign * thing.axis, np.abs(unit[on_end] @ thing.axis)
        return Hits(depth, normals, across)

    def _side_hits(self, rays: np.ndarray) -> np.ndarray:
        """Depths (n,) of the slanting surface, NaN where a ray misses it."""
        thing, square = self.thing, math.cos(self.thing.half_angle_rad) ** 2
        tip, along, tip_along = thing.tip_mm, rays @ self.thing.axis, self.thing.tip_mm @ self.thing.axis
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


def _unit(way: np.ndarray) -> np.ndarray:
    return way / np.linalg.norm(way)


def _across(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (3,) across an axis and each other."""
    first = _unit(np.cross(axis, np.eye(3)[np.abs(axis).argmin()]))
    return first, np.cross(axis, first)


def _off(unit: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Sines (n,) of the angles between directions (n, 3)."""
    return np.sqrt(np.maximum(1 - (unit * along).sum(1) ** 2, 0))
