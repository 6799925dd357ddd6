"""Every view of the board in a session: held before the cameras, standing on the rig, and in the trials' frames."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.base.errors import BadInput
from bench.base.threads import in_threads
from bench.session.footage import frame_count, read_frames, rig_picture
from bench.session.session import Session
from bench.session.table import forward_in_time, read_table, require_columns
from vision.boards.corners import Corners, find_corners, refine_corners
from vision.boards.diagnosis import why_not_found
from vision.boards.marker_size import check_marker_size
from vision.boards.sufficiency import MIN_VIEWS, fixes_pose
from vision.calibration.views import BoardViews
from vision.geometry.board import Board
from vision.geometry.refusals import Refused
from vision.pictures.frames import Frames

# A series longer than this is sampled in runs of neighbours, which tell how the board moved.
_MOST_FRAMES = 120
_RUN = 3  # pictures: one before and one after tell how the board moved meanwhile
# Beyond so many frames of the trials, the rig board's mean corner gains nothing (0.01 px).
_MOST_TRIAL_FRAMES = 40
# A camera whose rig board stands this far elsewhere in a trial was knocked in between.
_MOVED_PX = 0.5
_SAMPLES = 4  # pictures from which a wrong setting is told


@dataclass(frozen=True, eq=False)
class SessionViews(BoardViews):
    """The views of a session; notes: what was left out and why."""

    notes: tuple[str, ...] = ()


def read_board_views(session: Session) -> SessionViews:
    """Finds the board everywhere. Raises BadInput where it is not found, naming the setting that would find it."""
    if session.board is None:
        raise BadInput(
            "[board] is missing: the cameras are calibrated from it", file="session.toml"
        )
    if not session.board_sources:
        raise BadInput("there is no folder of pictures nor a video of the board", file="boards")
    boards, rig, trials, sizes, notes = {}, {}, {}, {}, []
    for name, source in session.board_sources.items():
        frames = _open(source, name)
        sizes[name] = frames.size_px
        boards[name] = _series(frames, session.board, name)
        if name in session.rig_pictures:
            rig[name] = rig_view(session, name, frames.size_px)
            trials[name], left_out = _trial_views(session, name, rig[name])
            notes += left_out
    return SessionViews(boards, sizes, rig, trials, _times(session, boards), tuple(notes))


def _open(source: Path, name: str) -> Frames:
    try:
        return Frames.open(source)
    except Refused as problem:
        raise BadInput(str(problem), file=f"boards/{name}") from None


def _series(frames: Frames, board: Board, name: str) -> list[Corners]:
    """A view a frame; frames that are not looked at or damaged count as without a board."""
    views, chosen, samples, with_board = [], sampled_frames(frames.count), [], []
    every = max(1, len(chosen) // _SAMPLES)

    def look(frame: tuple[int, np.ndarray | None]):
        index, grey = frame
        return (
            index,
            grey,
            find_corners(grey, board) if grey is not None and index in chosen else Corners.none(),
        )

    for index, grey, view in in_threads(look, frames.read()):
        views.append(view)
        if grey is not None and len(view) == 0 and len(samples) < _SAMPLES and index % every == 0:
            samples.append(grey)
        if len(view) and len(with_board) < _SAMPLES and (not with_board or index % every == 0):
            with_board.append(grey)
    if sum(fixes_pose(view, board) for view in views) < MIN_VIEWS:
        reason = why_not_found(samples, board) if samples else None
        if reason:
            raise BadInput(reason, file=f"boards/{name}")
    try:
        check_marker_size(with_board, board)
    except Refused as problem:
        raise BadInput(str(problem), file=f"boards/{name}") from None
    return views


def sampled_frames(count: int) -> set[int]:
    """Which frames of a series to look at: all of a short one, runs of neighbours spread over a long one."""
    if count <= _MOST_FRAMES:
        return set(range(count))
    firsts = np.linspace(0, count - _RUN, _MOST_FRAMES // _RUN).astype(int)
    return {int(first) + k for first in firsts for k in range(_RUN)}


def rig_view(session: Session, name: str, size_px: tuple[int, int]) -> Corners:
    """Corners of the board on the rig in one camera's picture. Raises BadInput where it is of another size."""
    path = session.rig_pictures[name]
    shown, grey = f"boards/rig/{path.name}", rig_picture(path)
    if grey.shape[::-1] != tuple(size_px):
        found = f"is {grey.shape[1]} x {grey.shape[0]} px"
        raise BadInput(
            f"{found}, boards/{name} is {size_px[0]} x {size_px[1]} px; take both alike", file=shown
        )
    return find_corners(grey, session.board)


def _trial_views(session: Session, name: str, rig_view: Corners) -> tuple[list[Corners], list[str]]:
    """The rig board in frames spread over the trials in which the camera stands as in the rig picture."""
    trials = [trial for trial in session.trials if name in trial.camera_sources]
    if not trials or len(rig_view) == 0:
        return [], []
    each = max(1, _MOST_TRIAL_FRAMES // len(trials))
    kept, notes = [], []
    for trial in trials[:: max(1, len(trials) // _MOST_TRIAL_FRAMES)]:
        views = list(_views_of(trial.camera_sources[name], each, rig_view, session.board))
        shift = np.median([_shift_px(view, rig_view) for view in views]) if views else np.inf
        if shift < _MOVED_PX:
            kept += views
        elif np.isfinite(shift):
            notes.append(
                f"camera {name} stands {shift:.1f} px elsewhere in trial {trial.name} than in boards/rig; "
                "that trial was not used for calibration"
            )
    return kept, notes


def _views_of(source: Path, each: int, rig_view: Corners, board: Board) -> Iterator[Corners]:
    count = frame_count(source)
    chosen = np.unique(np.linspace(0, count - 1, min(each, count)).astype(int)) if count else []
    greys = (
        grey for grey in read_frames(source, (int(k) for k in chosen)).values() if grey is not None
    )
    views = in_threads(lambda grey: refine_corners(grey, rig_view.px, rig_view.ids, board), greys)
    return filter(len, views)


def _shift_px(view: Corners, rig_view: Corners) -> float:
    """Median distance of a view's corners from the rig picture's."""
    place = dict(zip(rig_view.ids.tolist(), rig_view.px))
    return float(
        np.median([np.linalg.norm(px - place[k]) for k, px in zip(view.ids.tolist(), view.px)])
    )


def _times(session: Session, boards: Mapping[str, list[Corners]]) -> dict[str, np.ndarray] | None:
    """boards/frames_<camera>.csv of every camera, or none."""
    files = {name: session.path / "boards" / f"frames_{name}.csv" for name in boards}
    if not all(file.is_file() for file in files.values()):
        return None
    times = {}
    for name, file in files.items():
        shown = f"boards/{file.name}"
        table = read_table(file, shown)
        require_columns(table, ("time_s",), shown)
        times[name] = forward_in_time(table, "time_s", shown)[0]["time_s"]
        if len(times[name]) != len(boards[name]):
            raise BadInput(
                f"has {len(times[name])} rows, boards/{name} has {len(boards[name])} frames",
                file=shown,
            )
    return times
