"""How a board held by hand moves between views, for pictures that were taken late.

Cameras started by software take "the same" frame tens of milliseconds apart, and a camera that
buffers is late by whole frames now and then. A board at 0.5 m/s is by then elsewhere by many
pixels, so that no one pose fits all cameras. The board's poses in the neighbouring views say where
it was: through a view's pose and those before and after goes a parabola (turn as a rotation vector
about the view's own pose). A board that is shaken is near that path, not on it: by how much is learnt
(`vision.calibration.corner_noise`).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vision.geometry.rotation import log_rotation

# [frame intervals] Neighbours farther away say nothing of the motion now: two to either side count, with
# their times' jitter, and no third. Derived. Study: cameras.py.
_REACH_INTERVALS = 2.6


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The times of V views.

    time_s (V,): NaN for a view that is not on the trajectory (the board on the rig). camera_rank
    (C,): in each view the picture of the camera that ranks first is taken at the view's time; the
    others' instants are counted from it, as only differences of time can be seen.
    """

    time_s: np.ndarray
    camera_rank: np.ndarray

    @property
    def interval_s(self) -> float:
        """Return the median time between views that follow each other; NaN with one view."""
        taken_s = np.sort(self.time_s[np.isfinite(self.time_s)])
        return float(np.median(np.diff(taken_s))) if len(taken_s) > 1 else np.nan

    def is_reference(self, view: np.ndarray, camera: np.ndarray) -> np.ndarray:
        """Return which pictures (view, camera), (s,) each, give their view its time: (s,) bool."""
        rank = self.camera_rank[camera]
        first = np.full(len(self.time_s), len(self.camera_rank))
        np.minimum.at(first, view, rank)
        return rank == first[view]

    def may_stray(self, view: np.ndarray, camera: np.ndarray) -> np.ndarray:
        """Return which pictures (view, camera), (s,) each, may be of another instant than their view, the
        board being elsewhere: (s,) bool.
        """
        return np.isfinite(self.time_s[view]) & ~self.is_reference(view, camera)

    @cached_property
    def neighbours(self) -> np.ndarray:
        """Return the view before and the view after each, (V, 2).

        It is the view itself where there is none near enough.
        """
        order = np.argsort(self.time_s)[: np.isfinite(self.time_s).sum()]
        is_near = np.diff(self.time_s[order]) < _REACH_INTERVALS * self.interval_s
        earlier = order[:-1][is_near]
        later = order[1:][is_near]
        pair = np.tile(np.arange(len(self.time_s))[:, None], 2)
        pair[later, 0] = earlier
        pair[earlier, 1] = later
        return pair

    def paths(self, T_world_board: np.ndarray) -> np.ndarray:
        """Return how each view's pose differs from the pose before and after, (V, 2, 6).

        T_world_board (V, 3, 4). Rotation vector, rad, and shift, mm.
        """
        own = T_world_board[:, None]
        neighbour = T_world_board[self.neighbours]
        turn = log_rotation(neighbour[..., :3] @ own[..., :3].swapaxes(-1, -2))
        return np.concatenate([turn, neighbour[..., 3] - own[..., 3]], axis=-1)

    def shares(self, view: np.ndarray, elapsed_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return which shares of its paths to the pose before and to that after the board has gone.

        elapsed_s (n,): since the time of each view (n,). Returns shares (n, 2) and their rates
        (n, 2), 1/s. Each share is the parabola in time that is 0 at the view and at the other
        neighbour, and 1 at its own: a straight line where there is no other neighbour, and 0 where
        its own is missing.
        """
        elapsed = elapsed_s[:, None]
        interval = self.time_s[self.neighbours[view]] - self.time_s[view][:, None]  # (n, 2) s
        exists = np.nan_to_num(interval) != 0
        own = np.where(exists, interval, 1.0)
        other = np.where(exists, interval, 0.0)[:, ::-1]
        curved = exists & exists[:, ::-1]
        span = np.where(curved, own - other, 1.0)
        share = elapsed / own * np.where(curved, (elapsed - other) / span, 1.0)
        rate = np.where(curved, (2 * elapsed - other) / span, 1.0) / own
        return np.where(exists, share, 0.0), np.where(exists, rate, 0.0)
