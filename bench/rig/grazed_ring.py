"""A ring as a camera at the origin sees it: rays graze it where they pass its circle at the bar's radius."""

import math
from dataclasses import dataclass

import numpy as np

from bench.rig.rays import Hits, Rays, across, sine_off
from bench.rig.round_objects import Ring

_STATIONS = 64  # of a ring, from which the nearest to a ray is looked for
_COARSE = 8  # samples: every so many one is asked first, how near the ring is
_NEAR_MM, _MOST_STEPS = 1e-4, 100  # of marching along a ray


@dataclass(frozen=True, eq=False)
class SeenRing:
    """A ring: what is within its radius of a circle. A ray grazes it where it passes the circle at that distance."""

    thing: Ring

    def _circle(self, angles: np.ndarray) -> np.ndarray:
        """Points (..., 3) of the circle."""
        first, second = across(self.thing.axis)
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
        step = max(
            np.abs(np.diff(rays.x, axis=1)).max(initial=0),
            np.abs(np.diff(rays.y, axis=0)).max(initial=0),
        )
        margin = (2 * _COARSE * step + 10 * rays.soft_px / rays.focal_px.min()) * depth
        near = (away < self.thing.radius_mm + margin).reshape(x.shape)
        rows, columns = rays.x.shape
        return np.repeat(np.repeat(near, _COARSE, 0), _COARSE, 1)[:rows, :columns]

    def _nearest(self, ways: np.ndarray) -> np.ndarray:
        """Angles (n,) of the circle's points that are nearest to rays (n, 3). A ray comes near it twice at most: the
        two lowest of stations that are lower than their neighbours, then Newton's method."""
        square = _HalfSquare.of(ways, self.thing, across(self.thing.axis))
        found = [square.lowest(angles) for angles in square.low_stations()]
        return np.where(square.at(found[0]) <= square.at(found[1]), *found)

    def hits(self, rays: np.ndarray) -> Hits:
        """As `Seen.hits`: by steps along the ray as long as the surface is far."""
        thing, length = self.thing, np.linalg.norm(rays, axis=1)
        ways = rays / length[:, None]
        at = ways @ thing.point_mm - thing.ring_radius_mm - thing.radius_mm
        end = at + 2 * (thing.ring_radius_mm + thing.radius_mm)
        going = np.arange(len(rays))
        for _ in range(_MOST_STEPS):
            outside = thing.outside_mm(at[going, None] * ways[going])
            at[going] += outside
            going = going[(outside > _NEAR_MM) & (at[going] < end[going])]
            if not len(going):
                break
        points = at[:, None] * ways
        feet = thing.foot_mm(points)
        normals = (points - feet) / np.linalg.norm(points - feet, axis=1)[:, None]
        along = np.cross(thing.axis, feet - thing.point_mm) / thing.ring_radius_mm
        return Hits(np.where(at < end, at / length, np.nan), normals, sine_off(ways, along))


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
    def of(
        cls, ways: np.ndarray, ring: Ring, across: tuple[np.ndarray, np.ndarray]
    ) -> "_HalfSquare":
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
