"""Whether a session's cameras can be calibrated, and what `evaluate` would warn of, in seconds."""

from dataclasses import replace

from bench.base.errors import BadInput
from bench.base.progress import begin_step
from bench.cameras.board_views import ALL_VIEWS, ViewCounts, read_board_views
from bench.cameras.calibrate_session import calibrate_from
from bench.cameras.known_scale import check_scale
from bench.cameras.measured_place import moved_by_file
from bench.session.footage import frame_count
from bench.session.session import Session
from vision.geometry import Reason

# Two cameras of fifteen views take 4 s. Stated.
_SOME_VIEWS = ViewCounts(board_frames=24, trial_frames=8)
_EVERY_BOARD_VIEW = replace(ALL_VIEWS, trial_frames=_SOME_VIEWS.trial_frames)


def check_calibration(session: Session) -> list[Reason]:
    """Return the warnings of a calibration of the session's cameras by pictures of the board.

    A long series is judged by some of its frames; only where they give a warning or a refusal, by all that
    `evaluate` takes. Raises BadInput where the cameras cannot be calibrated.
    """
    if _has_long_series(session):
        try:
            if not _warnings(session, _SOME_VIEWS):
                return []
        except BadInput:
            begin_step("the same by more pictures")
    return _warnings(session, _EVERY_BOARD_VIEW)


def _has_long_series(session: Session) -> bool:
    """Return whether a camera has more pictures of the board than are taken at first."""
    most = _SOME_VIEWS.board_frames
    return any(frame_count(source) > most for source in session.board_sources.values())


def _warnings(session: Session, counts: ViewCounts) -> list[Reason]:
    """Return the warnings of a calibration by so many views, and of the bars' widths by its cameras.

    Widths need cameras in the rig frame.
    """
    begin_step("cameras from pictures of the board")
    made = calibrate_from(session, read_board_views(session, counts))
    warnings = list(made.warnings)
    if session.T_rig_board is not None or session.measured_rig is not None:
        begin_step("widths of bars")
        warnings += check_scale(session, moved_by_file(session, made.cameras))[1]
    return warnings
