"""How a board held by hand moves between views: what a picture taken late has seen.

Cameras started by software take "the same" frame tens of milliseconds apart, and a camera that buffers is late by whole
frames now and then. A board at 0.5 m/s is by then elsewhere by many pixels, so that no one pose fits all cameras. The
board's poses in the neighbouring views say where it was: through a view's pose and those before and after goes a
parabola (turn as a rotation vector about the view's own pose).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vision.geometry.rotation import log_rotation

# [frame intervals] Neighbours farther away say nothing of the motion now. Origin not known; it
# reaches two neighbours to either side. Study: cameras.py.
_REACH_INTERVALS = 2.6


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Views in time. time_s (V,): NaN for a view that is not on the trajectory (the board on the rig).

    camera_rank (C,): in each view the picture of the camera that ranks first has the view's time; by the others'
    instants it is told how late they are. (A view all of whose pictures were late would be the same view elsewhere.)
    """

    time_s: np.ndarray
    camera_rank: np.ndarray

    @property
    def interval_s(self) -> float:
        """Median time between views that follow each other."""
        taken_s = np.sort(self.time_s[np.isfinite(self.time_s)])
        return float(np.median(np.diff(taken_s))) if len(taken_s) > 1 else np.nan

    def is_reference(self, view: np.ndarray, camera: np.ndarray) -> np.ndarray:
        """Of pictures (view, camera) (s,), which give their view its time. (s,) bool."""
        best = np.full(len(self.time_s), len(self.camera_rank))
        np.minimum.at(best, view, self.camera_rank[camera])
        return self.camera_rank[camera] == best[view]

    @cached_property
    def neighbours(self) -> np.ndarray:
        """The view before and the view after each, (V, 2); the view itself where there is none near enough."""
        pair = np.tile(np.arange(len(self.time_s))[:, None], 2)
        order = np.argsort(self.time_s)[: np.isfinite(self.time_s).sum()]
        near = np.diff(self.time_s[order]) < _REACH_INTERVALS * self.interval_s
        pair[order[1:][near], 0] = order[:-1][near]
        pair[order[:-1][near], 1] = order[1:][near]
        return pair

    def paths(self, T_world_board: np.ndarray) -> np.ndarray:
        """From each view's pose to the pose before and after: rotation vector rad and shift mm, (V, 2, 6)."""
        there, here = T_world_board[self.neighbours], T_world_board[:, None]
        turn = log_rotation(there[..., :3] @ np.swapaxes(here[..., :3], -1, -2))
        return np.concatenate([turn, there[..., 3] - here[..., 3]], axis=-1)

    def shares(self, view: np.ndarray, elapsed_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How much of the path to the pose before and after the board has gone at elapsed_s (n,) from view (n,).

        Shares (n, 2) and their rates (n, 2), 1/s: the parabola that is 0 now and 1 at its own neighbour; a straight
        line where there is one neighbour, nothing where there is none.
        """
        apart = self.time_s[self.neighbours[view]] - self.time_s[view][:, None]
        there, e = np.nan_to_num(apart) != 0, elapsed_s[:, None]
        own, other = np.where(there, apart, 1.0), np.where(there, apart, 0.0)[:, ::-1]
        curved = there & there[:, ::-1]
        below = np.where(curved, own - other, 1.0)
        share = e / own * np.where(curved, (e - other) / below, 1.0)
        rate = np.where(curved, (2 * e - other) / below, 1.0) / own
        return np.where(there, share, 0.0), np.where(there, rate, 0.0)
