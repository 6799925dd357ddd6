"""The two rods in front of the cameras: the whisker and the bar that it touches."""

from dataclasses import dataclass

import numpy as np

from vision.geometry.scene import Bar, Wire


@dataclass(frozen=True)
class Rods:
    """Whisker and bar, and how far apart their axes are while they touch."""

    wire: Wire
    bar: Bar

    @property
    def reach_mm(self) -> float:
        """Distance between the two axes while they touch, for a uniform wire."""
        return self.bar.radius_mm + 0.5 * self.wire.diameter_mm

    @property
    def reach_sigma_mm(self) -> float:
        return 0.5 * float(np.hypot(self.bar.diameter_sigma_mm, self.wire.diameter_sigma_mm))
