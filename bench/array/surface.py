"""The object that an array feels: where its surface is, from the manifest or from pictures."""

from dataclasses import dataclass, field

import numpy as np

from bench.records.trial_result import SeenWhisk
from bench.session.session import Base
from bench.session.trial import Trial
from vision.geometry.rods import Wire
from vision.touched.find import axis_from_angles

STATED, SEEN = "manifest", "pictures"
_ARC_MM = 1e-6  # mm: to which the nearest arc is found
_ARCS = 21  # of each pass of that search


@dataclass(frozen=True, eq=False)
class ObjectSurface:
    """All points at one distance (radius_mm) from a centreline, in the rig frame.

    shape: the centreline is straight ("bar"), a circle ("ring") or a point ("sphere"); or a cone
    ("cone"), whose radius_mm is 0. point_mm (3,): of the straight line, the centre, or the cone's
    tip. axis (3,), unit: the line's direction, the normal of the circle's plane, or where the cone
    points. ring_radius_mm: of the circle, 0 of others. half_angle_rad: of the cone. covariance_mm2
    (3, 3): of its place. source: STATED or SEEN.
    """

    shape: str
    point_mm: np.ndarray
    axis: np.ndarray
    radius_mm: float
    ring_radius_mm: float = 0.0
    covariance_mm2: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))
    source: str = STATED
    half_angle_rad: float = 0.0

    def distance_mm(self, points_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the distances (n,) of points (n, 3) from the surface, negative within, and its
        normals there, (n, 3)."""
        from_point = points_mm - self.point_mm
        height = from_point @ self.axis
        along = np.outer(height, self.axis)
        from_axis = from_point - along
        if self.shape == "cone":
            return self._distance_from_cone(from_point, height, from_axis)
        if self.shape == "sphere":
            apart = from_point
        elif self.shape == "bar":
            apart = from_axis
        else:
            apart = from_point - self.ring_radius_mm * _unit(from_axis)
        return np.linalg.norm(apart, axis=1) - self.radius_mm, _unit(apart)

    def _distance_from_cone(self, from_tip, height, from_axis):
        """Return distances and normals of a cone: from its straight lines, or from its tip where none
        is nearer.

        from_tip (n, 3): points from the tip; height (n,), from_axis (n, 3): along and off the axis.
        """
        sin = np.sin(self.half_angle_rad)
        cos = np.cos(self.half_angle_rad)
        radial = np.linalg.norm(from_axis, axis=1)
        is_above = sin * radial < cos * height
        side_normals = cos * _unit(from_axis) + sin * self.axis
        normals = np.where(is_above[:, None], _unit(from_tip), side_normals)
        to_tip = np.linalg.norm(from_tip, axis=1)
        return np.where(is_above, to_tip, cos * radial + sin * height), normals

    def nearest_arc_mm(self, base_mm: np.ndarray, direction: np.ndarray, length_mm: float) -> float:
        """Find the arc, mm, at which a straight whisker comes nearest to the object.

        base_mm (3,), direction (3,), unit: of the whisker.
        """
        low = 0.0
        high = length_mm
        while high - low > _ARC_MM:
            arcs = np.linspace(low, high, _ARCS)
            outside, _ = self.distance_mm(base_mm + np.outer(arcs, direction))
            best = int(outside.argmin())
            low = arcs[max(best - 1, 0)]
            high = arcs[min(best + 1, _ARCS - 1)]
        return 0.5 * (low + high)


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (n, 3) scaled to length 1."""
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def stated_surface(trial: Trial) -> ObjectSurface | None:
    """Return the object as the manifest states it; None where it does not, or does not say how thick
    it is."""
    stated = trial.object
    if stated is None or stated.point_mm is None:
        return None
    is_cone = stated.shape == "cone"
    if trial.bar_diameter_mm is None and not is_cone:
        return None
    axis = np.array(stated.axis, dtype=float)
    return ObjectSurface(
        stated.shape,
        np.array(stated.point_mm, dtype=float),
        axis / np.linalg.norm(axis),
        radius_mm=0.0 if is_cone else 0.5 * trial.bar_diameter_mm,
        ring_radius_mm=0.5 * (stated.ring_diameter_mm or 0.0),
        covariance_mm2=stated.point_sigma_mm**2 * np.eye(3),
        half_angle_rad=float(np.radians(stated.half_angle_deg or 0.0)),
    )


def seen_surface(
    seen: SeenWhisk, bar_radius_mm: float, wire: Wire, base: Base
) -> ObjectSurface | None:
    """Return the object as the cameras show it in a whisk, in the rig frame.

    It is as uncertain as the place where it is touched. None where no touch is seen. A bar's axis is
    away from the contact by both radii, at right angles to whisker and axis.
    """
    if not seen.has_truth or seen.truth.point_covariance_mm2 is None:
        return None
    turn = base.T_rig_base[:, :3]
    origin = base.T_rig_base[:, 3]
    covariance = turn @ seen.truth.point_covariance_mm2 @ turn.T
    rounded = seen.truth.rounded
    if rounded is not None:
        return ObjectSurface(
            rounded.shape,
            turn @ rounded.point_mm + origin,
            turn @ rounded.axis,
            rounded.radius_mm,
            rounded.ring_radius_mm,
            covariance,
            SEEN,
            rounded.half_angle_rad,
        )
    if not np.isfinite(bar_radius_mm):
        return None
    reach_mm = bar_radius_mm + float(wire.radius_mm(seen.d_x_mm.value))
    angles = seen.touch_rad.value, seen.beta_rad.value, seen.psi_rad.value
    axis = axis_from_angles(0.0, *angles, reach_mm)
    point = turn @ (seen.point_mm.value + axis.point_mm) + origin
    direction = turn @ axis.direction
    return ObjectSurface(
        "bar", point, direction, bar_radius_mm, covariance_mm2=covariance, source=SEEN
    )
