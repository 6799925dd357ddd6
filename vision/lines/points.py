"""Points of a rod's line in a picture, and which camera and frame they were seen by."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class LinePoints:
    """Points of a rod's axis in one picture.

    px (n, 2), normal (n, 2) unit, sigma_px (n,) along the normal; place (n,) mm along the rod.
    """

    px: np.ndarray
    normal: np.ndarray
    sigma_px: np.ndarray
    place: np.ndarray

    def __len__(self) -> int:
        return len(self.place)

    def select(self, keep) -> "LinePoints":
        """The points where `keep` holds."""
        return LinePoints(self.px[keep], self.normal[keep], self.sigma_px[keep], self.place[keep])


@dataclass(frozen=True)
class Observed:
    """Line points of one camera in one frame (frame is -1 for the bar, which stands still).

    side: of the bar's outline the middle (0), or the edge towards (1) or against (-1) the points' normals.
    """

    frame: int
    camera: int
    points: LinePoints
    side: int = 0
