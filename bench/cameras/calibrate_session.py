"""`whisker-bench calibrate cameras`: cameras.toml from a session's board views, and how far to trust it."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from bench.base.errors import BadInput
from bench.cameras.board_views import SessionViews, read_board_views, rig_view
from bench.cameras.cameras_toml import write_cameras
from bench.cameras.known_scale import check_scale
from bench.session.session import Session, load_session
from vision.boards.corners import Corners
from vision.calibration.calibrate import Calibration, CameraReport, calibrate_cameras
from vision.calibration.cameras_import import import_cameras, place_on_rig
from vision.calibration.held_out import Agreement, HeldOut, held_out
from vision.calibration.place import by_board, move_rig_frame
from vision.calibration.views import MeasuredPose
from vision.geometry.camera import Camera, Cameras
from vision.geometry.lens import LENS_TERMS
from vision.geometry.refusals import Refused

# Every fourth view (index % 4 == 3) measures a calibration from the other three quarters.
HOLD_EVERY = 4
# A distortion term this many sigmas from zero is one that the views ask for.
_ASKED_SIGMAS = 2.0
_MOST_LEFT_OUT = 0.1  # of a camera's corners: a tenth beyond 4.5 sigma is no noise. Set by eye
# Bars stand beyond this share of the whisker, and are looked at by so much on either side of it.
_NEAREST_BAR, _BAR_REACH_MM = 0.4, 20.0
_NOT_PLACED = (
    "T_rig_board is missing, so the cameras stand in the frame of the board on the rig, or of the first camera where "
    "there is no such board; `evaluate` without a cameras.toml finds the rig by the free strokes"
)


def calibrate_cameras_command(
    session: Path, out: Path, lenses: Path | None = None, *, follow_links: bool = False
) -> int:
    """Calibrates, writes `out` (TOML) and its .npz, prints the report. Returns 0, or 1 where something is doubtful.

    lenses: a camera TOML of caliscope or aniposelib to take the lenses from; the session then only places the cameras.
    Raises BadInput or Refused, saying what to record, before anything is written.
    """
    loaded = load_session(session, lenses_known=lenses is not None, follow_links=follow_links)
    if lenses is not None:
        return _write(
            out, place_imported(loaded, lenses), [f"lenses as in {lenses.name}, taken as exact"], []
        )
    views = read_board_views(loaded)
    calibration = calibrate_from(loaded, views)
    placed_here = loaded.T_rig_board is not None
    lengths, doubts = (
        check_scale(loaded, calibration.cameras) if placed_here else ([_NOT_PLACED], [])
    )
    measured = measure_held_out(loaded, views)
    lines = [*report_lines(calibration), *lengths, *held_out_lines(measured, calibration)]
    return _write(out, calibration.cameras, lines, [*views.notes, *doubts, *_doubts(calibration)])


def _write(out: Path, cameras: Cameras, lines: list[str], doubts: list[str]) -> int:
    write_cameras(out, cameras)
    print("\n".join([*lines, *doubts, f"written: {out} and {out.with_suffix('.npz').name}"]))
    return 1 if doubts else 0


def place_imported(session: Session, lenses: Path) -> Cameras:
    """Cameras calibrated elsewhere, placed by the board on the rig; in their own world where there is none. Raises
    BadInput where the file holds none, or the board does not place them."""
    if not lenses.is_file():
        raise BadInput("there is no such file", file=str(lenses))
    try:
        cameras = import_cameras(lenses)
        if session.T_rig_board is None:
            return cameras
        views = {
            name: rig_view(session, name, cameras[name].size_px)
            for name in cameras.names
            if name in session.rig_pictures
        }
        exact = place_on_rig(cameras, views, session.board, session.T_rig_board)
    except Refused as reason:
        raise BadInput(str(reason), file=lenses.name) from None
    board = by_board(
        session.T_rig_board, session.T_rig_board_sigma_mm, session.T_rig_board_sigma_rad
    )
    return move_rig_frame(exact, replace(board, covariance=np.zeros((6, 6))), board)


def calibrate_from(session: Session, views: SessionViews) -> Calibration:
    """The session's cameras from its views, in the rig frame; without T_rig_board in that of the board on the rig, or
    of the first camera where not all see that board. Raises BadInput."""
    missing = [name for name in views.boards if name not in views.rig]
    if missing and session.T_rig_board is not None:
        raise BadInput(
            f"has no picture {missing[0]}.png: record the board standing on the rig",
            file="boards/rig",
        )
    T = board_in_world(session, views)
    try:
        return calibrate_cameras(
            replace(views, rig={}) if missing else views,
            session.board,
            None
            if T is None
            else MeasuredPose(T, session.T_rig_board_sigma_mm, session.T_rig_board_sigma_rad),
            work_points_mm=_work_points(session),
        )
    except Refused as reason:
        raise BadInput(str(reason), file="boards") from None


def board_in_world(session: Session, views: SessionViews) -> np.ndarray | None:
    """Where the board on the rig stands, (3, 4), in the frame that `calibrate_from` gives the cameras in; None where
    not all cameras see it."""
    if session.T_rig_board is not None:
        return session.T_rig_board
    return np.eye(3, 4) if all(name in views.rig for name in views.boards) else None


def _work_points(session: Session) -> np.ndarray | None:
    """The unbent whisker, and bars across it, by the session's own word: where cameras must know their lens."""
    if session.whisker is None or session.T_rig_board is None:
        return None
    along, across = (
        np.linspace(0, session.whisker.length_mm, 21),
        np.array([-_BAR_REACH_MM, 0.0, _BAR_REACH_MM]),
    )
    touched = along[along > _NEAREST_BAR * session.whisker.length_mm]
    bars = [[x, 0.0, z] for x in touched for z in across]
    return np.array([*([x, 0.0, 0.0] for x in along), *bars])


def measure_held_out(session: Session, views: SessionViews) -> HeldOut | None:
    """Cameras from three quarters of the views, measured on the last. None where too few are left.

    Where cameras did not look at the board at once, they see it at once on the rig only: then every other row of the
    rig board's corners places the cameras and the rows between measure them.
    """
    count = max(len(v) for v in views.boards.values())
    is_held = np.arange(count) % HOLD_EVERY == HOLD_EVERY - 1
    kept = views.without(is_held)
    try:
        made = calibrate_from(session, kept)
        if made.together or len(views.boards) < 2:
            return held_out(made, views.boards, is_held, session.board, times_s=views.times_s)
        made = calibrate_from(session, _with_even_rows(kept, session))
    except BadInput:
        return None
    alone = held_out(made, views.boards, is_held, session.board).alone_px
    odd = {name: [_rows(view, session, 1)] for name, view in views.rig.items()}
    on_rig = held_out(made, odd, [True], session.board, together=True)
    return replace(on_rig, alone_px=alone)


def _with_even_rows(views: SessionViews, session: Session) -> SessionViews:
    rig = {name: _rows(view, session, 0) for name, view in views.rig.items()}
    trials = {
        name: [_rows(view, session, 0) for view in many] for name, many in views.trials.items()
    }
    return replace(views, rig=rig, trials=trials)


def _rows(view: Corners, session: Session, parity: int) -> Corners:
    return view.chosen(view.ids // (session.board.squares[0] - 1) % 2 == parity)


def report_lines(calibration: Calibration) -> Iterator[str]:
    """What the calibration rests on, in plain lines."""
    for camera, report in zip(calibration.cameras, calibration.report):
        yield (
            f"camera {camera.name}: {report.views} views, {report.corners} corners ({report.left_out} left out), "
            f"RMS {report.rms_px:.3f} px, of that {report.error_px:.3f} px an axis beyond the corners' own sigma; "
            f"covers {100 * report.coverage:.0f} % of the picture, depth ratio {report.depth_ratio:.2f}, "
            f"tilt up to {report.tilt_deg:.0f} degrees"
        )
        yield "  " + ", ".join(_terms(camera, report))
    yield from calibration.notes


def _terms(camera: Camera, report: CameraReport) -> Iterator[str]:
    for name, value, sigma in zip(LENS_TERMS, camera.lens, report.intrinsics_sigma):
        asked = name[0] not in "kp" or abs(value) > _ASKED_SIGMAS * sigma
        digits = 2 if name[0] in "fc" else 4
        yield f"{name} {value:.{digits}f} ± {sigma:.{digits}f}{'' if asked else ' (not asked for)'}"


def held_out_lines(measured: HeldOut | None, calibration: Calibration) -> Iterator[str]:
    """The held-out figures, in plain lines."""
    if measured is None:
        yield "held out: too few views to spare any (index % 4 == 3)"
        return
    alone = ", ".join(f"{name} {px:.3f} px" for name, px in measured.alone_px.items())
    yield f"held out, views with index % 4 == 3, each camera with its own board pose: {alone}"
    if not measured.corners:
        return
    what = (
        "board views"
        if calibration.together
        else "view of the board on the rig, every other row of corners"
    )
    how = (
        ""
        if measured.offsets is None
        else ", each camera late by its one offset as the other views have it"
    )
    yield f"held out, {measured.views} {what}, one board pose for all cameras{how}: {_agreement(measured.joint)}"
    if measured.instants is not None:
        yield f"  with each picture's own instant fitted besides: {_agreement(measured.instants)}"
        yield f"  with all pictures of a view taken as of one instant: {_agreement(measured.at_once)}"


def _agreement(of: Agreement) -> str:
    pitch = (
        f"RMS {of.pitch_rms_mm:.4f} mm, mean {of.pitch_mean_mm:+.4f} mm over {of.pitches} pitches"
    )
    return f"{of.joint_px:.3f} px joint; distances of neighbouring corners in space less the pitch: {pitch}"


def _doubts(calibration: Calibration) -> Iterator[str]:
    for report in calibration.report:
        share = report.left_out / max(report.corners + report.left_out, 1)
        if share > _MOST_LEFT_OUT:
            yield f"doubtful: camera {report.name} has {100 * share:.0f} % of its corners left out as beyond 4.5 sigma"
