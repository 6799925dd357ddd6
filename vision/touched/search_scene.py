"""The pictures of one whisk, its cameras and rods: all that a search for the object needs."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vision.geometry.camera import Cameras
from vision.geometry.centreline import resting_lines
from vision.geometry.rods import Rods
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.view import View
from vision.touched.object_view import ObjectView

# [lines] Of the straight wire over the stroke: where pieces of the object may show the wire, too. By 5
# or 16 a d_x moves by 0.4 sigma. Study: thresholds.py touched.search_scene _WIRES ….
_WIRES = 8
# [mm] Nearest contact to the whisker's base. Stated.
_NEAREST_MM = 10.0
# [values] Of the motor angle: fewer are no grid. Stated.
_FEWEST_ANGLES = 3


@dataclass(frozen=True)
class SearchScene:
    """The pictures of one whisk before any wire is known.

    motor_rad (n,): motor angles of all frames.
    """

    views: Sequence[View]
    cameras: Cameras
    rods: Rods
    motor_rad: np.ndarray
    settings: VisionSettings

    @property
    def motor_range_rad(self) -> tuple[float, float]:
        """Return the lowest and the highest motor angle, rad."""
        return float(np.min(self.motor_rad)), float(np.max(self.motor_rad))

    @property
    def mid_motor_rad(self) -> float:
        """Return the middle of the stroke, rad."""
        return sum(self.motor_range_rad) / 2

    @property
    def radius_mm(self) -> float:
        """Return the radius of the touched object, mm."""
        return self.rods.bar.radius_mm

    def contact_places_mm(self, step_mm: float) -> np.ndarray:
        """Return places (n,) along the whisker at which it may touch, a step apart."""
        return np.arange(_NEAREST_MM, self.rods.wire.length_mm, step_mm)

    def touch_angles_rad(self, step_mm: float) -> np.ndarray:
        """Return motor angles (n,) from the lowest to the highest.

        step_mm: their distance on the arc of the whisker's middle.
        """
        arc_mm = np.ptp(self.motor_range_rad) * 0.5 * self.rods.wire.length_mm
        count = int(np.ceil(arc_mm / step_mm))
        return np.linspace(*self.motor_range_rad, max(_FEWEST_ANGLES, count))

    @cached_property
    def object_views(self) -> list[ObjectView]:
        """Return the views of the object, crossed by the straight wire over its stroke."""
        angles_rad = np.linspace(*self.motor_range_rad, _WIRES)
        views = []
        for view in self.views:
            wires_px = resting_lines(view.camera, self.rods.wire, angles_rad)
            views.append(ObjectView(view, self.radius_mm, self.settings, wires_px))
        return views
