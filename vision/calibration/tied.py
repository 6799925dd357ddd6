"""The joint adjustment: whether views of one index are of one board at one instant, and its result.

Cameras that see one board at once share its pose in each view, and that ties them to each other.
Series of their own may agree by chance (boards held in the same order of poses), and cameras that
are not triggered see a moving board at other instants. Each camera by itself needs no such tie, and
so gives the error with which its views can be explained.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.boards.corners import Corners
from vision.boards.sufficiency import MOST_ERROR_PX
from vision.calibration.bundle import LATENESS, BundleState, Priors, SharedLenses
from vision.calibration.corner_noise import Adjustment, adjust_coarse, adjust_with_noise
from vision.calibration.instants_help import (
    TURNS,
    Comparison,
    chance_of_one_instant,
    residuals_by_view,
)
from vision.calibration.layout import Alone, Layout, lay_out, place_cameras, saw_board_at_once
from vision.calibration.priors import allow_lateness, joint_priors, pose_priors
from vision.calibration.views import MeasuredPose
from vision.geometry.board import Board
from vision.geometry.crop import Crop
from vision.geometry.refusals import Refused

# [1] Cameras that share views were not triggered together where they agree this many times worse
# than each with itself. Origin not known; webcams without a trigger disagree by several times.
# Study: cameras.py.
_DISAGREE = 1.5
# [chance] Of pictures of one instant, from which instants of their own are compared on held-out views.
# Stated: it takes time and enters no number.
_LEAST_CHANCE = 0.01
# [px] Where the fit of instants starts; learnt anew. Study: cameras.py.
_FIRST_EXCESS_PX = 0.1
# [rounds] Of learning the noise anew where models are compared, whose difference it does not turn:
# four webcams gain 5 sigmas with 1 and with 5. Study: real_calibration.py.
_HELD_OUT_ROUNDS = 1
# [px] Of one camera by itself, so that nothing is divided by 0. Derived.
_LEAST_ERROR_PX = 1e-3


@dataclass(frozen=True, eq=False)
class Timing:
    """The lateness of cameras that are not triggered together.

    offset_s, scatter_s (C,): mean and standard deviation of how late each camera's pictures are, in
    s, or in frame intervals where the pictures' times were not given (in_frames). held_out: what
    that makes of views held out, in words.
    """

    offset_s: np.ndarray
    scatter_s: np.ndarray
    in_frames: bool
    held_out: str


@dataclass(frozen=True, eq=False)
class JointAdjustment:
    """The joint adjustment of all cameras, with notes for the report.

    timing: None for pictures of one instant. disagreement: in what the cameras disagree about the
    board, where no instants explain it; '' where they agree.
    """

    layout: Layout
    adjustment: Adjustment
    timing: Timing | None
    disagreement: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class JointInput:
    """The input of the joint adjustment.

    alone: cameras by themselves. standing: the board on the rig in each; on_rig: its measured pose.
    times_s: of each picture. triggered: see `calibrate_cameras`. crops: the part of a picture that each
    camera is, in the cameras' order.
    """

    alone: Mapping[str, Alone]
    standing: Mapping[str, Corners] | None
    board: Board
    on_rig: MeasuredPose | None
    times_s: Mapping[str, Sequence[float]] | None
    triggered: bool
    crops: Sequence[Crop]

    @property
    def _is_one_picture(self) -> bool:
        """Return whether all cameras are parts of one picture, and so see the board at once."""
        return len({crop.of for crop in self.crops}) == 1

    def adjust(self) -> JointAdjustment:
        """Adjust all cameras jointly.

        Views of one index count as of one board where the cameras' poses agree with that and the
        joint adjustment explains the views as well as each camera by itself does. Else each camera
        has views of its own, if the board on the rig places the cameras. Without that board the
        cameras stay tied, and `disagreement` says so; raises Refused where views are explained far
        worse so than by each camera itself.
        """
        if self._is_one_picture:
            return self._adjust(self._layout(together=True))
        if not saw_board_at_once(self.alone):
            return self._adjust(self._layout(together=False))
        try:
            joint = self._adjust(self._layout(together=True))
            complaint = "" if self.triggered else self._far_worse(joint.adjustment)
        except Refused as reason:
            complaint = str(reason)
        if not complaint:
            if not joint.disagreement or self.standing is None:
                return joint
            complaint = joint.disagreement
        found = f"of one index look as if the cameras saw one board at once, but they did not: {complaint}"
        if self.standing is None:
            raise Refused(
                f"views {found}; record views that all cameras see at once, a board at rest or a "
                "trigger, or a picture of the board on the rig"
            )
        note = f"Views {found}. Each camera's views count as its own."
        return replace(self._adjust(self._layout(together=False)), notes=(note,))

    def _far_worse(self, adjustment: Adjustment) -> str:
        """Return in which camera the adjustment explains the views far worse than the camera by
        itself does; '' if in none.
        """
        own_px = self._own_errors_px()
        ratio = adjustment.error_px / np.maximum(_DISAGREE * own_px, MOST_ERROR_PX)
        worst = int(np.argmax(ratio))
        if adjustment.solution.converged and ratio[worst] < 1.0:
            return ""
        return (
            f"so taken, corners of camera {list(self.alone)[worst]} are off by "
            f"{adjustment.error_px[worst]:.2f} px an axis, by itself {own_px[worst]:.2f} px"
        )

    def _own_errors_px(self) -> np.ndarray:
        """Return the model error (C,) of each camera by itself."""
        return np.array([camera.error_px for camera in self.alone.values()])

    def _layout(self, *, together: bool) -> Layout:
        """Return all views, those of one index as of one board, or each camera's own."""
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
        return replace(layout, first=replace(layout.first, board=self.board.stated_terms))

    def _adjust(self, layout: Layout) -> JointAdjustment:
        """Adjust all cameras.

        Pictures of one view count as of one instant, unless the cameras agree worse with each other
        than with themselves, and instants of their own help on views held out.
        """
        if layout.trajectory is None or self.triggered or self._is_one_picture:
            return JointAdjustment(layout, self._at_once(layout), None)
        coarse = adjust_coarse(layout.first, layout.seen, self.board, self._priors_of(layout))
        own_px = self._own_errors_px()
        ratio = coarse.error_px / np.maximum(own_px, _LEAST_ERROR_PX)
        agree = bool(np.median(ratio) < _DISAGREE)
        seen = layout.seen.with_error(own_px)
        if agree and chance_of_one_instant(coarse.solution, seen, self.board) > _LEAST_CHANCE:
            return JointAdjustment(layout, self._at_once(layout), None)
        comparison = self._compare_on_held_out()
        if not comparison.instants_help:
            found = (
                "the cameras disagree about the board's pose, and pictures late by an offset do not "
                f"explain it ({comparison.in_words})"
            )
            return JointAdjustment(layout, self._at_once(layout), None, "" if agree else found)
        adjustment = self._with_instants(layout, coarse.solution.state)
        timing = Timing(
            offset_s=adjustment.solution.state.clock,
            scatter_s=adjustment.priors.picture_sigma[:, LATENESS],
            in_frames=self.times_s is None,
            held_out=comparison.in_words,
        )
        return JointAdjustment(layout, adjustment, timing)

    def _priors_of(self, layout: Layout) -> Priors:
        """Return the priors of all views."""
        return joint_priors(layout.first, self.board, self.on_rig, SharedLenses.of(self.crops))

    def _at_once(self, layout: Layout, rounds: int | None = None) -> Adjustment:
        """Adjust all cameras with the pictures of a view as of one instant.

        rounds: of learning the noise anew.
        """
        priors = self._priors_of(layout)
        return adjust_with_noise(layout.first, layout.seen, self.board, priors, rounds=rounds)

    def _with_instants(
        self, layout: Layout, first: BundleState, rounds: int | None = None
    ) -> Adjustment:
        """Adjust all cameras with instants of the pictures and the board's points as stated, from a
        first state.

        rounds: of learning the noise anew.
        """
        return adjust_with_noise(
            replace(first, trajectory=layout.trajectory, points_mm=layout.first.points_mm),
            layout.seen,
            self.board,
            allow_lateness(self._priors_of(layout), layout.trajectory, self.board),
            error_px=self._own_errors_px() + _FIRST_EXCESS_PX,
            rounds=rounds,
        )

    def _compare_on_held_out(self) -> Comparison:
        """Compare instants of their own with one instant a view, on views of which neither knows."""
        at_once_px: list[float] = []
        instants_px: list[float] = []
        indices = {k for camera in self.alone.values() for k in camera.views}
        for turn in range(TURNS):
            is_held = {k: k % TURNS == turn for k in indices}
            try:
                layout = self._without(is_held)._layout(together=True)
                at_once = self._at_once(layout, _HELD_OUT_ROUNDS).solution.state
                instants = self._with_instants(layout, at_once, _HELD_OUT_ROUNDS).solution.state
            except Refused:
                continue
            everything = self._held_layout(at_once)
            one_instant = replace(everything, trajectory=None)
            by_one = self._residuals_by_view(at_once, one_instant, is_held)
            by_own = self._residuals_by_view(instants, self._held_layout(instants), is_held)
            at_once_px += by_one.values()
            instants_px += [by_own[index] for index in by_one]
        return Comparison(np.array(at_once_px), np.array(instants_px))

    def _without(self, is_held: Mapping[int, bool]) -> "JointInput":
        """Return the input without the views of some indices."""
        alone = {}
        for name, camera in self.alone.items():
            views = {k: view for k, view in camera.views.items() if not is_held[k]}
            poses = {k: pose for k, pose in camera.poses.items() if not is_held[k]}
            alone[name] = replace(camera, views=views, poses=poses)
        return replace(self, alone=alone)

    def _held_layout(self, cameras: BundleState) -> Layout:
        """Return all held views before adjusted cameras, without the board on the rig."""
        layout = lay_out(self.alone, cameras.T_camera_world, together=True, times_s=self.times_s)
        return replace(layout, first=replace(layout.first, lens=cameras.lens))

    def _residuals_by_view(
        self, cameras: BundleState, layout: Layout, is_held: Mapping[int, bool]
    ) -> dict[int, float]:
        """Return the residual of each held-out view, by index; see `residuals_by_view`."""
        priors = pose_priors(len(self.alone), len(layout.index), self.board)
        return residuals_by_view(cameras, layout, is_held, self.board, priors)


def timing_note(names: Sequence[str], timing: Timing) -> str:
    """Return a sentence on how much later than the view each camera's pictures are, and their
    scatter.
    """
    scale, unit = (1.0, "frames") if timing.in_frames else (1e3, "ms")
    late = []
    for name, offset_s, scatter_s in zip(names, timing.offset_s, timing.scatter_s):
        late.append(f"{name} {scale * offset_s:+.3g} ± {scale * scatter_s:.2g} {unit}")
    return (
        "Pictures of one view were not taken at one instant: later than the view by "
        f"{', '.join(late)} (below 0: earlier); taken into account, for {timing.held_out}."
    )
