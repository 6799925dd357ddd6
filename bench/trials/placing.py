"""Where the rig is, learnt from the free strokes of the session's own trials and weighed against T_rig_board."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bench.base.doubts import Doubts
from bench.base.errors import BadInput
from bench.base.results import hash_of
from bench.base.workers import Workers
from bench.cameras.first_look import by_first_look, first_look, spread
from bench.cameras.session_cameras import SessionCalibration
from bench.session.session import Session
from bench.trials.consistency import Cause, Difference
from bench.trials.lost import seen_units
from bench.trials.unit import Unit
from vision.calibration.place import (
    Placement,
    by_board,
    check_swing_suffices,
    combine,
    move_rig_frame,
)
from vision.calibration.swing import by_strokes
from vision.geometry.reasons import Reason
from vision.geometry.refusals import Refused
from vision.geometry.rotation import compose, invert_transform

# A step beyond this is taken once more from where it led: lines far from where they were expected are read less well.
_SMALL_STEP = np.repeat([2e-3, 0.2], 3)
_MOST_ROUNDS = 3  # ends before, where a step is small. Set by eye
# A first look finds the centre across the whisker to half a millimetre (docs/cameras.md).
_ELSEWHERE_MM = 2.0
# A T_rig_board known no better is a first guess: the strokes alone must then do.
_BY_RULER_MM = 1.0
_STAYS = (
    "The cameras stay where they were: brought along, or placed by a T_rig_board taken as exact."
)


class _Unread(Refused):
    """No free stroke shows the whisker."""


def place_rig(
    session: Session,
    calibration: SessionCalibration,
    units: Sequence[Unit],
    pool: Workers,
    doubts: Doubts,
) -> SessionCalibration:
    """The calibration with the cameras in the rig frame of board and free strokes together, and notes on both.

    Where T_rig_board is taken as exact, or the cameras were brought along, they stay and only the alarm speaks: a line
    of `doubts`. Raises BadInput where neither tells the rig frame.
    """
    if calibration.cameras is None:
        return calibration
    board, chosen = _before(session), spread([unit for unit in units if unit.trial.camera_sources])
    alone = session.T_rig_board is None and session.cameras_toml is None
    stays = session.cameras_toml is not None or not board.covariance.any()
    try:
        if stays:
            strokes = _by_strokes(chosen, pool, doubts)
            both, placed_here = combine(board, strokes), calibration
            if both.alarm:
                both = replace(both, alarm=both.alarm + _by_scale(session, board, strokes))
        else:
            placed_here, both = _settled(calibration, board, chosen, pool, doubts)
    except Refused as reason:
        if alone:
            asked = "record free strokes of some 10 degrees, or measure T_rig_board"
            raise BadInput(
                f"T_rig_board is missing, and {reason}: {asked}", file="trials"
            ) from None
        if isinstance(reason, _Unread):
            doubts.notes += _elsewhere(session, calibration)
        return calibration.with_notes(f"The free strokes do not tell where the rig is: {reason}")
    if alone or (not stays and session.T_rig_board_sigma_mm >= _BY_RULER_MM):
        _check_suffices(both, doubts)
    if both.alarm and not alone:
        doubts.note(Reason("board_misplaced", both.alarm))
    return placed_here.with_notes(
        *(both.notes[:1] if stays or alone else both.notes), *[_STAYS] * stays
    )


def _by_scale(session: Session, board: Placement, strokes: Placement) -> str:
    """What square_mm would explain that board and strokes disagree; '' where none does.

    Where all lengths are taken f times too long, the centre of rotation is seen f times as far from the board as it
    stands: it is off by (1 − f) of T_rig_board's shift.
    """
    if session.board is None or session.T_rig_board is None:
        return ""
    information = np.linalg.inv(strokes.covariance + board.covariance)
    apart = Difference(strokes.step - board.step, information, len(strokes.step))
    trace, square_mm = np.append(np.zeros(3), -session.T_rig_board[:, 3]), session.board.square_mm

    def said(size: float) -> str:
        return f"; a square_mm of {square_mm / (1.0 + size):.4g} for {square_mm:g} explains it"

    return apart.likeliest([Cause(said, np.zeros(6), trace, 1)], otherwise="")


def _elsewhere(session: Session, calibration: SessionCalibration) -> list[Reason]:
    """A doubt where no stroke can be read and what turns with the motor is not where the board has the whisker."""
    try:
        first = first_look(session, calibration.cameras)
    except BadInput:
        return []
    across_mm = float(np.linalg.norm(invert_transform(first.T_rig_world)[1:, 3]))
    if across_mm < _ELSEWHERE_MM:
        return []
    line = (
        f"no free stroke can be read, and what turns with the motor turns about a centre some {across_mm:.0f} mm from "
        "where T_rig_board has it: measure a square of the board and check square_mm, then check T_rig_board"
    )
    return [Reason("board_misplaced", line)]


def _check_suffices(both: Placement, doubts: Doubts) -> None:
    try:
        doubt = check_swing_suffices(both)
    except Refused as reason:
        raise BadInput(str(reason), file="trials") from None
    if doubt:
        doubts.note(Reason("board_misplaced", doubt))


def _settled(
    calibration: SessionCalibration,
    board: Placement,
    chosen: Sequence[Unit],
    pool: Workers,
    doubts: Doubts,
) -> tuple[SessionCalibration, Placement]:
    """The calibration moved to where board and strokes together have the rig, and that placement.

    The strokes are read by cameras whose uncertainty leaves out T_rig_board's, which is weighed on the other side.
    """
    exact = replace(board, covariance=np.zeros((6, 6)))
    here = _moved(calibration, board, exact)
    for round_number in range(_MOST_ROUNDS):
        units = [replace(unit, calibration=here, stage=f"swing{round_number}") for unit in chosen]
        both = combine(board, _by_strokes(units, pool, doubts))
        if np.all(np.abs(both.step) < _SMALL_STEP):
            break
        here = _moved(here, exact, replace(both, covariance=exact.covariance))
        board, both = replace(board, step=board.step - both.step), replace(both, step=exact.step)
    return _moved(here, exact, both), both


def _moved(
    calibration: SessionCalibration, before: Placement, after: Placement
) -> SessionCalibration:
    cameras = move_rig_frame(calibration.cameras, before, after)
    T_rig_board = calibration.T_rig_board
    if T_rig_board is not None:
        T_rig_board = compose(invert_transform(after.T_board_rig), T_rig_board)
    made = hash_of(
        [[camera, cameras.covariance, cameras.placement] for camera in cameras], calibration.hash
    )
    return replace(calibration, cameras=cameras, T_rig_board=T_rig_board, hash=made)


def _before(session: Session) -> Placement:
    """What is known of the rig frame that the cameras came in."""
    if session.T_rig_board is None and session.cameras_toml is None:
        return by_first_look()
    T = np.eye(3, 4) if session.T_rig_board is None else session.T_rig_board
    return by_board(T, session.T_rig_board_sigma_mm, session.T_rig_board_sigma_rad)


def _by_strokes(units: Sequence[Unit], pool: Workers, doubts: Doubts) -> Placement:
    """What the free strokes of these trials say, of every whisk whose base is seen before touch. Raises Refused."""
    seen = seen_units(units, pool, "free strokes", doubts)
    lines = [whisk.base for trial in seen for whisk in trial.whisks if whisk.base is not None]
    if not lines:
        raise _Unread("none of them can be read")
    return by_strokes(lines)
