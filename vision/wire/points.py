"""Points of a rod's line in a picture, and which camera and frame they were seen by."""

from dataclasses import dataclass

import numpy as np

from vision.geometry.rows import Rows

# [causes] Number of shared causes of error that line points carry. Before an even background these
# hold 93 to 100 % of the variance that segments share; the rest goes into sigma_px. Study: starts.py.
SHARED = 4


@dataclass(frozen=True)
class LinePoints(Rows):
    """Points of a rod's axis in one picture.

    px (n, 2). normal (n, 2): unit. sigma_px (n,): along the normal. place (n,): mm along the rod.
    shared_px (n, SHARED): by how much each point moves with one sigma of each cause that all points
    of a camera share, not counted in sigma_px; None: by 0.
    widened_px2 (n, 2): by how much blur² is above that of all, and sigma; None: not known.
    """

    px: np.ndarray
    normal: np.ndarray
    sigma_px: np.ndarray
    place: np.ndarray
    shared_px: np.ndarray | None = None
    widened_px2: np.ndarray | None = None

    def __post_init__(self):
        if self.shared_px is None:
            object.__setattr__(self, "shared_px", np.zeros((len(self.place), SHARED)))
        if self.widened_px2 is None:
            object.__setattr__(self, "widened_px2", np.tile([0.0, np.inf], (len(self.place), 1)))

    def __len__(self) -> int:
        return len(self.place)


@dataclass(frozen=True)
class Observed:
    """The line points of one camera in one frame; frame is -1 for those of the touched object.

    side: of the bar's outline the middle (0), or the edge towards (1) or against (-1) the points'
    normals. bar_in: the frame in which a bar that moves is seen.
    """

    frame: int
    camera: int
    points: LinePoints
    side: int = 0
    bar_in: int = 0

    @property
    def on_wire(self) -> bool:
        """Return whether the points are the wire's, not the touched object's."""
        return self.frame >= 0
