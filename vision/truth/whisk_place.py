"""Where object and wire of a whisk are by the pass before: near there their lines are read."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves
from vision.geometry.touched import Axis
from vision.touched.object_view import ObjectView


@dataclass(frozen=True, eq=False)
class WhiskPlace:
    """Where object and wire are in f frames, by the pass before.

    axis: of the object. curves: of the wire, by frame. swept_mm: radius about the axis within which
    the object stays. came_mm (f, 3): how far it is from the axis in each frame, if it moves.
    """

    axis: Axis
    curves: Mapping[int, Curves]
    swept_mm: float
    came_mm: np.ndarray = field(default_factory=lambda: np.zeros((1, 3)))

    def wire_px(self, camera: Camera) -> list[np.ndarray]:
        """Return the wire's centreline (m, 2) in each frame of a camera."""
        if camera.name not in self._wires_px:
            curves = self.curves.values()
            self._wires_px[camera.name] = [camera.project(curve.points_mm) for curve in curves]
        return self._wires_px[camera.name]

    @cached_property
    def _wires_px(self) -> dict[str, list[np.ndarray]]:
        """Return the centrelines by camera, of the cameras projected so far."""
        return {}

    def crossed(self, views: Iterable[ObjectView]) -> list[ObjectView]:
        """Return views of the object, crossed by the wire's centreline in each frame."""
        return [replace(view, wires_px=self.wire_px(view.camera)) for view in views]

    def in_frame(self, number: int) -> Self:
        """Return where object and wire are in one of the frames, by its position among the curves."""
        frame, curve = list(self.curves.items())[number]
        axis = replace(self.axis, point_mm=self.axis.point_mm + self.came_mm[number])
        return replace(self, axis=axis, curves={frame: curve}, came_mm=np.zeros((1, 3)))
