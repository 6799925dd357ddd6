"""Objects that are no straight bar: what a ring, a sphere and a cone have in common.

All are the surface of balls along a line, their middle: of one size along a circle (ring), of a
size that grows from a tip (cone), or a single one (sphere). To a contact each is a bar whose axis
turns as the contact moves on it (`Rounded.near`); to a camera each is a silhouette, where sights
graze its surface (`Rounded.silhouette`). A new form of object is one more subclass of `Rounded`,
and its line in `vision.geometry.forms`.
"""

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.contact import OUTLINE_MM, OUTLINE_POINTS, BarAxis
from vision.geometry.touched import Axis, Touched

# [1] In place of none, where it is divided by. Stated.
_TINY = 1e-12
# [1] Least curvature in a Newton step, where a sight runs along a ring: it stays finite. Stated.
_LEAST_BEND = 0.02
# [mm] Longest Newton step. Stated.
_LONGEST_MM = 10.0
# [steps] Newton's along a sight, from some mm off to rounding. Study:
# tests/vision/geometry/test_rounded.py.
_ROUNDS = 8
# [mm] Prior sigma of an object's shift along its axis: nothing is believed of it. Stated.
_ALONG_MM = 50.0
# [px] An outline is read too far out, or in, by so much as a whole: with the wrong transfer curve
# 0.5, else 0.05; the object's size determines it. Study: rounded_seen.py.
_OUTWARD_PX = 0.3


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
class Balls:
    """The balls that make up an object, from station to station along its middle.

    middle_mm (..., m, 3): their centres. ahead (..., m, 3): unit directions along the middle.
    radius_mm (..., m, 1): of the balls. growth: by how much that grows per mm.
    """

    middle_mm: np.ndarray
    ahead: np.ndarray
    radius_mm: np.ndarray
    growth: float

    def silhouette(self, centre_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute where sights graze the surface of the balls, see `RoundedAxis.silhouette`.

        A surface of growing balls has normals n with n·ahead = −growth, and a sight grazes it where
        n·sight = −radius. Both leave two normals, one on either side of the plane of sight and middle.
        """
        root = np.sqrt(1.0 - self.growth**2)  # length of n across the middle
        towards, along, distance = self._sights(centre_mm)
        # Of the angle round the middle between n and the sight; beyond 1 the centre is within a ball.
        cosine = (self.growth * along - self.radius_mm) / (root * distance)
        cosine = np.where(np.abs(cosine) < 1.0, cosine, np.nan)
        sine = np.sqrt(1.0 - cosine**2)
        in_plane = root * cosine * towards - self.growth * self.ahead
        off_plane = root * sine * np.cross(self.ahead, towards)
        normals = np.stack([in_plane + off_plane, in_plane - off_plane], axis=-3)  # (..., 2, m, 3)
        middle_mm = self.middle_mm[..., None, :, :]
        radius_mm = self.radius_mm[..., None, :, :]
        return middle_mm + radius_mm * normals, normals

    def _sights(self, centre_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the sights from a centre to the balls, in parts.

        These are the unit direction (..., m, 3) across the middle, and the lengths (..., m, 1)
        along and across it, mm.
        """
        sight = self.middle_mm - centre_mm
        along = np.sum(sight * self.ahead, axis=-1, keepdims=True)
        towards = sight - along * self.ahead
        distance = np.linalg.norm(towards, axis=-1, keepdims=True)
        return towards / distance, along, distance


@dataclass(frozen=True)
class FreeNumber:
    """A number that the point of contact and the slope leave free of where an object stands.

    values: a grid of it, to begin a search from. is_choice: whether nothing lies between these.
    """

    values: np.ndarray
    is_choice: bool = False


class Rounded(Touched):
    """An object that is no straight bar, as it is stated.

    search_reach_mm: how far of its silhouette, to either side of where it is touched, a search by
    edges reads.
    """

    may_move: ClassVar[bool] = False
    along_sigma_mm: ClassVar[tuple[float, ...]] = (_ALONG_MM,)
    outline_sigma_px: ClassVar[tuple[float, ...]] = (_OUTWARD_PX,)
    search_reach_mm: ClassVar[float]

    @abstractmethod
    def near(self, at: "RoundedAxis", points_mm: np.ndarray) -> Local:
        """Return the object that stands there as a bar near points (..., k, 3)."""

    @abstractmethod
    def follows(self, at: "RoundedAxis", local: Local, away: np.ndarray) -> np.ndarray | float:
        """Return how far (..., k) the nearest point of the middle moves per mm that a point moves.

        away (..., k, 3): from the nearest point to the point.
        """

    def hides_itself(
        self, at: "RoundedAxis", centre_mm: np.ndarray, points_mm: np.ndarray, radius_mm: float
    ) -> np.ndarray:
        """Return whether (...) a sight through points (..., 3) near the surface meets it elsewhere.

        centre_mm (3,): of the camera.
        """
        return np.zeros(points_mm.shape[:-1], dtype=bool)

    @abstractmethod
    def balls(self, at: "RoundedAxis", radius_mm: float, reach_mm: float, stations: int) -> Balls:
        """Return the balls that make up the object, up to reach_mm from where it is touched."""

    def silhouette(
        self,
        at: "RoundedAxis",
        centre_mm: np.ndarray,
        radius_mm: float,
        reach_mm: float,
        stations: int,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compute where sights graze the surface, see `RoundedAxis.silhouette`."""
        return self.balls(at, radius_mm, reach_mm, stations).silhouette(centre_mm)

    def covering_discs(self, edges_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return middles (m, 2) and radii (m,) px of discs between both sides (2, m, 2)."""
        middle = np.mean(edges_px, axis=0)
        return middle, np.max(np.linalg.norm(edges_px - middle, axis=-1), axis=0)

    def free_numbers(self) -> list[FreeNumber]:
        """Return the numbers that the point of contact and the slope there leave free."""
        return []

    @abstractmethod
    def at_contact(
        self, spot_mm: np.ndarray, inwards: np.ndarray, along: np.ndarray, free: np.ndarray
    ) -> "RoundedAxis":
        """Return where objects stand that are touched at spots (n, 3) of their surface.

        The whisker lies along x. inwards (n, 3): unit, from the whisker into the object. along (n,
        3): unit, of the surface's slope there. free (n, k): the values of `free_numbers`.
        """


@dataclass(frozen=True)
class RoundedAxis(Axis):
    """Where a ring, sphere or cone stands, in the rig frame; a batch of them has (..., 3).

    point_mm (..., 3): centre of ring or sphere, or tip of a cone. direction (..., 3): unit normal
    of a ring's plane, or where a cone points; of no meaning for a sphere. spot_mm (3,): about where
    it is touched, from which stations along it are counted.
    """

    point_mm: np.ndarray
    direction: np.ndarray
    form: Rounded
    spot_mm: np.ndarray

    # [steps] Newton's, more than on a bar: the axis turns with the contact, so that each divides
    # what is left by ten and not by its square. Derived.
    newton_steps: ClassVar[int] = 5

    def each(self) -> list["RoundedAxis"]:
        """Return the places of a batch (n,) one by one; spot_mm (n, 3)."""
        parts = zip(self.point_mm, self.direction, self.spot_mm)
        return [RoundedAxis(point, direction, self.form, spot) for point, direction, spot in parts]

    def batch(self) -> "RoundedAxis":
        """Return the place as a batch of one."""
        spot_mm = self.spot_mm[None]
        return RoundedAxis(self.point_mm[None], self.direction[None], self.form, spot_mm)

    def turned(self, rotations: np.ndarray) -> "RoundedAxis":
        """Return the places of a batch (n, 3), each turned about the origin by rotations (n, 3, 3)."""
        vectors = np.stack([self.point_mm, self.direction, self.spot_mm], axis=-1)  # (n, 3, 3)
        point_mm, direction, spot_mm = np.moveaxis(rotations @ vectors, -1, 0)
        return RoundedAxis(point_mm, direction, self.form, spot_mm)

    def upward(self) -> "RoundedAxis":
        """Return the same place: its direction is no slope."""
        return self

    def bar_at(self, points_mm: np.ndarray) -> BarAxis:
        """Return the bars that contacts at points (..., 3) act on, one for each point."""
        local = self.near(points_mm[..., None, :])
        return BarAxis(local.foot_mm[..., 0, :], local.direction[..., 0, :])

    def as_bar(self) -> BarAxis:
        """Return the bar that stands for the object where it is touched, to be drawn."""
        return self.bar_at(self.spot_mm)

    def near(self, points_mm: np.ndarray) -> Local:
        """Return the object as a bar near points (..., k, 3)."""
        return self.form.near(self, points_mm)

    @property
    def spot_foot_mm(self) -> np.ndarray:
        """Return the point (..., 1, 3) of the middle nearest to where it is touched."""
        spot_mm = np.broadcast_to(self.spot_mm, np.shape(self.point_mm))
        return self.near(spot_mm[..., None, :]).foot_mm

    def outside_mm(self, points_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute how far points (..., k, 3) are from the middle, less `Local.wider_mm`.

        Returns the distances (..., k), positive, and the normals there (..., k, 3).
        """
        local = self.near(points_mm)
        away = points_mm - local.foot_mm
        length = np.linalg.norm(away, axis=-1)
        return length - local.wider_mm, away / np.maximum(length, _TINY)[..., None]

    def nearest(self, points_mm: np.ndarray) -> np.ndarray:
        """Return which (...) of points (..., k, 3) is nearest to the object."""
        return np.argmin(self.outside_mm(points_mm)[0], axis=-1)

    def newton_step(
        self, points_mm: np.ndarray, tangents: np.ndarray, growth: np.ndarray | float = 0.0
    ) -> np.ndarray:
        """Return Newton's steps (..., k), mm, along curves to where their surface is nearest."""
        local = self.near(points_mm)
        away = points_mm - local.foot_mm
        follows = self.form.follows(self, local, away)
        follows = follows * np.sum(tangents * local.direction, axis=-1) ** 2
        bend = np.sum(tangents**2, axis=-1) - follows
        grown = growth * np.linalg.norm(away, axis=-1)
        step = (grown - np.sum(away * tangents, axis=-1)) / np.maximum(bend, _LEAST_BEND)
        return np.clip(step, -_LONGEST_MM, _LONGEST_MM)

    def distance_mm(self, points_mm: np.ndarray, tangents: np.ndarray) -> np.ndarray:
        """Return the distances (...) of curves at their nearest points (..., 3), always positive.

        They are less by what the middle is farther from the surface than the object's own radius.
        """
        return self.outside_mm(points_mm[..., None, :])[0][..., 0]

    def nearest_on_lines(
        self, begin_mm: np.ndarray, towards: np.ndarray, at_mm: np.ndarray
    ) -> np.ndarray:
        """Find where (..., k), mm from begin, straight lines (..., k, 3) come nearest.

        at_mm (..., k): a value near there.
        """
        for _ in range(_ROUNDS):
            points = begin_mm + at_mm[..., None] * towards
            at_mm = at_mm + self.newton_step(points, towards)
        return at_mm

    def hides_itself(
        self, centre_mm: np.ndarray, points_mm: np.ndarray, radius_mm: float
    ) -> np.ndarray:
        """Return whether (...) a sight through points (..., 3) near the surface meets it elsewhere.

        centre_mm (3,): of the camera.
        """
        return self.form.hides_itself(self, centre_mm, points_mm, radius_mm)

    def silhouette(
        self, centre_mm: np.ndarray, radius_mm: float, reach_mm: float, stations: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compute where sights from a camera (3,) graze the surface, on both sides.

        Returns points (..., 2, m, 3) and the surface's normals (..., 2, m, 3) there; NaN where no
        sight grazes it: before its tip a cone has no outline but that of its base. reach_mm: of
        ring and cone, how far along the middle from where it is touched; of a ring all round it if
        that is infinite.
        """
        return self.form.silhouette(self, centre_mm, radius_mm, reach_mm, stations)

    def edges_px(
        self, camera: Camera, radius_mm: float, reach_mm: float, stations: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return both sides (stations, 2) px of the silhouette."""
        points, _ = self.silhouette(camera.centre_mm, radius_mm, reach_mm, stations)
        one, other = camera.project(points)
        return one, other

    def covering_discs(self, camera: Camera, radius_mm: float) -> tuple[np.ndarray, np.ndarray]:
        """Return middles (m, 2) and radii (m,) px of discs that cover the object in a picture."""
        points, _ = self.silhouette(camera.centre_mm, radius_mm, OUTLINE_MM, OUTLINE_POINTS)
        return self.form.covering_discs(camera.project(points))


def upwards(directions: np.ndarray) -> np.ndarray:
    """Return directions (..., 3), turned about where their z is negative."""
    return np.where(directions[..., 2:] >= 0.0, directions, -directions)


@dataclass(frozen=True)
class AboutAxis:
    """Points by their place about the axis of an object.

    height_mm (..., k, 1): along the axis from its point. radius_mm (..., k, 1): distance from it.
    outward (..., k, 3): unit, straight away from it.
    """

    height_mm: np.ndarray
    radius_mm: np.ndarray
    outward: np.ndarray

    @classmethod
    def of(cls, at: RoundedAxis, points_mm: np.ndarray) -> "AboutAxis":
        """Return the places of points (..., k, 3)."""
        axis = at.direction[..., None, :]
        apart = points_mm - at.point_mm[..., None, :]
        height = np.sum(apart * axis, axis=-1, keepdims=True)
        flat = apart - height * axis
        radius = np.linalg.norm(flat, axis=-1, keepdims=True)
        return cls(height, radius, flat / np.maximum(radius, _TINY))
