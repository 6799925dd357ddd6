"""Every view of the board in a session: held before the cameras, standing on the rig, and in the trials' frames."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from bench.base.errors import BadInput
from bench.base.input_problems import refused_as_bad_input
from bench.base.progress import count_parts
from bench.base.threads import in_threads
from bench.session.file_names import SESSION_TOML
from bench.session.footage import frame_count, read_frames, rig_picture
from bench.session.session import Session
from bench.session.table import forward_in_time, read_table, require_columns
from vision.boards import MIN_VIEWS, Corners, find_corners, fixes_pose, refine_corners
from vision.calibration import BoardViews, with_turns_resolved
from vision.geometry import Board
from vision.pictures import Frames

# [pictures] One before and one after determine how the board moved meanwhile.
_RUN = 3
# [px] A camera whose rig board stands this far elsewhere in a trial was knocked in between.
_MOVED_PX = 0.5
# [pictures] Of a camera, most that are searched for the board held before it. A longer series is sampled.
_MOST_OF_BOARD = 120
# [frames] Of a camera's trials, most in which the rig board is measured: more change its mean corner by less
# than 0.01 px.
_MOST_OF_TRIALS = 40
# [pictures] From which a wrong setting is diagnosed.
_SAMPLES = 4


@dataclass(frozen=True, eq=False)
class SessionViews(BoardViews):
    """The views of a session; notes: what was left out and why."""

    notes: tuple[str, ...] = ()


def read_board_views(session: Session) -> SessionViews:
    """Find the board everywhere.

    Raises BadInput where it is not found, naming the setting that would find it.
    """
    _require_board(session)
    boards = {}
    rig = {}
    trials = {}
    sizes_px = {}
    notes: list[str] = []
    for name, source in session.board_sources.items():
        with refused_as_bad_input(f"boards/{source.name}"):
            frames = Frames.open(source)
        sizes_px[name] = frames.size_px
        place = session.board_place(name)
        boards[name] = _series(frames, session.board, place, session.mirrored(name))
        if name in session.rig_pictures:
            rig[name] = rig_view(session, name, frames.size_px)
            trials[name], left_out = _trial_views(session, name, rig[name])
            notes += left_out
    if not session.is_rig_placed and not any(map(len, rig.values())):
        rig, trials = {}, {}  # pictures of the rig without a board: backgrounds alone
    found = SessionViews(
        boards,
        sizes_px,
        rig,
        trials,
        _times(session, boards),
        session.crops,
        session.pixel_aspects,
        tuple(notes),
    )
    with refused_as_bad_input("boards"):
        return with_turns_resolved(found, session.board)


def _require_board(session: Session) -> None:
    """Raise BadInput where the session states no board, or has no picture of it."""
    if session.board is None:
        found = "[board] is missing: the cameras are calibrated from it"
        raise BadInput(found, file=SESSION_TOML)
    if not session.board_sources:
        raise BadInput("there is no folder of pictures nor a video of the board", file="boards")


@dataclass
class _Samples:
    """Some grey pictures of a series, with and without a board; of every so many frames one."""

    every: int
    with_board: list[np.ndarray] = field(default_factory=list)
    without_board: list[np.ndarray] = field(default_factory=list)

    def add(self, index: int, grey: np.ndarray | None, view: Corners) -> None:
        """Keep a frame if it is one of the samples; the first with a board is kept in any case."""
        is_sample = grey is not None and index % self.every == 0
        if len(view):
            if len(self.with_board) < _SAMPLES and (is_sample or not self.with_board):
                self.with_board.append(grey)
        elif is_sample and len(self.without_board) < _SAMPLES:
            self.without_board.append(grey)


def _series(frames: Frames, board: Board, place: str, mirrored: bool) -> list[Corners]:
    """Return a view a frame; frames that are not sampled or damaged count as without a board.

    place: how messages name them. mirrored: whether they are flipped left to right.
    """
    views = []
    chosen = sampled_frames(frames.count)
    samples = _Samples(every=max(1, len(chosen) // _SAMPLES))
    searched = in_threads(partial(_find_in_chosen, chosen, board), frames.read())
    for index, grey, view in count_parts(searched, f"pictures in {place}", frames.count):
        views.append(view)
        samples.add(index, grey, view)
    if sum(fixes_pose(view, board) for view in views) < MIN_VIEWS:
        _require_no_reason(samples.without_board, board, place, mirrored)
    with refused_as_bad_input(place):
        board.check_print(samples.with_board)
    return views


def _find_in_chosen(
    chosen: Collection[int], board: Board, frame: tuple[int, np.ndarray | None]
) -> tuple[int, np.ndarray | None, Corners]:
    """Return a frame, its number and picture, with its view of the board, none unless it is chosen."""
    index, grey = frame
    if grey is None or index not in chosen:
        return index, grey, Corners.none()
    return index, grey, find_corners(grey, board)


def _require_no_reason(
    greys: Sequence[np.ndarray], board: Board, place: str, mirrored: bool
) -> None:
    """Raise BadInput where grey pictures show another board than the stated one."""
    reason = board.why_not_found(greys, mirrored=mirrored) if greys else ""
    if reason:
        raise BadInput(reason, file=place)


def sampled_frames(count: int) -> set[int]:
    """Return the frames of a series to search for the board.

    All of a short one; of a long one runs of neighbours, which determine how the board moved.
    """
    if count <= _MOST_OF_BOARD:
        return set(range(count))
    firsts = np.linspace(0, count - _RUN, _MOST_OF_BOARD // _RUN).astype(int)
    return set((firsts[:, None] + np.arange(_RUN)).ravel().tolist())


def rig_view(session: Session, name: str, size_px: tuple[int, int]) -> Corners:
    """Find the corners of the board on the rig in one camera's picture.

    Raises BadInput where it is of another size.
    """
    path = session.rig_pictures[name]
    grey = rig_picture(path)
    height, width = grey.shape
    if (width, height) != tuple(size_px):
        board_px = f"boards/{name} is {size_px[0]} x {size_px[1]} px"
        found = f"is {width} x {height} px, {board_px}; take both alike"
        raise BadInput(found, file=f"boards/rig/{path.name}")
    return find_corners(grey, session.board)


def _trial_views(session: Session, name: str, rig_view: Corners) -> tuple[list[Corners], list[str]]:
    """Find the rig board in some frames spread over the trials; return its views, and notes.

    Trials in which the camera stands elsewhere than in the rig picture are left out, with a note.
    """
    kept: list[Corners] = []
    notes: list[str] = []
    trials = [trial for trial in session.trials if name in trial.camera_sources]
    if not trials or len(rig_view) == 0:
        return kept, notes
    frames_of_each = max(1, _MOST_OF_TRIALS // len(trials))
    chosen = trials[:: max(1, len(trials) // _MOST_OF_TRIALS)]
    for trial in count_parts(chosen, f"trials of camera {name} with the board", len(chosen)):
        source = trial.camera_sources[name]
        views = list(_views_of(source, frames_of_each, rig_view, session.board))
        shift_px = _median_shift_px(views, rig_view)
        if shift_px < _MOVED_PX:
            kept += views
        elif np.isfinite(shift_px):
            notes.append(_moved_note(name, shift_px, trial.name))
    return kept, notes


def _moved_note(camera: str, shift_px: float, trial: str) -> str:
    """Return the note on a trial that was recorded with a camera moved."""
    where = f"stands {shift_px:.1f} px elsewhere in trial {trial} than in boards/rig"
    return f"camera {camera} {where}; that trial was not used for calibration"


def _views_of(source: Path, most: int, rig_view: Corners, board: Board) -> Iterator[Corners]:
    """Refine the rig board's corners in some frames of a source; frames without any are left out."""
    count = frame_count(source)
    if not count:
        return
    # Cut off, not rounded as `spread` does: the cameras of sessions evaluated before stay what they are.
    chosen = np.unique(np.linspace(0, count - 1, min(most, count)).astype(int)).tolist()
    read = read_frames(source, chosen)
    greys = (grey for grey in read.values() if grey is not None)
    views = in_threads(lambda grey: refine_corners(grey, rig_view.px, rig_view.ids, board), greys)
    yield from filter(len, views)


def _median_shift_px(views: Sequence[Corners], rig_view: Corners) -> float:
    """Return the median distance of the views' corners from the rig picture's; NaN without a view."""
    shifts_px = []
    for view in views:
        _, here, there = np.intersect1d(view.ids, rig_view.ids, return_indices=True)
        distances_px = np.linalg.norm(view.px[here] - rig_view.px[there], axis=1)
        shifts_px.append(np.median(distances_px))
    return float(np.median(shifts_px)) if shifts_px else np.nan


def _times(session: Session, boards: Mapping[str, list[Corners]]) -> dict[str, np.ndarray] | None:
    """Read boards/frames_<camera>.csv of every camera; None where one has none."""
    files = {}
    for name in boards:
        crop = session.crops.get(name)
        file = f"frames_{name if crop is None else crop.of}.csv"
        files[name] = session.path / "boards" / file
    if not all(file.is_file() for file in files.values()):
        return None
    times = {}
    for name, views in boards.items():
        file = files[name]
        label = f"boards/{file.name}"
        table = read_table(file, label)
        require_columns(table, ("time_s",), label)
        table, _ = forward_in_time(table, "time_s", label)
        if len(table) != len(views):
            found = f"has {len(table)} rows, boards/{name} has {len(views)} frames"
            raise BadInput(found, file=label)
        times[name] = table["time_s"]
    return times
