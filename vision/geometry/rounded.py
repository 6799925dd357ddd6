"""Objects that are no straight bar: a bar bent to a circle, a sphere, a cone.

To a contact each is a bar whose axis turns as the contact moves on it (`Rounded.near`); to a camera each is an outline,
where sights graze its surface (`Rounded.limb`). All are the surface of balls along a line: of one size along a circle
(ring), of a size that grows from a tip (cone), or a single one (sphere).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from vision.geometry.checks import require, require_length

# [—] A layout: the way in which slopes count.
_UP = np.array([0.0, 0.0, 1.0])
# [1] In place of none, where it is divided by. Stated.
_TINY = 1e-12
# [rad] Of a ring to either side of the contact: farther round it is another side of it. Set by
# eye. Study: rounded_seen.py.
_MOST_TURN_RAD = np.radians(60.0)
# [mm] Of a cone: nearer to its tip its two edges are one, 2 px apart. Stated.
_LEAST_RADIUS_MM = 0.3
# [1, mm] Of a Newton step, where a sight runs along a ring: it stays finite. Stated.
_LEAST_BEND, _LONGEST_MM = 0.02, 10.0
# [steps] Newton's along a sight, from some mm off to rounding. Study:
# tests/vision/geometry/test_rounded.py.
_ROUNDS = 8


@dataclass(frozen=True)
class Form:
    """What is told of such an object beside its thickness: a ring's diameter along its middle, a cone's half-angle and
    about how thick that is, across its surface, where it is touched (0: not told).

    Refused where it has no such shape.
    """

    shape: Literal["ring", "sphere", "cone"]
    ring_diameter_mm: float = 0.0
    half_angle_rad: float = 0.0
    about_mm: float = 0.0

    def __post_init__(self):
        if self.shape == "ring":
            require_length("ring", ring_diameter_mm=self.ring_diameter_mm)
        if self.shape == "cone":
            require(
                0.0 < self.half_angle_rad < 0.5 * np.pi,
                f"cone half_angle_rad {self.half_angle_rad:g}: 0 to pi/2",
            )


@dataclass(frozen=True)
class Local:
    """What points see of an object: the nearest point of its middle (…, 3), the direction (…, 3) of its surface's
    straightest way there, z positive, and by how much the middle is farther from the surface than the object's own
    radius (…)."""

    foot_mm: np.ndarray
    direction: np.ndarray
    wider_mm: np.ndarray


@dataclass(frozen=True)
class Rounded:
    """Where such an object stands, in the rig frame: centre of ring or sphere, or tip of a cone (…, 3), mm; normal of a
    ring's plane, or where a cone points (…, 3), unit, of no meaning for a sphere. spot_mm (3,): about where it is
    touched, from which stations along it are counted."""

    point_mm: np.ndarray
    direction: np.ndarray
    form: Form
    spot_mm: np.ndarray

    def each(self) -> list["Rounded"]:
        """Return the objects of a batch (n,) one by one; spot_mm (n, 3)."""
        parts = zip(self.point_mm, self.direction, self.spot_mm)
        return [Rounded(point, direction, self.form, spot) for point, direction, spot in parts]

    def near(self, points_mm: np.ndarray) -> Local:
        """What points (…, k, 3) see."""
        centre, axis = (
            np.asarray(self.point_mm)[..., None, :],
            np.asarray(self.direction)[..., None, :],
        )
        apart = points_mm - centre
        if self.form.shape == "sphere":
            normal = _unit(apart)
            upright = _unit(_UP - normal[..., 2:] * normal)
            return Local(np.broadcast_to(centre, apart.shape), upright, np.zeros(apart.shape[:-1]))
        high = np.sum(apart * axis, axis=-1, keepdims=True)
        flat = apart - high * axis
        far = np.linalg.norm(flat, axis=-1, keepdims=True)
        outward = flat / np.maximum(far, _TINY)
        if self.form.shape == "ring":
            foot = centre + 0.5 * self.form.ring_diameter_mm * outward
            return Local(foot, _upwards(np.cross(axis, outward)), np.zeros(apart.shape[:-1]))
        sin, cos = np.sin(self.form.half_angle_rad), np.cos(self.form.half_angle_rad)
        down = far * sin / cos - high
        return Local(
            centre - down * axis, _upwards(cos * axis - sin * outward), (down * sin)[..., 0]
        )

    def outside_mm(self, points_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray, Local]:
        """How far points (…, k, 3) are from the middle, beyond what `Local.wider_mm` is: (…, k), positive; the normals
        there (…, k, 3); and what they see."""
        local = self.near(points_mm)
        away = points_mm - local.foot_mm
        length = np.linalg.norm(away, axis=-1)
        return length - local.wider_mm, away / np.maximum(length, _TINY)[..., None], local

    def follows(self, local: Local, away: np.ndarray) -> np.ndarray | float:
        """By how much (…, k) the middle's nearest point goes on with a point that goes along it, which is so far away
        (…, k, 3) from it: on a circle less than on a straight line, if that is outside of it."""
        if self.form.shape != "ring":
            return 0.0 if self.form.shape == "sphere" else 1.0
        radius = 0.5 * self.form.ring_diameter_mm
        outward = (local.foot_mm - np.asarray(self.point_mm)[..., None, :]) / radius
        return radius / np.maximum(radius + np.sum(away * outward, axis=-1), 0.1 * radius)

    def hides_itself(
        self, centre_mm: np.ndarray, points_mm: np.ndarray, radius_mm: float
    ) -> np.ndarray:
        """Whether (…,) a sight from a camera (3,) through points (…, 3) beside the surface meets it elsewhere."""
        if self.form.shape != "ring":
            return np.zeros(points_mm.shape[:-1], dtype=bool)
        sight = points_mm - centre_mm
        far = np.linalg.norm(sight, axis=-1, keepdims=True)
        steps = np.arange(-1.0, 1.0, radius_mm / self.form.ring_diameter_mm) * (
            self.form.ring_diameter_mm + radius_mm
        )
        axis, batch = np.asarray(self.direction), self.point_mm.shape[:-1]
        start = points_mm.reshape(*batch, -1, 3) - np.asarray(self.point_mm)[..., None, :]
        ahead = (sight / far).reshape(*batch, -1, 3)
        high, climbs = (
            np.einsum("...kj,...j->...k", one, axis)[..., None] for one in (start, ahead)
        )
        far2 = (
            np.sum(start**2, axis=-1)[..., None]
            + 2.0 * steps * np.sum(start * ahead, axis=-1)[..., None]
            + steps**2
        )
        high = high + steps * climbs
        across = np.sqrt(np.maximum(far2 - high**2, 0.0)) - 0.5 * self.form.ring_diameter_mm
        return np.any(across**2 + high**2 < radius_mm**2, axis=-1).reshape(points_mm.shape[:-1])

    def nearest_on_lines(
        self, begin_mm: np.ndarray, towards: np.ndarray, at_mm: np.ndarray, rounds: int = _ROUNDS
    ) -> np.ndarray:
        """Where (…, k), mm from begin, straight lines (…, k, 3) come nearest, from near there."""
        for _ in range(rounds):
            points = begin_mm + at_mm[..., None] * towards
            at_mm = at_mm + nearer_by(self, points, towards)
        return at_mm

    def limb(
        self, centre_mm: np.ndarray, radius_mm: float, reach_mm: float, stations: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Points (…, 2, m, 3) of the surface that sights from a camera (3,) graze, to both sides, and the normals
        (…, 2, m, 3) there, NaN where none does: before its tip a cone has no outline but that of its base; of
        ring and cone up to reach_mm of the middle from where it is touched, of a ring all round it if that is
        infinite."""
        if self.form.shape == "sphere":
            return self._round_limb(centre_mm, radius_mm, stations)
        middle, ahead, radius, grows = self._stations(radius_mm, reach_mm, stations)
        sight = middle - centre_mm
        along = np.sum(sight * ahead, axis=-1, keepdims=True)
        towards = sight - along * ahead
        distance = np.linalg.norm(towards, axis=-1, keepdims=True)
        towards = towards / distance
        root = np.sqrt(1.0 - grows**2)
        cosine = (grows * along - radius) / (root * distance)
        cosine = np.where(np.abs(cosine) < 1.0, cosine, np.nan)
        aside = np.sqrt(1.0 - cosine**2) * np.cross(ahead, towards)
        normals = np.stack(
            [root * (cosine * towards + side * aside) - grows * ahead for side in (1.0, -1.0)],
            axis=-3,
        )
        return middle[..., None, :, :] + radius[..., None, :, :] * normals, normals

    def _round_limb(self, centre_mm, radius_mm, stations):
        """Of a sphere: a circle, in two halves."""
        sight = np.asarray(self.point_mm) - centre_mm
        distance = np.linalg.norm(sight, axis=-1, keepdims=True)[..., None]
        ahead = _unit(sight)[..., None, :]
        right = _unit(np.cross(ahead, _UP + 0.01))
        turn = (np.arange(2 * stations) + 0.5) * np.pi / stations
        ring = np.cos(turn)[:, None] * right + np.sin(turn)[:, None] * np.cross(ahead, right)
        cosine = radius_mm / distance
        normals = -cosine * ahead + np.sqrt(1.0 - cosine**2) * ring
        normals = normals.reshape(*normals.shape[:-2], 2, stations, 3)
        return np.asarray(self.point_mm)[..., None, None, :] + radius_mm * normals, normals

    def _stations(self, radius_mm, reach_mm, stations):
        """Of ring and cone: points (…, m, 3) of the middle, directions (…, m, 3) along it, radii (…, m, 1) of the balls
        there, and how those grow along it."""
        point, axis = (
            np.asarray(self.point_mm)[..., None, :],
            np.asarray(self.direction)[..., None, :],
        )
        foot = self.near(np.broadcast_to(self.spot_mm, self.point_mm.shape)[..., None, :]).foot_mm
        if self.form.shape == "ring":
            across = 0.5 * self.form.ring_diameter_mm
            most = min(reach_mm / across, _MOST_TURN_RAD) if np.isfinite(reach_mm) else np.pi
            turn = np.linspace(-most, most, stations)[:, None]
            out = _unit(foot - point)
            ahead = np.cross(axis, out)
            outward = np.cos(turn) * out + np.sin(turn) * ahead
            middle, ahead = point + across * outward, np.cross(axis, outward)
            return middle, ahead, np.full((*middle.shape[:-1], 1), radius_mm), 0.0
        sin = np.sin(self.form.half_angle_rad)
        at = np.sum((point - foot) * axis, axis=-1, keepdims=True)
        share = np.linspace(0.0, 1.0, stations)[:, None]
        nearest = np.maximum(at - reach_mm, _LEAST_RADIUS_MM / sin)
        down = nearest + share * (np.maximum(at, nearest) + reach_mm - nearest)
        middle = point - down * axis
        return middle, np.broadcast_to(axis, middle.shape), down * sin, -sin


def nearer_by(axis: Rounded, points_mm: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """How far (…, k) to go on along curves to come nearest, by Newton's method; towards (…, k, 3): the curves'
    tangents, of about unit length, at points (…, k, 3)."""
    local = axis.near(points_mm)
    away = points_mm - local.foot_mm
    follows = axis.follows(local, away) * np.sum(towards * local.direction, axis=-1) ** 2
    bends = np.sum(towards**2, axis=-1) - follows
    return np.clip(
        -np.sum(away * towards, axis=-1) / np.maximum(bends, _LEAST_BEND), -_LONGEST_MM, _LONGEST_MM
    )


def _unit(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), _TINY)


def _upwards(directions):
    return np.where(directions[..., 2:] >= 0.0, directions, -directions)
