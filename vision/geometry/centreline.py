"""The whisker's centreline in space: its rest shape, turned with the motor, and the bend of one point force.

Hub frame: origin at the base, x along the clamped whisker, z the rotation axis; it turns with the motor. A
round rod that is pushed at one point bends in the plane of its tangent and the force; its tangent angle grows as
the integral of (contact - s)/EI(s) up to the contact and stays constant beyond. For a uniform rod that is
2u - u², u = s/contact. The force stands across the whisker at the contact, so that a bent rod has shorter levers
towards its base: the bend's square adds what `bend_growth` says, and so does friction along it.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.rods import Wire

# [terms] A layout: offset, slope, curvature and its change, each across and along the axis.
# Study: exactness.py.
# offset, slope, curvature and change of curvature, each across (y) and along the axis (z)
REST_POWERS = 4
# [nodes] Of 100 mm: a bend of 0.4 rad is within 0.00002 mm of that with 641 (0.0003 mm with 21,
# 0.004 with 11). Study: exactness.py.
_NODES = 41
# [1] Square of the tangent's part along the base: where it would turn back it goes on at 84°
# instead, so that a fit's wild step stays finite. Stated.
_LEAST_FORWARD2 = 0.01


def tangent_growth(
    arc_mm: float | np.ndarray, contact_mm: float | np.ndarray, wire: Wire
) -> np.ndarray:
    """Share (…) of the final tangent angle reached at an arc length, 0 at the base, 1 from the contact on."""
    turn, whole = (
        _turn(s, contact_mm, wire.taper_per_mm)
        for s in (np.minimum(arc_mm, contact_mm), contact_mm)
    )
    return turn / whole


def _turn(s, contact, taper_per_mm):
    """Tangent angle of a tapering rod under a point force: the integral of (contact - t)/(1 - t taper)⁴ from 0 to s.

    In this form nothing cancels, whatever the taper; without any it is s (contact - s/2).
    """
    w = np.maximum(1.0 - taper_per_mm * s, 1e-3)
    return s / w**3 * (contact * (1.0 + w + w * w) / 3.0 - s * (w + 2.0) / 6.0)


def bend_growth(
    turn_rad: np.ndarray,
    pull: np.ndarray | float,
    arc_mm: np.ndarray,
    contact_mm: np.ndarray,
    wire: Wire,
) -> np.ndarray:
    """Share (…, m) of the final tangent angle turn_rad (…, 1) reached at the nodes of a curve, arc_mm (m,).

    The force at contact_mm (…, 1) is across the tangent there, and along it pull (…, 1) times as strong, towards the
    tip: EI ψ'' = −F cos(ψ − B) − P sin(ψ − B), B = turn_rad. To the second order in bend and pull, with g the share by
    small bends, the lever ∫ ds from s to the contact is shorter by ∫ B² (1 − g)²/2 − P/F B (1 − g) ds. Of a uniform
    rod the share grows by B² (w⁶ − w²)/30 and less so P/F B (w⁴ − w²)/6, w = 1 − u: within 3 µm at B = 0.6 and 60 mm.
    """
    growth = tangent_growth(arc_mm, contact_mm, wire)
    if wire.taper_per_mm == 0.0:
        left2 = np.maximum(1.0 - arc_mm / contact_mm, 0.0) ** 2
        return growth + left2 * turn_rad * (
            turn_rad / 30.0 * (left2**2 - 1.0) - pull / 6.0 * (left2 - 1.0)
        )
    integral, bent = simpson().T * arc_mm[1], turn_rad * (1.0 - growth)
    loss = (0.5 * bent - pull) * bent @ integral
    softness = np.where(
        arc_mm < contact_mm, np.maximum(1.0 - wire.taper_per_mm * arc_mm, 1e-3) ** -4.0, 0.0
    )
    lost = softness * (loss[..., -1:] - loss) @ integral
    return growth + (growth * lost[..., -1:] - lost) / _turn(
        contact_mm, contact_mm, wire.taper_per_mm
    )


@dataclass(frozen=True)
class Curves:
    """Centrelines as nodes: arc_mm (m,), points and tangents (…, m, 3), in the frame they were asked for."""

    arc_mm: np.ndarray
    points_mm: np.ndarray
    tangents: np.ndarray

    def at(self, arc_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points and (unnormalised) tangents (…, k, 3) at arc lengths (k,) or (…, k), by cubic Hermite pieces."""
        arc = np.broadcast_to(arc_mm, (*self.points_mm.shape[:-2], np.shape(arc_mm)[-1]))
        k, t = self._place(arc)
        take = [
            np.take_along_axis(a, k[..., None] + d, axis=-2)
            for a in (self.points_mm, self.tangents)
            for d in (0, 1)
        ]
        return self._point_between(t, *take), self._tangent_between(t, *take)

    def one(self, k: int) -> "Curves":
        """The k-th of curves (f, m, 3)."""
        return Curves(self.arc_mm, self.points_mm[k], self.tangents[k])

    def at_one_each(self, which: np.ndarray, arc_mm: np.ndarray) -> np.ndarray:
        """Points (…, n, 3), each on its own curve: which (n,) of the curves (…, f), at arc lengths (n,)."""
        k, t = self._place(np.asarray(arc_mm))
        one_row = [a.reshape(*a.shape[:-3], -1, 3) for a in (self.points_mm, self.tangents)]
        take = [a.take(which * len(self.arc_mm) + k + d, axis=-2) for a in one_row for d in (0, 1)]
        return self._point_between(t, *take)

    def _place(self, arc_mm):
        """The piece that an arc length lies in, and where in it (…, 1), from 0 to 1."""
        steps = arc_mm / (self.arc_mm[1] - self.arc_mm[0])
        k = np.clip(steps.astype(int), 0, len(self.arc_mm) - 2)
        return k, (steps - k)[..., None]

    def _point_between(self, t, p0, p1, m0, m1):
        """Points within a piece from points and tangents at its ends."""
        h = self.arc_mm[1] - self.arc_mm[0]
        u = 1.0 - t
        return (
            (u * u * (1.0 + 2.0 * t)) * p0
            + (t * t * (3.0 - 2.0 * t)) * p1
            + (h * t * u) * (u * m0 - t * m1)
        )

    def _tangent_between(self, t, p0, p1, m0, m1):
        """Tangents, the derivative of `_point_between` by arc length."""
        u = 1.0 - t
        h = self.arc_mm[1] - self.arc_mm[0]
        return (
            (6.0 * t * u / h) * (p1 - p0) + (u * (1.0 - 3.0 * t)) * m0 - (t * (2.0 - 3.0 * t)) * m1
        )


def centrelines(
    rest_mm: np.ndarray,
    bend_rad: np.ndarray,
    contact_mm: np.ndarray,
    motor_rad: np.ndarray,
    wire: Wire,
    pull: np.ndarray | float = 0.0,
) -> Curves:
    """Centrelines in the rig frame for batches of shapes.

    rest_mm (…, 2, 4): polynomials in s/length, (y, z); bend_rad (…, 2): the tangent angle at the contact,
    (y, z) components, hub frame; contact_mm (…): arc length of the contact; motor_rad (…); pull (…): force along the
    whisker at the contact over that across it, towards the tip.
    """
    arc = np.linspace(0.0, wire.length_mm, _NODES)
    aside = _rest_slope(rest_mm, arc / wire.length_mm) / wire.length_mm
    turn = np.linalg.norm(bend_rad, axis=-1)[..., None]
    growth = bend_growth(
        turn, np.asarray(pull)[..., None], arc, np.asarray(contact_mm)[..., None], wire
    )
    sine = np.where(turn > 1e-12, np.sin(turn * growth) / np.maximum(turn, 1e-12), growth)
    aside = aside + sine[..., None] * np.asarray(bend_rad)[..., None, :]
    tangents = np.empty((*aside.shape[:-1], 3))
    tangents[..., 0] = np.sqrt(
        np.maximum(1.0 - aside[..., 0] ** 2 - aside[..., 1] ** 2, _LEAST_FORWARD2)
    )
    tangents[..., 1:] = aside
    points = simpson() @ tangents * arc[1]
    points[..., 1:] += np.asarray(rest_mm)[..., None, :, 0]
    turned = np.swapaxes(rotation_z(motor_rad), -1, -2)
    return Curves(arc, points @ turned, tangents @ turned)


@lru_cache
def simpson() -> np.ndarray:
    """The matrix (m, m) that integrates values at the nodes of a curve, one apart, from the first node to each: by the
    parabola through three nodes, over its first and its second half by turns; over the last step its second half.

    As `scipy.integrate.cumulative_simpson`, which takes an eighth of a second to load.
    """
    first, second = np.array([5.0, 8.0, -1.0]) / 12.0, np.array([-1.0, 8.0, 5.0]) / 12.0
    steps = np.zeros((_NODES, _NODES))
    for k in range(_NODES - 1):
        begins = k % 2 == 0 and k + 2 < _NODES
        steps[k + 1, k - (not begins) : k + 2 + begins] = first if begins else second
    return np.cumsum(steps, axis=0)


def _rest_slope(rest_mm, u) -> np.ndarray:
    """Slopes (…, m, 2) of the rest shape by u = s/length."""
    powers = np.stack([k * u ** max(k - 1, 0) for k in range(REST_POWERS)], axis=-1)
    return powers @ np.swapaxes(rest_mm, -1, -2)


def rotation_z(angle_rad: float | np.ndarray) -> np.ndarray:
    """Rotation matrices (…, 3, 3) about z."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    zero, one = np.zeros_like(c), np.ones_like(c)
    return np.stack(
        [np.stack([c, -s, zero], -1), np.stack([s, c, zero], -1), np.stack([zero, zero, one], -1)],
        -2,
    )


def one_curve(
    rest_mm: np.ndarray,
    bend_rad: np.ndarray,
    contact_mm: float,
    motor_rad: float,
    wire: Wire,
    pull: float = 0.0,
) -> Curves:
    """The centreline of one frame."""
    return centrelines(
        np.asarray(rest_mm),
        np.asarray(bend_rad),
        np.asarray(contact_mm),
        np.asarray(motor_rad),
        wire,
        pull,
    )


def resting_lines(camera: Camera, wire: Wire, motor_rad: np.ndarray) -> list[np.ndarray]:
    """Lines (m, 2) in one camera of a straight, unbent wire at each of the motor angles (n,)."""
    return [
        camera.project(
            one_curve(
                np.zeros((2, REST_POWERS)), np.zeros(2), wire.length_mm, motor, wire
            ).points_mm
        )
        for motor in motor_rad
    ]


def is_before(camera: Camera, wire: Wire, motor_rad: np.ndarray) -> bool:
    """Whether a straight wire is before the camera over its whole stroke; motor_rad (n,)."""
    return bool(
        np.all(np.isfinite(resting_lines(camera, wire, [np.min(motor_rad), np.max(motor_rad)])))
    )
