"""Whether a session's cameras can be calibrated, and what `evaluate` would warn of, in seconds."""

from bench.base.errors import BadInput
from bench.base.progress import begin_step
from bench.cameras.board_views import ALL_VIEWS, ViewCounts, read_board_views
from bench.cameras.calibrate_session import calibrate_from
from bench.cameras.known_scale import check_scale
from bench.cameras.measured_place import moved_by_file
from bench.session.session import Session
from vision.geometry import Reason

# Two cameras of fifteen views take 4 s. Stated.
_SOME_VIEWS = ViewCounts(board_frames=24, trial_frames=8)


def check_calibration(session: Session) -> list[Reason]:
    """Return the warnings of a calibration of the session's cameras by pictures of the board.

    Some of the pictures serve where these give no warning and no refusal, else all that `evaluate` takes. Raises
    BadInput where the cameras cannot be calibrated.
    """
    try:
        if not _warnings(session, _SOME_VIEWS):
            return []
    except BadInput:
        pass
    begin_step("what they seem to have wrong, by all pictures")
    return _warnings(session, ALL_VIEWS)


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
