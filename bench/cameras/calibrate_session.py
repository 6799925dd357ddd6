"""`whisker-bench calibrate cameras`: cameras.toml from a session's board views, and how far to trust it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from bench.base.atomic import write_whole
from bench.base.errors import BadInput
from bench.base.exit_codes import print_written
from bench.base.input_problems import refused_as_bad_input, require_cameras
from bench.cameras.board_views import SessionViews, read_board_views, rig_view
from bench.cameras.cameras_toml import write_cameras
from bench.cameras.known_scale import check_scale
from bench.cameras.measured_place import moved_by_file, stated_place
from bench.session.session import Session, load_session
from vision.boards import Corners
from vision.calibration import (
    WRITERS,
    Agreement,
    Calibration,
    CameraReport,
    HeldOut,
    MeasuredPose,
    are_placed,
    calibrate_cameras,
    check_held_out,
    import_cameras,
    move_rig_frame,
    place_on_rig,
)
from vision.geometry import LENS_TERMS, Camera, Cameras

# [views] Every fourth one (index % 4 == 3) measures a calibration from the other three quarters. Stated.
HOLD_EVERY = 4
# [sigma] A distortion term so far from zero is one that the views need. Stated.
_NEEDED_SIGMAS = 2.0
# [1] Of a camera's corners. Noise puts 7 in a million beyond 4.5 sigma: a tenth is something else. Stated.
_MOST_LEFT_OUT = 0.1
# [1] Of the whisker's length: bars stand beyond. Stated.
_NEAREST_BAR = 0.4
# [mm] A bar is seen by so much on either side of the whisker.
_BAR_REACH_MM = 20.0
_NOT_PLACED = (
    "neither T_rig_board nor rig.toml says where the rig is: the cameras stand in the frame of {frame}, and beside "
    "session.toml they would be taken for cameras in the rig frame; `evaluate` without a cameras.toml finds the rig by the free "
    "strokes, `whisker-bench calibrate rig` measures it"
)


def calibrate_cameras_command(
    session: Path,
    out: Path,
    lenses: Path | None = None,
    *,
    names: Sequence[str] = (),
    file_format: str = "",
    follow_links: bool = False,
) -> int:
    """Calibrate, write `out` (TOML) and its .npz, print the report.

    lenses: a camera file of another program, or a folder of them, to take the lenses from; the
    session then only places the cameras. names: the session's of that file's cameras, in its order,
    where it calls them otherwise. file_format: another program's, of `WRITERS`, to write in place of
    ours. Returns 0, or 1 with warnings. Raises BadInput or Refused, saying what to record, before
    anything is written.
    """
    loaded = load_session(session, lenses_known=lenses is not None, follow_links=follow_links)
    file = _CameraFile(out, loaded, file_format)
    if lenses is None:
        return file.write(_calibrate_by_boards(file))
    cameras = place_imported(loaded, lenses, names)
    file.lines.append(f"lenses of {', '.join(cameras.names)} as in {lenses.name}, taken as exact")
    if not loaded.is_rig_placed:
        file.say_not_placed(lenses.name)
    return file.write(cameras)


@dataclass(frozen=True)
class _CameraFile:
    """A session's camera file before it is written, and what is printed with it.

    file_format: another program's, '' for ours.
    """

    out: Path
    session: Session
    file_format: str
    lines: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def say_not_placed(self, frame: str) -> None:
        """Add a line on cameras that are in another frame than the rig's.

        It is a warning where they are written into the session. Files of other programs may have any frame.
        """
        if self.file_format:
            return
        line = _NOT_PLACED.format(frame=frame)
        is_of_session = self.out.resolve() == (self.session.path / "cameras.toml").resolve()
        (self.warnings if is_of_session else self.lines).append(line)

    def write(self, cameras: Cameras) -> int:
        """Write the cameras and print the lines. Return 0, or 1 with warnings."""
        if self.file_format:
            with refused_as_bad_input(f"--format {self.file_format}"):
                files = WRITERS[self.file_format](cameras, self.out.stem)
            for name, content in files.items():
                write_whole(self.out.parent / name, content)
            written = f", without uncertainties: {', '.join(files)} in {self.out.parent}"
        else:
            write_cameras(self.out, cameras, self.session.crops)
            written = f": {self.out} and {self.out.with_suffix('.npz').name}"
        return print_written(self.lines, self.warnings, written)


def _calibrate_by_boards(file: _CameraFile) -> Cameras:
    """Return the cameras by the session's board views; add to the file's lines what they rest on."""
    session = file.session
    views = read_board_views(session)
    calibration = calibrate_from(session, views)
    cameras = moved_by_file(session, calibration.cameras)
    file.lines.extend(report_lines(calibration))
    file.warnings.extend([*views.notes, *calibration.warnings])
    if session.is_rig_placed:
        lengths, of_scale = check_scale(session, cameras)
        file.lines.extend(lengths)
        file.warnings.extend(of_scale)
    elif _all_see_rig_board(views):
        file.say_not_placed("the board on the rig")
    else:
        file.say_not_placed(f"camera {cameras.names[0]}")
    file.lines.extend(held_out_lines(measure_held_out(session, views), calibration))
    file.warnings.extend(_corner_warnings(calibration))
    return cameras


def place_imported(session: Session, lenses: Path, names: Sequence[str] = ()) -> Cameras:
    """Return the session's cameras as calibrated elsewhere, placed by the board on the rig.

    names: the session's of the file's cameras, in its order, where it calls them otherwise. They are in their own
    world where there is no board. Raises BadInput where the file does not hold the session's cameras, or the
    board does not place them.
    """
    if not lenses.exists():
        raise BadInput("there is no such file", file=str(lenses))
    with refused_as_bad_input(lenses.name):
        cameras = _of_session(import_cameras(lenses), session, names, lenses.name)
        if not session.is_rig_placed:
            if not are_placed(cameras):
                found = "does not state where the cameras stand to each other"
                raise BadInput(f"{found}; [rig] T_rig_board places them", file=lenses.name)
            return cameras
        views = {}
        for name in cameras.names:
            if name in session.rig_pictures:
                views[name] = rig_view(session, name, cameras[name].size_px)
        stated = session.T_rig_board
        T_world_board = np.eye(3, 4) if stated is None else stated
        placed = place_on_rig(cameras, views, session.board, T_world_board)
    if stated is not None:
        board = stated_place(session)
        placed = move_rig_frame(placed, replace(board, covariance=np.zeros((6, 6))), board)
    return moved_by_file(session, placed)


def _of_session(cameras: Cameras, session: Session, names: Sequence[str], file: str) -> Cameras:
    """Return the cameras of a file that are the session's. Raises BadInput where it lacks one.

    names: the session's of the file's cameras, in its order; none where they are alike.
    """
    if names:
        if len(names) != len(cameras.names) or len(set(names)) != len(names):
            found = f"holds {len(cameras.names)} cameras ({', '.join(cameras.names)})"
            raise BadInput(f"{found}; --names takes as many, each once", file=file)
        cameras = Cameras(tuple(replace(camera, name=name) for camera, name in zip(cameras, names)))
    wanted = session.camera_names or tuple(session.rig_pictures)
    cure = "; give the session's names for these, in this order: --names …"
    require_cameras(cameras, wanted, file, cure)
    return cameras.subset(wanted) if wanted else cameras


def calibrate_from(session: Session, views: SessionViews) -> Calibration:
    """Calibrate the session's cameras from its views, in the rig frame. Raises BadInput.

    Without T_rig_board the frame is that of the board on the rig, or of the first camera where not
    all see that board.
    """
    missing = [name for name in views.boards if name not in views.rig]
    if missing and session.T_rig_board is not None:
        found = f"there is no picture of the board on the rig by camera {missing[0]}"
        raise BadInput(found, file=f"boards/rig/{missing[0]}")
    board_pose = None
    T_world_board = board_in_world(session, views)
    if T_world_board is not None:
        board_pose = MeasuredPose(
            T_world_board, session.T_rig_board_sigma_mm, session.T_rig_board_sigma_rad
        )
    with refused_as_bad_input("boards"):
        return calibrate_cameras(
            replace(views, rig={}) if missing else views,
            session.board,
            board_pose,
            work_points_mm=_work_points(session),
        )


def board_in_world(session: Session, views: SessionViews) -> np.ndarray | None:
    """Return the pose (3, 4) of the board on the rig, in the frame of `calibrate_from`'s cameras.

    None where not all cameras see it.
    """
    if session.T_rig_board is not None:
        return session.T_rig_board
    return np.eye(3, 4) if _all_see_rig_board(views) else None


def _all_see_rig_board(views: SessionViews) -> bool:
    """Return whether all cameras see the board on the rig."""
    return all(name in views.rig for name in views.boards)


def _work_points(session: Session) -> np.ndarray | None:
    """Return points (n, 3) where cameras must know their lens: the unbent whisker, and bars across it.

    None where the session does not state whisker or rig.
    """
    if session.whisker is None or session.T_rig_board is None:
        return None
    x = np.linspace(0, session.whisker.length_mm, 21)
    z = np.array([-_BAR_REACH_MM, 0.0, _BAR_REACH_MM])
    wire = np.column_stack([x, np.zeros((len(x), 2))])
    bar_x, bar_z = np.meshgrid(x[x > _NEAREST_BAR * session.whisker.length_mm], z, indexing="ij")
    bars = np.stack([bar_x, np.zeros_like(bar_x), bar_z], axis=-1)
    return np.concatenate([wire, bars.reshape(-1, 3)])


def measure_held_out(session: Session, views: SessionViews) -> HeldOut | None:
    """Measure cameras from three quarters of the views on the last. None where too few are left.

    Where the cameras did not record the board at once, they see it at once on the rig only: then
    every other row of the rig board's corners places the cameras and the rows between measure them.
    """
    count = max(len(v) for v in views.boards.values())
    is_held = np.arange(count) % HOLD_EVERY == HOLD_EVERY - 1
    kept = views.without(is_held)
    try:
        made = calibrate_from(session, kept)
        if made.together or len(views.boards) < 2:
            return check_held_out(made, views.boards, is_held, times_s=views.times_s)
        made = calibrate_from(session, _with_even_rows(kept, session))
    except BadInput:
        return None
    alone = check_held_out(made, views.boards, is_held).alone_px
    odd = {name: [_rows(view, session, 1)] for name, view in views.rig.items()}
    on_rig = check_held_out(made, odd, [True], together=True)
    return replace(on_rig, alone_px=alone)


def _with_even_rows(views: SessionViews, session: Session) -> SessionViews:
    """Return the views with every other row of the rig board's corners."""
    rig = {name: _rows(view, session, 0) for name, view in views.rig.items()}
    trials = {}
    for name, of_camera in views.trials.items():
        trials[name] = [_rows(view, session, 0) for view in of_camera]
    return replace(views, rig=rig, trials=trials)


def _rows(view: Corners, session: Session, parity: int) -> Corners:
    """Return the corners in even (0) or odd (1) rows of the board."""
    return view.select(view.ids // session.board.grid[0] % 2 == parity)


def report_lines(calibration: Calibration) -> Iterator[str]:
    """Yield plain lines on what the calibration rests on."""
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
    """Yield each term of a lens with its sigma."""
    for name, value, sigma in zip(LENS_TERMS, camera.lens, report.intrinsics_sigma):
        is_distortion = name[0] in "kp"
        is_needed = not is_distortion or abs(value) > _NEEDED_SIGMAS * sigma
        digits = 2 if name[0] in "fc" else 4
        remark = "" if is_needed else " (not needed)"
        yield f"{name} {value:.{digits}f} ± {sigma:.{digits}f}{remark}"


def held_out_lines(measured: HeldOut | None, calibration: Calibration) -> Iterator[str]:
    """Yield plain lines on the held-out views."""
    if measured is None:
        yield "held out: too few views to spare any (index % 4 == 3)"
        return
    alone = ", ".join(f"{name} {px:.3f} px" for name, px in measured.alone_px.items())
    yield f"held out, views with index % 4 == 3, each camera with its own board pose: {alone}"
    if not measured.corners:
        return
    views = "view of the board on the rig, every other row of corners"
    if calibration.together:
        views = "board views"
    late = ", each camera late by its one offset as the other views have it"
    how = "" if measured.offsets is None else late
    joint = _agreement(measured.joint)
    yield f"held out, {measured.views} {views}, one board pose for all cameras{how}: {joint}"
    if measured.instants is not None:
        yield f"  with each picture's own instant fitted besides: {_agreement(measured.instants)}"
        yield f"  with all pictures of a view taken as of one instant: {_agreement(measured.at_once)}"


def _agreement(of: Agreement) -> str:
    """Return in words how held-out corners agree."""
    rms = f"RMS {of.pitch_rms_mm:.4f} mm, mean {of.pitch_mean_mm:+.4f} mm over {of.pitches} pitches"
    what = "distances of neighbouring corners in space less the pitch"
    return f"{of.joint_px:.3f} px joint; {what}: {rms}"


def _corner_warnings(calibration: Calibration) -> Iterator[str]:
    """Yield a line on each camera of which many corners were left out."""
    for report in calibration.report:
        share = report.left_out / max(report.corners + report.left_out, 1)
        if share > _MOST_LEFT_OUT:
            percent = f"{100 * share:.0f} % of its corners left out as beyond 4.5 sigma"
            yield f"camera {report.name} has {percent}"
