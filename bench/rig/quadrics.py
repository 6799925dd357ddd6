"""Spheres and cones as a camera at the origin sees them; the outline is where rays graze the
surface."""

import math
from dataclasses import dataclass

import numpy as np

from bench.rig.rays import (
    Hits,
    Rays,
    VisibleObject,
    circle_points,
    perpendicular_axes,
    sine_between,
    unit,
)
from bench.rig.round_objects import TouchedCone, TouchedRing, TouchedSphere
from bench.rig.torus import VisibleRing
from bench.rig.touched_object import TouchedObject

# mm along a cone's axis from the height at which it is touched: its base and its upper end
_CONE_DOWN_MM, _CONE_UP_MM = 30.0, 60.0
_AROUND = np.linspace(0, 2 * np.pi, 65)  # rad: points about an axis


def to_camera_frame(
    thing: TouchedObject, rotation: np.ndarray, translation_mm: np.ndarray
) -> VisibleObject:
    """Convert a ring, sphere or cone of the rig frame to that of a camera."""
    turn = rotation.T
    kinds = {TouchedRing: VisibleRing, TouchedSphere: VisibleSphere, TouchedCone: VisibleCone}
    pose = np.column_stack([turn, -turn @ translation_mm])
    return kinds[type(thing)](thing.in_frame(pose))


@dataclass(frozen=True, eq=False)
class VisibleSphere:
    """A sphere: its outline is a conic."""

    thing: TouchedSphere

    def points_mm(self) -> np.ndarray:
        """Return points (n, 3) all over it."""
        polar, around = np.meshgrid(np.linspace(0, np.pi, 33), _AROUND)
        x = np.sin(polar) * np.cos(around)
        y = np.sin(polar) * np.sin(around)
        directions = np.stack([x, y, np.cos(polar)], -1).reshape(-1, 3)
        return self.thing.point_mm + self.thing.radius_mm * directions

    def coverage(self, rays: Rays) -> np.ndarray:
        """Return how much of each sample (rows, columns) it covers."""
        centre = self.thing.point_mm
        tangent_square = centre @ centre - self.thing.radius_mm**2
        return rays.conic_coverage(tangent_square * np.eye(3) - np.outer(centre, centre))

    def intersect(self, rays: np.ndarray) -> Hits:
        """Find where rays (n, 3) first meet it."""
        centre = self.thing.point_mm
        radius = self.thing.radius_mm
        square = (rays * rays).sum(1)
        towards = rays @ centre
        discriminant = towards**2 - square * (centre @ centre - radius**2)
        depth = (towards - _real_root(discriminant)) / square
        normals = (depth[:, None] * rays - centre) / radius
        return Hits(depth, normals, np.ones(len(rays)))


@dataclass(frozen=True, eq=False)
class _Disc:
    """A flat end of a cone; normal (3,): unit, the cone's axis."""

    centre: np.ndarray
    radius: float
    normal: np.ndarray

    def coverage(self, rays: Rays) -> np.ndarray:
        """Return how much of each sample it covers: rays that meet its plane within its circle."""
        if not self.radius:
            return np.zeros_like(rays.x)
        height = self.normal @ self.centre
        offset = height * np.eye(3) - np.outer(self.centre, self.normal)  # from it, times the depth
        within = self.radius**2 * np.outer(self.normal, self.normal)
        return rays.conic_coverage(offset.T @ offset - within)

    def depth_mm(self, rays: np.ndarray) -> np.ndarray:
        """Return the depths (n,) at which rays (n, 3) meet it, NaN where they miss it."""
        depth = (self.centre @ self.normal) / (rays @ self.normal)
        is_within = np.linalg.norm(depth[:, None] * rays - self.centre, axis=1) < self.radius
        return np.where(is_within & (depth > 0), depth, np.nan)


@dataclass(frozen=True, eq=False)
class VisibleCone:
    """A cone, from a flat base to its tip or to another flat end.

    Its outline is that of both ends, two conics, and of the two planes through camera and tip that
    graze it.
    """

    thing: TouchedCone

    def _ends(self) -> list[_Disc]:
        """Return base and upper end."""
        thing = self.thing
        sin = math.sin(thing.half_angle_rad)
        touched = thing.radius_mm * (sin - 1 / sin)  # height from the tip, negative below it
        ends = []
        for height in (touched - _CONE_DOWN_MM, min(touched + _CONE_UP_MM, 0.0)):
            radius = -height * math.tan(thing.half_angle_rad)
            ends.append(_Disc(thing.tip_mm + height * thing.axis, radius, thing.axis))
        return ends

    def points_mm(self) -> np.ndarray:
        """Return points (n, 3) of both ends' circles."""
        circles = []
        for end in self._ends():
            circles.append(circle_points(end.centre, end.radius, self.thing.axis, _AROUND))
        return np.concatenate(circles)

    def coverage(self, rays: Rays) -> np.ndarray:
        """Return how much of each sample (rows, columns) it covers."""
        base, top = self._ends()
        cover = np.maximum(base.coverage(rays), top.coverage(rays))
        planes = self._grazing_planes(base)
        if not planes:
            return cover
        sides = rays.half_plane_coverage(planes[0]) * rays.half_plane_coverage(planes[1])
        for end, other in ((base, top), (top, base)):
            if end.radius:
                chord = self._chord(end, planes)
                away = -np.copysign(1.0, chord @ other.centre) * chord
                sides = sides * rays.half_plane_coverage(away)
        return np.maximum(cover, sides)

    def _chord(self, end, planes):
        """Return the normal (3,) of the plane through the camera and both points of an end's circle
        that planes touch."""
        touching = []
        for plane in planes:
            outward = unit(plane - (plane @ self.thing.axis) * self.thing.axis)
            touching.append(end.centre + end.radius * outward)
        return np.cross(*touching)

    def _grazing_planes(self, base) -> list[np.ndarray]:
        """Return the outward normals (3,) of both planes through camera and tip that graze it.

        None where the camera is within the cone's continuation beyond its tip, or within the cone.
        """
        axis = self.thing.axis
        across = np.stack(perpendicular_axes(unit(self.thing.tip_mm)))  # planes hold the sight
        circle = base.radius**2 * (np.outer(axis, axis) - np.eye(3))
        form = across @ (np.outer(base.centre, base.centre) + circle) @ across.T
        (low, high), vectors = np.linalg.eigh(form)
        if low >= 0 or high <= 0:
            return []
        normals = []
        for side in (-1, 1):
            null = math.sqrt(high) * vectors[:, 0] + side * math.sqrt(-low) * vectors[:, 1]
            normal = null @ across
            normals.append(-np.copysign(1.0, normal @ base.centre) * normal)
        return normals

    def intersect(self, rays: np.ndarray) -> Hits:
        """Find where rays (n, 3) first meet it."""
        axis = self.thing.axis
        base, top = self._ends()
        base_depth = base.depth_mm(rays)
        top_depth = top.depth_mm(rays)
        depth = np.fmin(self._side_depth_mm(rays, base, top), np.fmin(base_depth, top_depth))
        directions = unit(rays)
        normals, lines = self._side_directions(depth[:, None] * rays)
        obliqueness = sine_between(directions, lines)
        for sign, end_depth in ((-1, base_depth), (1, top_depth)):
            is_on_end = end_depth == depth
            normals[is_on_end] = sign * axis
            obliqueness[is_on_end] = np.abs(directions[is_on_end] @ axis)
        return Hits(depth, normals, obliqueness)

    def _side_directions(self, points_mm):
        """Return normals and straight lines, (n, 3) each, of the slanting surface at points."""
        axis = self.thing.axis
        from_point = points_mm - self.thing.point_mm
        outward = unit(from_point - np.multiply.outer(from_point @ axis, axis))
        sin = math.sin(self.thing.half_angle_rad)
        cos = math.cos(self.thing.half_angle_rad)
        return cos * outward + sin * axis, cos * axis - sin * outward

    def _side_depth_mm(self, rays, base, top):
        """Return the depths (n,) of the slanting surface, NaN where a ray misses it."""
        axis = self.thing.axis
        tip = self.thing.tip_mm
        cos_square = math.cos(self.thing.half_angle_rad) ** 2
        along = rays @ axis
        a = along**2 - cos_square * (rays * rays).sum(1)
        tip_height = tip @ axis
        b = cos_square * (rays @ tip) - along * tip_height
        c = tip_height**2 - cos_square * (tip @ tip)
        root = _real_root(b**2 - a * c)
        depths = np.array([-b - root, -b + root]) / a  # (2, n)
        height = depths * along
        is_met = (height > base.centre @ axis) & (height < top.centre @ axis) & (depths > 0)
        return np.fmin.reduce(np.where(is_met, depths, np.nan))


def _real_root(square):
    """Return the square roots (n,), NaN of what is not positive."""
    return np.sqrt(np.where(square > 0, square, np.nan))
