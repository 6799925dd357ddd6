"""The object that an array feels: where its surface is, from the manifest or from pictures."""

from dataclasses import dataclass, field

import numpy as np

from bench.records.trial_result import SeenWhisk
from bench.session.session import Base
from bench.session.trial import Trial
from vision.geometry.rods import Wire
from vision.touched.find import axis_from_angles

STATED, SEEN = "manifest", "pictures"
_ARC_MM = 1e-6  # mm: as near as an arc is looked for


@dataclass(frozen=True, eq=False)
class Surface:
    """All points at one distance (radius_mm) from a centreline, in the rig frame: a straight one ("bar"), a circle
    ("ring") or a point ("sphere"); or a cone, whose radius_mm is 0.

    point_mm (3,): of the straight line, the centre, or the cone's tip; axis (3,), unit: the line's direction, the
    normal of the circle's plane, or where the cone points; ring_radius_mm: of the circle, 0 of others; half_angle_rad:
    of the cone. covariance_mm2 (3, 3): of where it is; source: STATED or SEEN.
    """

    shape: str
    point_mm: np.ndarray
    axis: np.ndarray
    radius_mm: float
    ring_radius_mm: float = 0.0
    covariance_mm2: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))
    source: str = STATED
    half_angle_rad: float = 0.0

    def foot_mm(self, points_mm: np.ndarray) -> np.ndarray:
        """The centreline's points (n, 3) that are nearest to points (n, 3), mm."""
        apart = points_mm - self.point_mm
        along = np.outer(apart @ self.axis, self.axis)
        if self.shape == "bar":
            return self.point_mm + along
        if self.shape == "sphere":
            return np.broadcast_to(self.point_mm, points_mm.shape)
        flat = apart - along
        return self.point_mm + self.ring_radius_mm * flat / np.linalg.norm(
            flat, axis=1, keepdims=True
        )

    def distance_mm(self, points_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How far points (n, 3) are outside of the surface, (n,), negative within; its normals there, (n, 3)."""
        if self.shape == "cone":
            return self._from_cone(points_mm)
        apart = points_mm - self.foot_mm(points_mm)
        length = np.linalg.norm(apart, axis=1)
        return length - self.radius_mm, apart / length[:, None]

    def _from_cone(self, points_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same of a cone: from its straight lines, or from its tip where none is nearer."""
        sin, cos = np.sin(self.half_angle_rad), np.cos(self.half_angle_rad)
        apart = points_mm - self.point_mm
        high, from_tip = apart @ self.axis, np.linalg.norm(apart, axis=1)
        flat = apart - np.outer(high, self.axis)
        far = np.linalg.norm(flat, axis=1)
        normals = cos * flat / far[:, None] + sin * self.axis
        above = sin * far < cos * high
        normals[above] = apart[above] / from_tip[above, None]
        return np.where(above, from_tip, cos * far + sin * high), normals

    def nearest_arc_mm(self, base_mm: np.ndarray, towards: np.ndarray, length_mm: float) -> float:
        """Where a straight whisker of this length comes nearest to the object: arc from its base (3,), mm.
        towards (3,): its direction, unit."""
        low, high = 0.0, length_mm
        while high - low > _ARC_MM:
            arcs = np.linspace(low, high, 21)
            outside, _ = self.distance_mm(base_mm + np.outer(arcs, towards))
            best = int(outside.argmin())
            low, high = arcs[max(best - 1, 0)], arcs[min(best + 1, 20)]
        return 0.5 * (low + high)


def stated_surface(trial: Trial) -> Surface | None:
    """The object as the manifest states it; None where it does not, or does not say how thick it is."""
    given = trial.object
    if (
        given is None
        or given.point_mm is None
        or (trial.bar_diameter_mm is None and given.shape != "cone")
    ):
        return None
    point, axis = np.array(given.point_mm, dtype=float), np.array(given.axis, dtype=float)
    thick = 0.0 if given.shape == "cone" else trial.bar_diameter_mm
    radii = 0.5 * thick, 0.5 * (given.ring_diameter_mm or 0.0)
    angle = float(np.radians(given.half_angle_deg or 0.0))
    told = {"covariance_mm2": given.point_sigma_mm**2 * np.eye(3), "half_angle_rad": angle}
    return Surface(given.shape, point, axis / np.linalg.norm(axis), *radii, **told)


def seen_surface(seen: SeenWhisk, bar_radius_mm: float, wire: Wire, base: Base) -> Surface | None:
    """The object as a whisk shows it, in the rig frame, as well known as where it is touched; None where no touch is
    seen.

    A bar's axis is away from the contact by both radii, at right angles to whisker and axis.
    """
    if not seen.has_truth or seen.truth.point_covariance_mm2 is None:
        return None
    turn, shift = base.T_rig_base[:, :3], base.T_rig_base[:, 3]
    if (there := seen.truth.rounded) is not None:
        place = (
            turn @ there.point_mm + shift,
            turn @ there.axis,
            there.radius_mm,
            there.ring_radius_mm,
        )
        covariance = turn @ seen.truth.point_covariance_mm2 @ turn.T
        return Surface(there.shape, *place, covariance, SEEN, there.half_angle_rad)
    if not np.isfinite(bar_radius_mm):
        return None
    reach_mm = bar_radius_mm + float(wire.radius_mm(seen.d_x_mm.value))
    angles = seen.touch_rad.value, seen.beta_rad.value, seen.psi_rad.value
    from_contact = axis_from_angles(0.0, *angles, reach_mm)
    point, axis = (
        turn @ (seen.point_mm.value + from_contact.point_mm) + shift,
        turn @ from_contact.direction,
    )
    covariance = turn @ seen.truth.point_covariance_mm2 @ turn.T
    return Surface("bar", point, axis, bar_radius_mm, covariance_mm2=covariance, source=SEEN)
