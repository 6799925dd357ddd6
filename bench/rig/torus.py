"""A ring as a camera at the origin sees it: rays graze it where they pass its circle at the bar's
radius."""

import math
from dataclasses import dataclass

import numpy as np

from bench.rig.rays import Hits, Rays, circle_points, perpendicular_axes, sine_between, unit
from bench.rig.round_objects import TouchedRing

_STATIONS = 64  # of a circle, of which those nearest to a ray are found first
_STATION_RAD = 2 * np.pi / _STATIONS  # from one to the next
_NEWTON_STEPS = 6  # from a station to the nearest point
_COARSE = 8  # samples: only every eighth is tried first, whether the ring is near it
_NEAR_MM, _MOST_STEPS = 1e-4, 100  # of marching along a ray


@dataclass(frozen=True, eq=False)
class VisibleRing:
    """A ring: all points within its radius of a circle."""

    thing: TouchedRing

    def _circle(self, angles: np.ndarray) -> np.ndarray:
        """Return points (..., 3) of the circle."""
        thing = self.thing
        return circle_points(thing.point_mm, thing.ring_radius_mm, thing.axis, angles)

    def points_mm(self) -> np.ndarray:
        """Return the corners (n, 3) of an octahedron about each of many points of the circle."""
        balls = np.concatenate([np.eye(3), -np.eye(3)]) * self.thing.radius_mm * math.sqrt(3)
        return (self._circle(np.linspace(0, 2 * np.pi, 129))[:, None] + balls).reshape(-1, 3)

    def coverage(self, rays: Rays) -> np.ndarray:
        """Return how much of each sample (rows, columns) it covers."""
        is_near = self._is_near(rays)
        point, to_circle = self._nearest(rays.x[is_near], rays.y[is_near])
        distance = np.linalg.norm(to_circle, axis=1)
        normal = -to_circle / distance[:, None]
        by_x = point[:, 2] * normal[:, 0]
        by_y = point[:, 2] * normal[:, 1]
        cover = np.zeros(rays.x.shape)
        cover[is_near] = rays.coverage(distance - self.thing.radius_mm, by_x, by_y)
        return cover

    def _is_near(self, rays: Rays) -> np.ndarray:
        """Return which samples (rows, columns) the ring may cover: those about the samples of a
        coarse grid that pass near it."""
        x = rays.x[::_COARSE, ::_COARSE]
        y = rays.y[::_COARSE, ::_COARSE]
        point, to_circle = self._nearest(x.ravel(), y.ravel())
        reach_mm = self.thing.radius_mm + _margin(rays) * point[:, 2]
        is_near = np.linalg.norm(to_circle, axis=1) < reach_mm
        of_samples = is_near.reshape(x.shape).repeat(_COARSE, 0).repeat(_COARSE, 1)
        rows, columns = rays.x.shape
        return of_samples[:rows, :columns]

    def _nearest(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the points (n, 3) of rays x, y (n,) nearest to the circle, and the ways (n, 3)
        from there to it.

        A ray comes near a circle twice at most: both minima are found among stations, then by
        Newton's method.
        """
        rays = np.stack([x, y, np.ones_like(x)], -1)
        distance = _Distance.from_rays(rays, self.thing)
        first, second = (distance.descend(angles) for angles in distance.lowest_stations())
        angles = np.where(distance.at(first) <= distance.at(second), first, second)
        circle = self._circle(angles)
        depth = (circle * rays).sum(1) / (rays * rays).sum(1)
        point = depth[:, None] * rays
        return point, circle - point

    def intersect(self, rays: np.ndarray) -> Hits:
        """Find where rays (n, 3) first meet it, by steps along each as long as the surface is far."""
        thing = self.thing
        length = np.linalg.norm(rays, axis=1)
        directions = rays / length[:, None]
        travel, is_met = self._travel_mm(directions)
        points = travel[:, None] * directions
        feet = thing.foot_mm(points)
        along = np.cross(thing.axis, feet - thing.point_mm) / thing.ring_radius_mm
        depth = np.where(is_met, travel / length, np.nan)
        return Hits(depth, unit(points - feet), sine_between(directions, along))

    def _travel_mm(self, directions):
        """Return how far (n,) along unit directions (n, 3) the surface is, and whether it is met."""
        thing = self.thing
        size = thing.ring_radius_mm + thing.radius_mm
        travel = directions @ thing.point_mm - size
        end = travel + 2 * size
        going = np.arange(len(directions))
        for _ in range(_MOST_STEPS):
            outside = thing.outside_mm(travel[going, None] * directions[going])
            travel[going] += outside
            going = going[(outside > _NEAR_MM) & (travel[going] < end[going])]
            if not len(going):
                break
        return travel, travel < end


@dataclass(frozen=True, eq=False)
class _Distance:
    """Half the squared distances (n,) between rays and points of a circle, up to a constant.

    By the points' angle they are p·cos + q·sin − (a + b·cos + c·sin)²/2. This has two minima at
    most, and so have its values at equal steps.
    """

    p: float
    q: float
    a: np.ndarray
    b: np.ndarray
    c: np.ndarray

    @classmethod
    def from_rays(cls, rays: np.ndarray, ring: TouchedRing) -> "_Distance":
        """Return the distances between rays (n, 3) and a ring's circle."""
        first, second = (ring.ring_radius_mm * axis for axis in perpendicular_axes(ring.axis))
        directions = unit(rays)
        centre = ring.point_mm
        on_ray = (directions @ vector for vector in (centre, first, second))
        return cls(centre @ first, centre @ second, *on_ray)

    def at(self, angles: np.ndarray | float) -> np.ndarray:
        """Return the values at one angle a ray, or at one for all."""
        cos = np.cos(angles)
        sin = np.sin(angles)
        along = self.a + self.b * cos + self.c * sin
        return self.p * cos + self.q * sin - 0.5 * along**2

    def lowest_stations(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the angles (n,) of the first and the last station lower than their neighbours."""
        stations = _STATION_RAD * np.arange(_STATIONS)
        first = np.full(len(self.a), np.nan)
        last = np.zeros(len(self.a))
        before = self.at(stations[-1])
        here = self.at(stations[0])
        for angle in stations:
            after = self.at(angle + _STATION_RAD)
            is_low = (here <= before) & (here < after)
            last[is_low] = angle
            first[is_low & np.isnan(first)] = angle
            before = here
            here = after
        return np.where(np.isnan(first), last, first), last

    def descend(self, angles: np.ndarray) -> np.ndarray:
        """Return the angles (n,) of the minima near angles, by Newton's method."""
        for _ in range(_NEWTON_STEPS):
            cos = np.cos(angles)
            sin = np.sin(angles)
            on_circle = self.b * cos + self.c * sin
            along = self.a + on_circle
            turned = self.c * cos - self.b * sin
            slope = self.q * cos - self.p * sin - along * turned
            curvature = along * on_circle - turned**2 - self.p * cos - self.q * sin
            is_convex = curvature > 0
            downhill = np.sign(slope) * _STATION_RAD
            step = np.where(is_convex, slope / np.where(is_convex, curvature, 1), downhill)
            angles = angles - np.clip(step, -_STATION_RAD, _STATION_RAD)
        return angles


def _margin(rays: Rays) -> float:
    """Return how far from a ray a ring may be that its pixel shows, over its depth: two steps of the
    coarse grid, and the blur."""
    right = np.abs(np.diff(rays.x, axis=1)).max(initial=0)
    down = np.abs(np.diff(rays.y, axis=0)).max(initial=0)
    return 2 * _COARSE * max(right, down) + 10 * rays.soft_px / rays.focal_px.min()
