"""Cameras from views of a board: one adjustment over everything, noise as the pictures show it,
full covariance.

In: views of a board held anywhere, and views of the board standing on the rig, whose pose
T_rig_board places the cameras. Out: cameras in the rig frame with the joint covariance of all their
parameters, and a report on the data of each.

Lens terms each carry a weak prior, as wide as lenses on a bench are (LENS_PRIOR). A term leaves
zero only as far as the views demand it, and one they do not constrain keeps the prior's sigma
instead of running away (a free k3 on 14 views came out at 6).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from vision.boards.board_coverage import check_work, coverage
from vision.boards.corners import Corners
from vision.boards.static_board import camera_moved, mean_view
from vision.boards.sufficiency import (
    check_errors,
    check_lenses,
    check_rig_view,
    check_views,
    depth_ratio,
    squash_of,
    tilt_deg,
    usable_views,
    without_strays,
)
from vision.calibration.adjust import adjust_bundle
from vision.calibration.bundle import N_CAMERA, BundleState
from vision.calibration.corner_noise import Adjustment, adjust_with_noise
from vision.calibration.exchanged_boards import check_own_lenses
from vision.calibration.faces import place_faces
from vision.calibration.first_guess import with_pose
from vision.calibration.layout import Alone, Layout
from vision.calibration.one_picture import calibrate_picture, first_lenses
from vision.calibration.place import by_board
from vision.calibration.shared_errors import with_shared_errors
from vision.calibration.tied import JointAdjustment, JointInput, Timing, timing_note
from vision.calibration.views import BoardViews, MeasuredPose
from vision.geometry.board import PRINT_TERMS, Board
from vision.geometry.camera import N_PARAMETERS, Camera, Cameras, camera_matrix
from vision.geometry.crop import Crop
from vision.geometry.reasons import Reason
from vision.geometry.refusals import Refused

__all__ = ["Calibration", "CameraReport", "calibrate_cameras", "camera_moved"]

# [chi²] Two parameters gain more once in 10 000: −2 ln 1e-4. Derived.
_WARP_GAIN = 18.4
# [mm] A prior, wider than any print bows. moves nothing on the fixtures between 0.5 and 10 (they
# do not call for a warp). Study: thresholds.py calibration.calibrate _WARP_SIGMA_MM ….
_WARP_SIGMA_MM = 2.0
# [mm] Errors of the board's points from which a note says them: half of those of a cube's prints.
# Stated.
_NOTED_POINTS_MM = 0.01
# [chance] By which a print that is stretched as its sigma says would call for a warning: 2.6 sigma,
# of which the views take nearly all into account. Stated.
_STRETCH_ALARM = 0.01
# [column] A layout, no threshold.
_STRETCH = PRINT_TERMS.index("stretch") - len(PRINT_TERMS)


@dataclass(frozen=True, eq=False)
class CameraReport:
    """The data of one camera's calibration, and its residuals.

    views, corners: used; left_out: corners beyond the rejection limit. rms_px: of the kept
    residuals. error_px: model error per axis in addition to the corners' own sigma. coverage: share of the
    picture within the hull of all corners. depth_ratio: farthest to nearest corner. tilt_deg:
    largest tilt of the board; both of all views by the lens. intrinsics_sigma: (9,), of fx fy cx cy k1 k2 p1 p2 k3.
    """

    name: str
    views: int
    corners: int
    left_out: int
    rms_px: float
    error_px: float
    coverage: float
    depth_ratio: float
    tilt_deg: float
    intrinsics_sigma: np.ndarray


@dataclass(frozen=True, eq=False)
class Calibration:
    """Cameras in the rig frame with their covariance, a report each, and notes in plain sentences.

    together: whether the cameras saw the board at once. timing: None where pictures of one view
    count as of one instant. board (B,), board_covariance (B, B): the terms of `placed_board`, 0 of
    what is held: those of its shape, then of its print, PRINT_TERMS. placed_board: with its faces, if it
    has several, where the adjustment began. points_mm (m, 3) or (1, 3): how far its points are from there.
    warnings: where the views contradict what is stated.
    """

    cameras: Cameras
    report: tuple[CameraReport, ...]
    notes: tuple[str, ...]
    timing: Timing | None
    board: np.ndarray
    board_covariance: np.ndarray
    placed_board: Board
    points_mm: np.ndarray
    together: bool
    warnings: tuple[Reason, ...] = ()

    @property
    def board_mm(self) -> np.ndarray:
        """Return the board's points as adjusted, (m, 3)."""
        return self.placed_board.printed(self.board)[0] + self.points_mm

    def with_board(self, state: BundleState) -> BundleState:
        """Return a state with the board as adjusted."""
        return replace(state, board=self.board, points_mm=self.points_mm)


def calibrate_cameras(
    views: BoardViews,
    board: Board,
    on_rig: MeasuredPose | None,
    *,
    work_points_mm: np.ndarray | None = None,
    triggered: bool = False,
) -> Calibration:
    """Calibrate all cameras in one adjustment.

    Whether the cameras saw the held board at once is found from its views; their times help.
    on_rig: where the board stands on the rig; None for one camera or cameras that saw it at once:
    then the world is the first camera's frame. work_points_mm (n, 3): where the whisker will be,
    which each camera's views must cover. triggered: pictures of one view are known to be of one
    instant, so that no other is searched for.

    Raises Refused, saying what to record, where the views cannot give a calibration.
    """
    board = place_faces(views, board)
    crops = [views.crop(name) for name in views.boards]
    alone = _alone(views, board, on_rig is not None)
    standing = standing_boards(views, board) if on_rig else None
    lens_notes = _check_own_lenses(alone, standing, views, board)
    joint = JointInput(alone, standing, board, on_rig, views.times_s, triggered, crops).adjust()
    adjustment, notes = _finished(joint, alone, board, triggered)
    stretch_notes, warnings = _stretch_lines(adjustment, board)
    cameras = _place(as_cameras(alone, views.sizes_px, adjustment), on_rig)
    reports = _checked_reports(cameras, alone, crops, adjustment, board, views.pixel_aspects)
    check_work(cameras, alone, standing, work_points_mm)
    return Calibration(
        cameras=cameras,
        report=reports,
        notes=(*joint.notes, *lens_notes, *notes, *stretch_notes),
        timing=joint.timing,
        board=adjustment.solution.state.board,
        board_covariance=_board_covariance(adjustment),
        placed_board=board,
        points_mm=adjustment.solution.state.points_mm,
        together=joint.layout.trajectory is not None,
        warnings=(*_disagreement(joint), *warnings, *_squashed(cameras, views.pixel_aspects)),
    )


def _finished(
    joint: JointAdjustment, alone: Mapping[str, Alone], board: Board, triggered: bool
) -> tuple[Adjustment, list[str]]:
    """Return the adjustment with all that is learnt from its residuals, and notes on it.

    triggered: as of `calibrate_cameras`. Raises Refused as `_check_adjustment`.
    """
    adjustment, notes = _with_warp(joint.layout, joint.adjustment, board)
    _check_adjustment(alone, adjustment, triggered)
    notes += _point_notes(adjustment)
    if joint.timing is not None:
        notes.append(timing_note(alone, joint.timing))
    adjustment, shared_notes = with_shared_errors(adjustment, board, list(alone))
    return adjustment, [*notes, *shared_notes]


def _disagreement(joint: JointAdjustment) -> Iterator[Reason]:
    """Yield a warning where cameras disagree about the board and are tied by it all the same."""
    if joint.disagreement:
        cure = "record views of a board at rest, or trigger the cameras"
        yield Reason("boards_not_at_once", f"{joint.disagreement}: {cure}")


def _squashed(cameras: Cameras, pixel_aspects: Mapping[str, float]) -> Iterator[Reason]:
    """Yield a warning for each camera whose pixels are not square, unless that is stated."""
    for camera in cameras:
        aspect = squash_of(camera)
        if aspect is not None and camera.name not in pixel_aspects:
            found = f"camera {camera.name}: pixels are not square, fx/fy = {aspect:.4f}"
            cure = "a camera that squashes pictures; taken into account. If it is meant, state it"
            key = f"[[cameras]] pixel_aspect = {aspect:.4g}"
            yield Reason("pixels_not_square", f"{found}: {cure}: {key}")


def _check_adjustment(names: Iterable[str], adjustment: Adjustment, triggered: bool) -> None:
    """Raise Refused for views that no lens and no poses explain, or that let nothing come to rest.

    triggered: as of `calibrate_cameras`; errors are not checked then.
    """
    if not triggered:
        check_errors(names, adjustment.error_px)
    if not adjustment.solution.converged:
        raise Refused(
            "the adjustment of the cameras did not come to rest: record more views, well spread and tilted"
        )


def _checked_reports(
    cameras: Cameras,
    alone: Mapping[str, Alone],
    crops: Sequence[Crop],
    adjustment: Adjustment,
    board: Board,
    pixel_aspects: Mapping[str, float],
) -> tuple[CameraReport, ...]:
    """Return a report of each camera; raise Refused where its views do not determine its lens."""
    reports = []
    used = {}
    for c, (name, camera) in enumerate(alone.items()):
        of_lens = [other for other, crop in zip(alone.values(), crops) if crop.of == crops[c].of]
        reports.append(_report(c, cameras, camera, of_lens, adjustment, board))
        used[name] = camera.views.values()
    check_lenses(cameras, reports, used, pixel_aspects)
    return tuple(reports)


def _place(cameras: Cameras, on_rig: MeasuredPose | None) -> Cameras:
    """Return the cameras with the covariance of their place in the rig frame, where that was
    measured.
    """
    if on_rig is None:
        return cameras
    placement = by_board(on_rig.T_rig_board, on_rig.sigma_mm, on_rig.sigma_rad)
    return replace(cameras, placement=placement.covariance)


def standing_boards(views: BoardViews, board: Board) -> dict[str, Corners]:
    """Return the board on the rig in each camera, averaged over its picture and the trials' frames."""
    standing = {}
    for name in views.boards:
        rig_view = without_strays(views.rig[name], board)
        standing[name] = mean_view(rig_view, views.trials.get(name, ()))
    return standing


def _check_own_lenses(
    alone: Mapping[str, Alone],
    standing: Mapping[str, Corners] | None,
    views: BoardViews,
    board: Board,
) -> list[str]:
    """Return notes on whose lens is whose; none without a board on the rig. Raises Refused where
    board views are exchanged.
    """
    if standing is None:
        return []
    same_in_trials = all(views.trials.get(name) for name in alone)
    by_picture = {}
    for name, camera in alone.items():  # parts of one picture cannot be exchanged
        by_picture.setdefault(views.crop(name).of, (name, camera))
    return check_own_lenses(
        dict(by_picture.values()), standing, board, same_in_trials=same_in_trials
    )


def _alone(views: BoardViews, board: Board, with_rig: bool) -> dict[str, Alone]:
    """Calibrate each picture by itself, for the start of the joint adjustment and the error of the
    camera alone.

    The cameras that are parts of one picture have one lens.
    """
    pictures: dict[str, list[str]] = {}
    for name in views.boards:
        pictures.setdefault(views.crop(name).of, []).append(name)
    found = {}
    for names in pictures.values():
        found |= _alone_of_picture(names, views, board, with_rig)
    return {name: found[name] for name in views.boards}


def _alone_of_picture(
    names: Sequence[str], views: BoardViews, board: Board, with_rig: bool
) -> dict[str, Alone]:
    """Calibrate the cameras that are parts of one picture. Raises Refused where its views do not suffice."""
    crops = [views.crop(name) for name in names]
    fixing = [usable_views(views.boards[name], board) for name in names]
    lenses = first_lenses([list(own.values()) for own in fixing], board, crops)
    usable = [with_pose(own, board.corners_mm, lens) for own, lens in zip(fixing, lenses)]
    check_views(" and ".join(names), [view for own in usable for view in own.values()])
    for name, own in zip(names, usable):
        _check_sees_board(name, len(own), views.rig.get(name), board, with_rig)
    by_camera = [list(own.values()) for own in usable]
    return _each_alone(names, usable, calibrate_picture(by_camera, board, crops))


def _each_alone(
    names: Sequence[str], usable: Sequence[dict[int, Corners]], adjustment: Adjustment
) -> dict[str, Alone]:
    """Return by name the cameras of one picture as adjusted together; usable: the views of each."""
    state = adjustment.solution.state
    poses = iter(state.T_world_board)
    found = {}
    for c, (name, own) in enumerate(zip(names, usable)):
        own_poses = {k: next(poses) for k in own}
        found[name] = Alone(state.lens[c], float(adjustment.error_px[c]), own, own_poses)
    return found


def _check_sees_board(
    name: str, views: int, rig_view: Corners | None, board: Board, with_rig: bool
) -> None:
    """Raise Refused for a camera that never sees the board, or not the board on the rig."""
    if with_rig:
        check_rig_view(name, None if rig_view is None else without_strays(rig_view, board), board)
    if not views:
        raise Refused(
            f"camera {name}: the board is in no view well seen: record some that it sees together "
            "with the rest of the picture"
        )


def _with_warp(layout: Layout, flat: Adjustment, board: Board) -> tuple[Adjustment, list[str]]:
    """Adjust with a warped board where that lowers the cost, at the flat board's noise, by more
    than chance would.

    Returns the adjustment and notes.
    """
    priors = flat.priors.observed(slice(-2, None), [_WARP_SIGMA_MM] * 2)
    kept = flat.seen.select(flat.kept)
    warped = adjust_bundle(flat.solution.state, kept, board, priors, tolerance=1e-6)
    if flat.solution.cost - warped.cost < _WARP_GAIN:
        return flat, []
    adjustment = adjust_with_noise(
        warped.state, layout.seen, board, priors, error_px=flat.error_px, rounds=1
    )
    x_mm, y_mm = adjustment.solution.state.board[-2:]
    note = f"The board is bent by {x_mm:+.3f} mm along x and {y_mm:+.3f} mm along y; taken into account."
    return adjustment, [note]


def _point_notes(adjustment: Adjustment) -> list[str]:
    """Return a note on how far the board's points are from their places, where that is worth one."""
    rms_mm = np.sqrt(np.mean(adjustment.solution.state.points_mm**2))
    if rms_mm < _NOTED_POINTS_MM:
        return []
    return [
        f"The board's points lie beside their places by {rms_mm:.3f} mm RMS an axis; taken into account."
    ]


def _board_covariance(adjustment: Adjustment) -> np.ndarray:
    """Return the covariance (B, B) of the board's terms."""
    terms = len(adjustment.solution.state.board)
    return adjustment.solution.covariance[-terms:, -terms:]


def _stretch_lines(adjustment: Adjustment, board: Board) -> tuple[list[str], tuple[Reason, ...]]:
    """Return a note on how much longer the print is along y than along x, and a warning where that
    is more than `stretch_sigma` lets chance make it.

    What the views make of a prior of standard deviation σ scatters by √(σ² − s²), s being what they
    leave of it. Nothing is said of a stretch that is taken as exact.
    """
    if not board.stretch_sigma:
        return [], ()
    stretch = adjustment.solution.state.board[_STRETCH]
    sigma = np.sqrt(_board_covariance(adjustment)[_STRETCH, _STRETCH])
    found = f"{100 * stretch:+.3f} ± {100 * sigma:.3f} %"
    note = f"The board's print is longer along y than along x by {found}; taken into account."
    by_chance = max(board.stretch_sigma**2 - sigma**2, sigma**2)
    if stretch**2 <= chdtri(1, _STRETCH_ALARM) * by_chance:
        return [note], ()
    longer = "y" if stretch > 0 else "x"
    warning = (
        f"the board's print is {100 * abs(stretch):.2f} ± {100 * sigma:.2f} % longer along {longer}, "
        f"stretch_sigma says ± {100 * board.stretch_sigma:.2g} %: measure both directions"
    )
    return [note], (Reason("board_stretched", warning),)


def as_cameras(
    names: Sequence[str], sizes_px: Mapping[str, tuple[int, int]], adjustment: Adjustment
) -> Cameras:
    """Return the adjusted cameras with the covariance of their 15 parameters each."""
    state = adjustment.solution.state
    cameras = []
    rows = []
    for c, name in enumerate(names):
        lens = state.lens[c]
        T = state.T_camera_world[c]
        rms_px = adjustment.rms_px(c)
        cameras.append(Camera(name, sizes_px[name], camera_matrix(lens), lens[4:], T, rms_px))
        rows += range(N_CAMERA * c, N_CAMERA * c + N_PARAMETERS)
    return Cameras(tuple(cameras), adjustment.solution.covariance[np.ix_(rows, rows)])


def _report(
    c: int,
    cameras: Cameras,
    alone: Alone,
    of_lens: Sequence[Alone],
    adjustment: Adjustment,
    board: Board,
) -> CameraReport:
    """Return the report of camera number c. of_lens: all cameras that have its lens."""
    camera = cameras.cameras[c]
    kept = adjustment.kept[adjustment.seen.camera == c]
    views = [view for other in of_lens for view in other.views.values()]
    poses = [pose for other in of_lens for pose in other.poses.values()]
    variances = np.diag(cameras.covariance)[cameras.parameters_of(camera.name)]
    return CameraReport(
        name=camera.name,
        views=len(alone.views),
        corners=int(kept.sum()),
        left_out=int((~kept).sum()),
        rms_px=camera.rms_px,
        error_px=float(adjustment.error_px[c]),
        coverage=coverage(list(alone.views.values()), camera.size_px),
        depth_ratio=depth_ratio(poses, views, board),
        tilt_deg=tilt_deg(poses),
        intrinsics_sigma=np.sqrt(variances[:9]),
    )
