"""Views of one index, taken as of one board at one instant or not: which of it explains what was seen.

Cameras that looked at once share a board pose a view, and that ties them to each other. Series of their own may look
alike (boards held in the same order of poses), and cameras that are not triggered see a moving board at other instants.
Each camera by itself needs no such tie, and so says how well its views can be explained.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.boards.corners import Corners
from vision.boards.sufficiency import MOST_ERROR_PX
from vision.calibration.board_motion import Trajectory
from vision.calibration.bundle import (
    CAMERA_COLUMNS,
    CLOCK,
    N_BOARD,
    N_CAMERA,
    POSE,
    BundleState,
    Priors,
)
from vision.calibration.corner_noise import Settled, settle
from vision.calibration.layout import Alone, Layout, lay_out, looked_at_once, place_cameras
from vision.calibration.views import MeasuredPose
from vision.geometry.board import Board
from vision.geometry.refusals import Refused

# One sigma about zero of the distortion terms, for lenses of 3 to 100 mm; wider than any that is not a
# fisheye.
LENS_PRIOR = {"k1": 0.5, "k2": 0.5, "p1": 0.005, "p2": 0.005, "k3": 0.3}
# [1] Cameras that share views were not triggered together where they agree this many times worse
# than each with itself. Origin not known; webcams without a trigger disagree by several times.
# Study: cameras.py.
_DISAGREE = 1.5
# [frame intervals] A prior. Origin not known: twice the 0.29 of cameras that start at random
# within an interval. Study: cameras.py.
_CLOCK_SIGMA = 0.6
# [frame intervals] Where the fit of instants starts; learnt anew from the residuals. Study:
# cameras.py.
_FIRST_LATENESS = 0.2
# [px] Where the fit of instants starts; learnt anew. Study: cameras.py.
_FIRST_EXCESS_PX = 0.1


@dataclass(frozen=True, eq=False)
class Timing:
    """Cameras that are not triggered together: offset_s and scatter_s (C,), how late pictures are on average and how
    much that varies; s, or frame intervals where the pictures' times were not given (in_frames)."""

    offset_s: np.ndarray
    scatter_s: np.ndarray
    in_frames: bool


@dataclass(frozen=True, eq=False)
class Tied:
    """What one adjustment is made from: cameras by themselves, the board on the rig in each, and its measured pose.
    times_s: of each picture; triggered: see `calibrate_cameras`."""

    alone: Mapping[str, Alone]
    standing: Mapping[str, Corners] | None
    board: Board
    on_rig: MeasuredPose | None
    times_s: Mapping[str, Sequence[float]] | None
    triggered: bool

    def adjusted(self) -> tuple[Layout, Settled, Timing | None, list[str]]:
        """The layout, its adjustment, how late pictures are, and a note.

        Views of one index count as of one board where they look it and that explains them; where each camera by itself
        explains its views far better, they are its own. Raises Refused where nothing else tells how cameras stand.
        """
        if not looked_at_once(self.alone):
            return *self._settled(False), []
        try:
            tied = self._settled(True)
            doubt = "" if self.triggered else self._far_worse(tied[1])
        except Refused as reason:
            doubt = str(reason)
        if not doubt:
            return *tied, []
        said = f"views of one index look as if the cameras saw one board at once, but they did not: {doubt}"
        if self.standing is None:
            raise Refused(
                f"{said}; record views that all cameras see at once, or a picture of the board on the rig"
            )
        return *self._settled(False), [
            f"{said[0].upper()}{said[1:]}. Each camera's views count as its own."
        ]

    def _far_worse(self, settled: Settled) -> str:
        """In which camera the adjustment explains the views far worse than the camera by itself does; '' in none."""
        own = np.array([a.error_px for a in self.alone.values()])
        over = settled.error_px / np.maximum(_DISAGREE * own, MOST_ERROR_PX)
        worst = int(np.argmax(over))
        if settled.solution.converged and over[worst] < 1.0:
            return ""
        return (
            f"so taken, corners of camera {list(self.alone)[worst]} are off by {settled.error_px[worst]:.2f} px an "
            f"axis, by itself {own[worst]:.2f} px"
        )

    def _settled(self, together: bool) -> tuple[Layout, Settled, Timing | None]:
        T_rig_board = self.on_rig.T_rig_board if self.on_rig else None
        poses = place_cameras(self.alone, self.standing, self.board, T_rig_board, together=together)
        layout = lay_out(
            self.alone,
            poses,
            standing=self.standing,
            T_rig_board=T_rig_board,
            together=together,
            times_s=self.times_s,
        )
        priors = _priors(layout.first, self.board, self.on_rig)
        return layout, *_settle(
            layout, self.board, priors, _errors(self.alone, self.triggered), self.times_s is None
        )


def _errors(alone: Mapping[str, Alone], triggered: bool) -> np.ndarray | None:
    """Each camera's error by itself, against which to judge how they agree; None where there is no need to."""
    return None if triggered or len(alone) < 2 else np.array([a.error_px for a in alone.values()])


def _settle(
    layout: Layout, board: Board, priors: Priors, error_alone: np.ndarray | None, in_frames: bool
):
    """With pictures of one view at one instant, unless cameras agree far worse with each other than with themselves."""
    if layout.trajectory is None or error_alone is None:
        return settle(layout.first, layout.seen, board.corners_mm, priors), None
    rough = settle(layout.first, layout.seen, board.corners_mm, priors, rough=True)
    if np.median(rough.error_px / np.maximum(error_alone, 1e-3)) < _DISAGREE:
        return settle(rough.solution.state, layout.seen, board.corners_mm, priors), None
    state = replace(rough.solution.state, trajectory=layout.trajectory)
    priors = allow_lateness(priors, layout.trajectory)
    settled = settle(
        state, layout.seen, board.corners_mm, priors, error_px=error_alone + _FIRST_EXCESS_PX
    )
    return settled, Timing(settled.solution.state.clock, settled.priors.late_sigma_s, in_frames)


def timing_note(names: Sequence[str], timing: Timing) -> str:
    """A sentence for the report: by how much each camera's pictures are later than the view, and their scatter."""
    scale, unit = (1.0, "frames") if timing.in_frames else (1e3, "ms")
    late = (
        f"{name} {scale * offset:+.3g} ± {scale * scatter:.2g} {unit}"
        for name, offset, scatter in zip(names, timing.offset_s, timing.scatter_s)
    )
    said = f"later than the view by {', '.join(late)} (below 0: earlier)"
    return f"Pictures of one view were not taken at one instant: {said}; taken into account."


def allow_lateness(priors: Priors, trajectory: Trajectory) -> Priors:
    """The same with clocks and pictures' instants free. The clock of the camera that ranks first is the clock."""
    free, sigma = priors.free.copy(), priors.sigma.copy()
    clocks = CLOCK + N_CAMERA * np.arange(len(trajectory.camera_rank))
    free[clocks[trajectory.camera_rank > 0]] = True
    sigma[clocks] = _CLOCK_SIGMA * trajectory.interval_s
    late = np.full(len(clocks), _FIRST_LATENESS * trajectory.interval_s)
    return replace(priors, free=free, sigma=sigma, late_sigma_s=late)


def lens_priors(n_cameras: int, n_views: int) -> Priors:
    """Lenses and poses free, the lenses' prior; board exact, cameras triggered together."""
    size = N_CAMERA * n_cameras + N_BOARD
    free, mean, sigma = np.ones(size, dtype=bool), np.zeros(size), np.full(size, np.inf)
    for column, name in enumerate(CAMERA_COLUMNS):
        rows = column + N_CAMERA * np.arange(n_cameras)
        sigma[rows] = LENS_PRIOR.get(name, np.inf)
        free[rows] = not name.endswith("_s")
    free[-N_BOARD:] = False
    return Priors(free, mean, sigma, np.ones(n_views, dtype=bool))


def _priors(first: BundleState, board: Board, on_rig: MeasuredPose | None) -> Priors:
    """The rig board's pose as it was measured: held where its sigma is 0, else an observation. Likewise the square.

    Without a rig board the first camera is the world's frame.
    """
    priors = lens_priors(len(first.lens), len(first.T_world_board))
    if board.square_sigma_mm > 0:
        priors.free[-N_BOARD] = True
        priors.sigma[-N_BOARD] = board.square_sigma_mm / board.square_mm
    if on_rig is None:
        priors.free[POSE] = False
        return priors
    priors.view_free[0] = not on_rig.is_exact
    pose_sigma = np.repeat([max(on_rig.sigma_rad, 1e-9), max(on_rig.sigma_mm, 1e-7)], 3)
    return replace(priors, pose_view=0, pose_T=on_rig.T_rig_board, pose_sigma=pose_sigma)
