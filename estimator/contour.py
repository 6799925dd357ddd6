"""Contours by touch alone: lines that just touch an object enclose it.

Russell [33] sweeps a whisker that is a switch along an object, Russell and Wijaya [36] let eight rigid rods with angle
sensors lie on it. Either way a touch is a line, from base and angle, that the object reaches and does not cross.
Their equations are not at hand. This is derived here: of a convex object all round, the lines in the order of their
directions are the edges of a polygon about it. Each edge touches the object somewhere; where is not known, so
that the edge's length is the contour's resolution. Angles in rad, lengths in mm.
"""

from dataclasses import dataclass

import numpy as np

from estimator.reasons import NamedReason

# [lines] Fewest that enclose anything. Derived.
_FEWEST = 3
OPEN = NamedReason(
    "contour_open", "touches do not go all round: two neighbours face away by 180° or more"
)


@dataclass(frozen=True, eq=False)
class Contour:
    """A polygon of k touching lines, in the order of their directions.

    line (k,): which touch each edge is. middle_mm (k, 2), edge_mm (k,): middle and length of each edge, of which
    middle_sigma_mm (k,) lies across it. corner_mm (k, 2): at its end, off by corner_sigma_mm (k,) outwards.
    """

    line: np.ndarray
    middle_mm: np.ndarray
    middle_sigma_mm: np.ndarray
    edge_mm: np.ndarray
    corner_mm: np.ndarray
    corner_sigma_mm: np.ndarray


@dataclass(frozen=True, eq=False)
class TouchingLines:
    """Whiskers at first touch, with the object on their left.

    base_mm (n, 2), direction_rad (n,): where they begin and point to. direction_sigma_rad (n,). radius_mm,
    radius_sigma_mm (n,): of the whisker at the unknown place of contact.
    """

    base_mm: np.ndarray
    direction_rad: np.ndarray
    direction_sigma_rad: np.ndarray
    radius_mm: np.ndarray
    radius_sigma_mm: np.ndarray

    @property
    def normal(self) -> np.ndarray:
        """Return the unit normals (n, 2) towards the object."""
        return np.stack([-np.sin(self.direction_rad), np.cos(self.direction_rad)], axis=-1)

    @property
    def along(self) -> np.ndarray:
        """Return the unit directions (n, 2)."""
        return np.stack([np.cos(self.direction_rad), np.sin(self.direction_rad)], axis=-1)

    def sigma_mm(self, points_mm: np.ndarray, line: np.ndarray) -> np.ndarray:
        """Return how far (k,) the lines of the numbers (k,) may be off across, at points (k, 2)."""
        lever = np.sum((points_mm - self.base_mm[line]) * self.along[line], axis=-1)
        return np.hypot(lever * self.direction_sigma_rad[line], self.radius_sigma_mm[line])


def contour(touches: TouchingLines) -> Contour | NamedReason:
    """Return the polygon that touches enclose; OPEN where they do not.

    A line that the others keep off the object, as noise lets it, is left out.
    """
    line = np.argsort(touches.direction_rad % (2 * np.pi))
    while len(line) >= _FEWEST:
        following = np.roll(line, -1)
        turn = (touches.direction_rad[following] - touches.direction_rad[line]) % (2 * np.pi)
        if np.any(turn >= np.pi) or np.any(turn == 0.0):
            return OPEN
        corner = _crossings(touches, line, following)
        start = np.roll(corner, 1, axis=0)
        edge = np.sum((corner - start) * touches.along[line], axis=-1)
        if np.all(edge > 0):
            middle = 0.5 * (start + corner)
            outward = _outward_sigma_mm(touches, line, following, corner)
            return Contour(line, middle, touches.sigma_mm(middle, line), edge, corner, outward)
        line = np.delete(line, np.argmin(edge))
    return OPEN


def _crossings(touches: TouchingLines, line: np.ndarray, following: np.ndarray) -> np.ndarray:
    """Return where (k, 2) lines cross those that follow: the points x of n·x = c of both."""
    normal = touches.normal  # n
    reach_mm = np.sum(normal * touches.base_mm, axis=-1) + touches.radius_mm  # c
    both = np.stack([line, following], axis=1)  # (k, 2)
    crossing = np.linalg.solve(normal[both], reach_mm[both][..., None])
    return crossing[..., 0]


def _outward_sigma_mm(
    touches: TouchingLines, line: np.ndarray, following: np.ndarray, corner: np.ndarray
) -> np.ndarray:
    """Return the sigma (k,) of corners along the middle of both lines' outward normals.

    A corner moves that way by half of both shifts over the cosine of half the turn.
    """
    cosine = np.linalg.norm(touches.normal[line] + touches.normal[following], axis=-1) / 2
    own = touches.sigma_mm(corner, line)
    other = touches.sigma_mm(corner, following)
    return np.hypot(own, other) / (2 * cosine)
