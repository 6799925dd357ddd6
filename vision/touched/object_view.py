"""One camera's pictures of the touched object, and what reading its edges there needs besides."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.view import View


@dataclass(frozen=True)
class ObjectView:
    """One camera's pictures of an object of known radius, which wires may cross.

    wires_px: lines (m, 2) where a wire lies in some frame.
    """

    pictures: View
    radius_mm: float
    settings: VisionSettings
    wires_px: Sequence[np.ndarray] = ()

    @property
    def camera(self) -> Camera:
        """Return the camera."""
        return self.pictures.camera

    @property
    def crossing_px(self) -> Sequence[np.ndarray]:
        """Return the lines of wires that the mean picture shows; none where it is one without rods."""
        return self.wires_px if self.pictures.itself is None else ()
