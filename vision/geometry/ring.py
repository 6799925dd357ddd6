"""A ring: a round bar bent to a circle."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from vision.geometry.checks import require, require_length, require_sigma
from vision.geometry.rotation import turned_about, unit
from vision.geometry.rounded import (
    AboutAxis,
    Balls,
    FreeNumber,
    Local,
    Rounded,
    RoundedAxis,
    upwards,
)
from vision.geometry.touched import StatedSizes

# [rad] Of a ring to either side of the contact: farther round it is another side of it. By 46° a
# ring's d_x moves by 0.7 sigma, by 74° its slope by 0.3. Study: thresholds.py geometry.ring
# _MOST_TURN_RAD … --sessions FOLDER.
_MOST_TURN_RAD = np.radians(60.0)
# [1] Least share of a ring's radius that a point is from its axis, where it is divided by. Stated.
_LEAST_RADIUS_SHARE = 0.1
# [rad] Tilts of the search's grid. Stated.
_PSI_RAD = np.radians(np.arange(-16.0, 17.0, 8.0))
# [rad] Turns of the search's grid about the ring's tangent where it is touched. Stated.
_TURN_RAD = np.radians(np.arange(-20.0, 21.0, 20.0))
# [—] A layout: the whisker's direction where an object is placed at its contact.
_X = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True)
class Ring(Rounded):
    """A bar of so many mm bent to a ring. Refused where it is thicker than the ring is wide.

    ring_diameter_mm: along the middle of the bar.
    """

    diameter_mm: float
    diameter_sigma_mm: float = 0.0
    ring_diameter_mm: float = 0.0

    name: ClassVar[str] = "ring"
    search_reach_mm: ClassVar[float] = np.inf

    def __post_init__(self):
        """Raise Refused where there is no such ring."""
        require_length("ring", ring_diameter_mm=self.ring_diameter_mm)
        require_length("bar", diameter_mm=self.diameter_mm)
        require(
            self.ring_diameter_mm > self.diameter_mm,
            f"ring of {self.ring_diameter_mm:g} mm: its bar is {self.diameter_mm:g} mm thick",
        )
        require_sigma("bar", diameter_sigma_mm=self.diameter_sigma_mm)

    @classmethod
    def from_sizes(cls, stated: StatedSizes) -> "Ring":
        """Return the ring of stated sizes. Raises Refused where there is none."""
        return cls(stated.diameter_mm, stated.diameter_sigma_mm, stated.ring_diameter_mm)

    @property
    def sizes(self) -> StatedSizes:
        """Return the ring's sizes."""
        return StatedSizes(self.diameter_mm, self.diameter_sigma_mm, self.ring_diameter_mm)

    @property
    def label(self) -> str:
        """Return the ring with its diameter, for a message."""
        return f"ring of {self.ring_diameter_mm:g} mm"

    @property
    def ring_radius_mm(self) -> float:
        """Return half the ring's diameter."""
        return 0.5 * self.ring_diameter_mm

    def near(self, at: RoundedAxis, points_mm: np.ndarray) -> Local:
        """Return the ring as a bar near points (..., k, 3): its tangent at the nearest place."""
        axis = at.direction[..., None, :]
        outward = AboutAxis.of(at, points_mm).outward
        foot = at.point_mm[..., None, :] + self.ring_radius_mm * outward
        return Local(foot, upwards(np.cross(axis, outward)), np.zeros(outward.shape[:-1]))

    def follows(self, at: RoundedAxis, local: Local, away: np.ndarray) -> np.ndarray:
        """Return how far (..., k) the nearest point of the circle moves per mm that a point moves.

        It is less than on a straight line, if the point is outside of the circle.
        """
        outward = (local.foot_mm - at.point_mm[..., None, :]) / self.ring_radius_mm
        distance = self.ring_radius_mm + np.sum(away * outward, axis=-1)  # from the ring's axis
        return self.ring_radius_mm / np.maximum(distance, _LEAST_RADIUS_SHARE * self.ring_radius_mm)

    def hides_itself(
        self, at: RoundedAxis, centre_mm: np.ndarray, points_mm: np.ndarray, radius_mm: float
    ) -> np.ndarray:
        """Return whether (...) a sight through points (..., 3) near the ring meets it elsewhere.

        The distances of points along each sight are compared with the tube's radius.
        """
        steps_mm = self._steps_mm(radius_mm)
        batch = (*at.point_mm.shape[:-1], -1, 3)
        ahead = unit(points_mm - centre_mm).reshape(batch)
        start = points_mm.reshape(batch) - at.point_mm[..., None, :]
        axis = at.direction[..., None]
        height = start @ axis + steps_mm * (ahead @ axis)  # (..., k, steps) above the ring's plane
        distance2 = _dot(start, start) + 2.0 * steps_mm * _dot(start, ahead) + steps_mm**2
        across = np.sqrt(np.maximum(distance2 - height**2, 0.0)) - self.ring_radius_mm
        is_within = across**2 + height**2 < radius_mm**2
        return np.any(is_within, axis=-1).reshape(points_mm.shape[:-1])

    def _steps_mm(self, radius_mm: float) -> np.ndarray:
        """Return steps (n,) along a sight that lead across the ring, wherever on it they begin."""
        diameter_mm = self.ring_diameter_mm
        return np.arange(-1.0, 1.0, radius_mm / diameter_mm) * (diameter_mm + radius_mm)

    def balls(self, at: RoundedAxis, radius_mm: float, reach_mm: float, stations: int) -> Balls:
        """Return balls of one size along the circle, all round it if reach_mm is infinite."""
        point = at.point_mm[..., None, :]
        axis = at.direction[..., None, :]
        most = np.pi
        if np.isfinite(reach_mm):
            most = min(reach_mm / self.ring_radius_mm, _MOST_TURN_RAD)
        turn = np.linspace(-most, most, stations)[:, None]
        begin = unit(at.spot_foot_mm - point)
        outward = turned_about(axis, begin, turn)
        middle = point + self.ring_radius_mm * outward
        radii = np.full((*middle.shape[:-1], 1), radius_mm)
        return Balls(middle, np.cross(axis, outward), radii, 0.0)

    def free_numbers(self) -> list[FreeNumber]:
        """Return the tilt and the turn about the tangent, rad, where the ring is touched."""
        return [FreeNumber(_PSI_RAD), FreeNumber(_TURN_RAD)]

    def at_contact(
        self, spot_mm: np.ndarray, inwards: np.ndarray, along: np.ndarray, free: np.ndarray
    ) -> RoundedAxis:
        """Return where rings stand that are touched at spots (n, 3). free (n, 2): tilt and turn."""
        psi, turn = free.T[..., None]
        tangent = np.cos(psi) * along + np.sin(psi) * _X
        towards = turned_about(tangent, inwards, turn)
        point = spot_mm + self.radius_mm * inwards + self.ring_radius_mm * towards
        return RoundedAxis(point, np.cross(tangent, towards), self, spot_mm)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the products (..., 1) of vectors (..., 3)."""
    return np.sum(a * b, axis=-1, keepdims=True)
