"""The object that an array feels: where its surface is, from the manifest or from pictures."""

from dataclasses import dataclass, field

import numpy as np

from bench.array.surface_forms import FORMS, SurfaceForm
from bench.records.trial_result import SeenWhisk
from bench.session.session import Base
from bench.session.trial import Trial
from vision import axis_from_angles
from vision.geometry import Wire

STATED, SEEN = "manifest", "pictures"
# [mm] To which the nearest arc is found: rounding of what is measured in hundredths. Derived.
_ARC_MM = 1e-6
# [arcs] Of each pass of that search. A layout.
_ARCS = 21


@dataclass(frozen=True, eq=False)
class ObjectSurface:
    """The surface of an object in the rig frame: all points at radius_mm from its centreline.

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

    @property
    def form(self) -> SurfaceForm:
        """Return the form that its shape names."""
        return FORMS[self.shape]

    def distance_mm(self, points_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the distances (n,) of points (n, 3) from the surface, negative within, and its
        normals there, (n, 3)."""
        return self.form.distance_mm(self, points_mm)

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


def stated_surface(trial: Trial) -> ObjectSurface | None:
    """Return the object as the manifest states it; None where it does not, or does not say how thick
    it is."""
    stated = trial.object
    if stated is None or stated.point_mm is None:
        return None
    is_thick = FORMS[stated.shape].is_thick
    if trial.bar_diameter_mm is None and is_thick:
        return None
    axis = np.array(stated.direction, dtype=float)
    return ObjectSurface(
        stated.shape,
        np.array(stated.point_mm, dtype=float),
        axis / np.linalg.norm(axis),
        radius_mm=0.5 * trial.bar_diameter_mm if is_thick else 0.0,
        ring_radius_mm=0.5 * (stated.ring_diameter_mm or 0.0),
        covariance_mm2=stated.point_sigma_mm**2 * np.eye(3),
        half_angle_rad=float(np.radians(stated.half_angle_deg or 0.0)),
    )


def seen_surface(
    seen: SeenWhisk, bar_radius_mm: float, wire: Wire, base: Base
) -> ObjectSurface | None:
    """Return the object as the cameras show it in a whisk, in the rig frame.

    It is as uncertain as the place where it is touched. None where no touch is seen.
    """
    if not seen.has_truth or seen.truth.point_covariance_mm2 is None:
        return None
    surface = seen.truth.rounded or _seen_bar(seen, bar_radius_mm, wire)
    if surface is None:
        return None
    rotation = base.T_rig_base[:, :3]
    return ObjectSurface(
        surface.shape,
        rotation @ surface.point_mm + base.T_rig_base[:, 3],
        rotation @ surface.axis,
        surface.radius_mm,
        surface.ring_radius_mm,
        rotation @ seen.truth.point_covariance_mm2 @ rotation.T,
        SEEN,
        surface.half_angle_rad,
    )


def _seen_bar(seen: SeenWhisk, radius_mm: float, wire: Wire) -> ObjectSurface | None:
    """Return the bar that is seen in a whisk, in the base frame; None where its radius is unknown.

    Its axis is away from the contact by both radii, at right angles to whisker and axis.
    """
    if not np.isfinite(radius_mm):
        return None
    reach_mm = radius_mm + float(wire.radius_mm(seen.d_x_mm.value))
    touch_rad = seen.touch_rad.value
    axis = axis_from_angles(0.0, touch_rad, seen.beta_rad.value, seen.psi_rad.value, reach_mm)
    return ObjectSurface("bar", seen.point_mm.value + axis.point_mm, axis.direction, radius_mm)
