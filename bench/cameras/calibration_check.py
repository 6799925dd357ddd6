"""Whether a session's cameras can be calibrated, and what `evaluate` would warn of."""

from bench.base.progress import begin_step
from bench.cameras.board_views import read_board_views
from bench.cameras.calibrate_session import calibrate_from
from bench.cameras.known_scale import check_scale
from bench.cameras.measured_place import moved_by_file
from bench.session.session import Session
from vision.geometry import Reason


def check_calibration(session: Session) -> list[Reason]:
    """Return the warnings of a calibration of the session's cameras by pictures of the board.

    Bars' widths are compared where the cameras stand in the rig frame. Raises BadInput where the
    cameras cannot be calibrated.
    """
    begin_step("cameras from pictures of the board")
    made = calibrate_from(session, read_board_views(session))
    warnings = list(made.warnings)
    if session.is_rig_placed:
        begin_step("widths of bars")
        _, of_scale = check_scale(session, moved_by_file(session, made.cameras))
        warnings += of_scale
    return warnings
