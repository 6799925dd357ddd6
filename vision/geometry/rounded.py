"""Objects that are no straight bar: a ring (a bar bent to a circle), a sphere, a cone.

All are the surface of balls along a line, their middle: of one size along a circle (ring), of a
size that grows from a tip (cone), or a single one (sphere). To a contact each is a bar whose axis
turns as the contact moves on it (`Rounded.near`); to a camera each is a silhouette, where sights
graze its surface (`Rounded.limb`).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from vision.geometry.checks import require, require_length

# [—] A layout: the direction along which slopes count.
_UP = np.array([0.0, 0.0, 1.0])
# [1] In place of none, where it is divided by. Stated.
_TINY = 1e-12
# [rad] Of a ring to either side of the contact: farther round it is another side of it. Set by
# eye. Study: rounded_seen.py.
_MOST_TURN_RAD = np.radians(60.0)
# [mm] Of a cone: nearer to its tip its two edges are one, 2 px apart. Stated.
_LEAST_RADIUS_MM = 0.3
# [1] Least curvature in a Newton step, where a sight runs along a ring: it stays finite. Stated.
_LEAST_BEND = 0.02
# [mm] Longest Newton step. Stated.
_LONGEST_MM = 10.0
# [1] Least share of a ring's radius that a point is from its axis, where it is divided by. Stated.
_LEAST_RADIUS_SHARE = 0.1
# [1] Added to the upright, so that no sight is parallel to it. Stated.
_SKEWED = 0.01
# [steps] Newton's along a sight, from some mm off to rounding. Study:
# tests/vision/geometry/test_rounded.py.
_ROUNDS = 8


@dataclass(frozen=True)
class Form:
    """The stated shape of such an object, beside its thickness.

    ring_diameter_mm: along a ring's middle. half_angle_rad: of a cone. about_mm: about how thick a
    cone is, across its surface, where it is touched (0: not stated). Raises where a ring has no
    diameter, or a cone no angle.
    """

    shape: Literal["ring", "sphere", "cone"]
    ring_diameter_mm: float = 0.0
    half_angle_rad: float = 0.0
    about_mm: float = 0.0

    def __post_init__(self):
        """Raise where the object has no such shape."""
        if self.shape == "ring":
            require_length("ring", ring_diameter_mm=self.ring_diameter_mm)
        if self.shape == "cone":
            require(
                0.0 < self.half_angle_rad < 0.5 * np.pi,
                f"cone half_angle_rad {self.half_angle_rad:g}: 0 to pi/2",
            )


@dataclass(frozen=True)
class Local:
    """The object as a bar near given points.

    foot_mm (..., 3): nearest point of its middle. direction (..., 3): of its surface's straightest
    way there, with positive z. wider_mm (...): how much farther the middle is from the surface than
    the object's own radius.
    """

    foot_mm: np.ndarray
    direction: np.ndarray
    wider_mm: np.ndarray


@dataclass(frozen=True)
class Rounded:
    """Where such an object stands, in the rig frame; a batch of them has (..., 3).

    point_mm (..., 3): centre of ring or sphere, or tip of a cone. direction (..., 3): unit normal
    of a ring's plane, or where a cone points; of no meaning for a sphere. spot_mm (3,): about where
    it is touched, from which stations along it are counted.
    """

    point_mm: np.ndarray
    direction: np.ndarray
    form: Form
    spot_mm: np.ndarray

    def each(self) -> list["Rounded"]:
        """Return the objects of a batch (n,) one by one; spot_mm (n, 3)."""
        parts = zip(self.point_mm, self.direction, self.spot_mm)
        return [Rounded(point, direction, self.form, spot) for point, direction, spot in parts]

    def near(self, points_mm: np.ndarray) -> Local:
        """Return the object as a bar near points (..., k, 3)."""
        centre = np.asarray(self.point_mm)[..., None, :]
        axis = np.asarray(self.direction)[..., None, :]
        apart = points_mm - centre
        no_wider = np.zeros(apart.shape[:-1])
        if self.form.shape == "sphere":
            normal = _unit(apart)
            upright = _unit(_UP - normal[..., 2:] * normal)
            return Local(np.broadcast_to(centre, apart.shape), upright, no_wider)
        height = np.sum(apart * axis, axis=-1, keepdims=True)
        flat = apart - height * axis
        radius = np.linalg.norm(flat, axis=-1, keepdims=True)
        outward = flat / np.maximum(radius, _TINY)
        if self.form.shape == "ring":
            foot = centre + 0.5 * self.form.ring_diameter_mm * outward
            return Local(foot, _upwards(np.cross(axis, outward)), no_wider)
        sin = np.sin(self.form.half_angle_rad)
        cos = np.cos(self.form.half_angle_rad)
        down = radius * sin / cos - height  # from the tip to the foot
        along_surface = _upwards(cos * axis - sin * outward)
        return Local(centre - down * axis, along_surface, (down * sin)[..., 0])

    def outside_mm(self, points_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray, Local]:
        """Compute how far points (..., k, 3) are from the middle, less `Local.wider_mm`.

        Returns the distances (..., k), positive; the normals there (..., k, 3); and the object as a
        bar near them.
        """
        local = self.near(points_mm)
        away = points_mm - local.foot_mm
        length = np.linalg.norm(away, axis=-1)
        return length - local.wider_mm, away / np.maximum(length, _TINY)[..., None], local

    def follows(self, local: Local, away: np.ndarray) -> np.ndarray | float:
        """Return how far (..., k) the nearest point of the middle moves per mm that a point moves.

        away (..., k, 3): from the nearest point to the point. On a circle it is less than on a
        straight line, if the point is outside of it.
        """
        if self.form.shape == "sphere":
            return 0.0
        if self.form.shape == "cone":
            return 1.0
        radius = 0.5 * self.form.ring_diameter_mm
        outward = (local.foot_mm - np.asarray(self.point_mm)[..., None, :]) / radius
        distance = radius + np.sum(away * outward, axis=-1)  # from the ring's axis
        return radius / np.maximum(distance, _LEAST_RADIUS_SHARE * radius)

    def hides_itself(
        self, centre_mm: np.ndarray, points_mm: np.ndarray, radius_mm: float
    ) -> np.ndarray:
        """Return whether (...) a sight through points (..., 3) near the surface meets it elsewhere.

        centre_mm (3,): of the camera. Of a ring the distances of points along each sight are
        compared with the tube's radius.
        """
        if self.form.shape != "ring":
            return np.zeros(points_mm.shape[:-1], dtype=bool)
        diameter_mm = self.form.ring_diameter_mm
        sight = points_mm - centre_mm
        sight = sight / np.linalg.norm(sight, axis=-1, keepdims=True)
        steps = np.arange(-1.0, 1.0, radius_mm / diameter_mm) * (diameter_mm + radius_mm)
        axis = np.asarray(self.direction)
        batch = self.point_mm.shape[:-1]
        start = points_mm.reshape(*batch, -1, 3) - np.asarray(self.point_mm)[..., None, :]
        ahead = sight.reshape(*batch, -1, 3)
        height = np.einsum("...kj,...j->...k", start, axis)[..., None]
        climb = np.einsum("...kj,...j->...k", ahead, axis)[..., None]
        start2 = np.sum(start**2, axis=-1)[..., None]
        along = np.sum(start * ahead, axis=-1)[..., None]
        distance2 = start2 + 2.0 * steps * along + steps**2  # (..., k, steps) from the centre
        height = height + steps * climb
        across = np.sqrt(np.maximum(distance2 - height**2, 0.0)) - 0.5 * diameter_mm
        is_within = across**2 + height**2 < radius_mm**2
        return np.any(is_within, axis=-1).reshape(points_mm.shape[:-1])

    def nearest_on_lines(
        self, begin_mm: np.ndarray, towards: np.ndarray, at_mm: np.ndarray, rounds: int = _ROUNDS
    ) -> np.ndarray:
        """Find where (..., k), mm from begin, straight lines (..., k, 3) come nearest.

        at_mm (..., k): a value near there.
        """
        for _ in range(rounds):
            points = begin_mm + at_mm[..., None] * towards
            at_mm = at_mm + nearer_by(self, points, towards)
        return at_mm

    def limb(
        self, centre_mm: np.ndarray, radius_mm: float, reach_mm: float, stations: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compute the silhouette: where sights from a camera (3,) graze the surface, on both sides.

        Returns points (..., 2, m, 3) and the surface's normals (..., 2, m, 3) there; NaN where no
        sight grazes it: before its tip a cone has no outline but that of its base. reach_mm: of
        ring and cone, how far along the middle from where it is touched; of a ring all round it if
        that is infinite.
        """
        if self.form.shape == "sphere":
            return self._silhouette_of_sphere(centre_mm, radius_mm, stations)
        middle, ahead, radius, growth = self._stations(radius_mm, reach_mm, stations)
        sight = middle - centre_mm
        along = np.sum(sight * ahead, axis=-1, keepdims=True)
        towards = sight - along * ahead
        distance = np.linalg.norm(towards, axis=-1, keepdims=True)
        towards = towards / distance
        root = np.sqrt(1.0 - growth**2)
        cosine = (growth * along - radius) / (root * distance)
        cosine = np.where(np.abs(cosine) < 1.0, cosine, np.nan)
        sideways = np.sqrt(1.0 - cosine**2) * np.cross(ahead, towards)
        one = root * (cosine * towards + sideways) - growth * ahead
        other = root * (cosine * towards - sideways) - growth * ahead
        normals = np.stack([one, other], axis=-3)
        return middle[..., None, :, :] + radius[..., None, :, :] * normals, normals

    def _silhouette_of_sphere(
        self, centre_mm: np.ndarray, radius_mm: float, stations: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compute the silhouette of a sphere, a circle in two halves, see `limb`."""
        sight = np.asarray(self.point_mm) - centre_mm
        distance = np.linalg.norm(sight, axis=-1, keepdims=True)[..., None]
        ahead = _unit(sight)[..., None, :]
        right = _unit(np.cross(ahead, _UP + _SKEWED))
        turn = (np.arange(2 * stations) + 0.5) * np.pi / stations
        ring = np.cos(turn)[:, None] * right + np.sin(turn)[:, None] * np.cross(ahead, right)
        cosine = radius_mm / distance
        normals = -cosine * ahead + np.sqrt(1.0 - cosine**2) * ring
        normals = normals.reshape(*normals.shape[:-2], 2, stations, 3)
        return np.asarray(self.point_mm)[..., None, None, :] + radius_mm * normals, normals

    def _stations(
        self, radius_mm: float, reach_mm: float, stations: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """Return the balls that make up ring or cone, from station to station along its middle.

        Points (..., m, 3) of the middle, unit directions (..., m, 3) along it, radii (..., m, 1) of
        the balls, and by how much these grow per mm.
        """
        point = np.asarray(self.point_mm)[..., None, :]
        axis = np.asarray(self.direction)[..., None, :]
        spot = np.broadcast_to(self.spot_mm, self.point_mm.shape)
        foot = self.near(spot[..., None, :]).foot_mm
        if self.form.shape == "ring":
            ring_radius_mm = 0.5 * self.form.ring_diameter_mm
            most = np.pi
            if np.isfinite(reach_mm):
                most = min(reach_mm / ring_radius_mm, _MOST_TURN_RAD)
            turn = np.linspace(-most, most, stations)[:, None]
            begin = _unit(foot - point)
            outward = np.cos(turn) * begin + np.sin(turn) * np.cross(axis, begin)
            middle = point + ring_radius_mm * outward
            radii = np.full((*middle.shape[:-1], 1), radius_mm)
            return middle, np.cross(axis, outward), radii, 0.0
        sin = np.sin(self.form.half_angle_rad)
        at = np.sum((point - foot) * axis, axis=-1, keepdims=True)  # from the tip down
        nearest = np.maximum(at - reach_mm, _LEAST_RADIUS_MM / sin)
        farthest = np.maximum(at, nearest) + reach_mm
        share = np.linspace(0.0, 1.0, stations)[:, None]
        down = nearest + share * (farthest - nearest)
        middle = point - down * axis
        return middle, np.broadcast_to(axis, middle.shape), down * sin, -sin


def nearer_by(axis: Rounded, points_mm: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Compute Newton's step (..., k) along curves towards where they are nearest to an object, mm.

    points_mm (..., k, 3): on the curves. towards (..., k, 3): their tangents there, of about unit
    length.
    """
    local = axis.near(points_mm)
    away = points_mm - local.foot_mm
    follows = axis.follows(local, away) * np.sum(towards * local.direction, axis=-1) ** 2
    bend = np.sum(towards**2, axis=-1) - follows
    step = -np.sum(away * towards, axis=-1) / np.maximum(bend, _LEAST_BEND)
    return np.clip(step, -_LONGEST_MM, _LONGEST_MM)


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (..., 3) at unit length."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), _TINY)


def _upwards(directions: np.ndarray) -> np.ndarray:
    """Return directions (..., 3), turned about where their z is negative."""
    return np.where(directions[..., 2:] >= 0.0, directions, -directions)
