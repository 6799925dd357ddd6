"""Where the rig is, learnt from the free strokes of the session's own trials and weighed against T_rig_board."""

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from bench.calibration import SessionCalibration
from bench.doubts import Doubts
from bench.errors import BadInput
from bench.results import hash_of
from bench.session import Session
from bench.unit import Unit, see_unit
from bench.workers import Workers
from vision.errors import Refused
from vision.place import BaseLines, Placement, by_board, by_strokes, check_swing_suffices, combine, placed
from vision.rotation import compose, invert_transform

# Strokes beyond these say little more: what they share (light, lenses) no average makes smaller.
_MOST_TRIALS = 6
# A step beyond this is taken once more from where it led: lines far from where they were expected are read less well.
_SMALL_STEP = np.repeat([2e-3, 0.2], 3)
_MOST_ROUNDS = 3
# A T_rig_board known no better is a first guess: the strokes alone must then do.
_BY_RULER_MM = 1.0
_STAYS = "The cameras stay where they were: brought along, or placed by a T_rig_board taken as exact."


def place_rig(
    session: Session, calibration: SessionCalibration, units: Sequence[Unit], pool: Workers, doubts: Doubts
) -> SessionCalibration:
    """The calibration with the cameras in the rig frame of board and free strokes together, and notes on both.

    Where T_rig_board is taken as exact, or the cameras were brought along, they stay and only the alarm speaks: a line
    of `doubts`.
    """
    if calibration.cameras is None:
        return calibration
    board, chosen = _by_board(session), _chosen(units)
    stays = session.cameras_toml is not None or not board.covariance.any()
    try:
        if stays:
            both = combine(board, _by_strokes(chosen, pool))
            placed_here = calibration
        else:
            placed_here, both = _settled(calibration, board, chosen, pool)
    except Refused as reason:
        return calibration.with_notes(f"The free strokes do not tell where the rig is: {reason}")
    if not stays and session.T_rig_board_sigma_mm >= _BY_RULER_MM:
        _check_suffices(both)
    if both.alarm:
        doubts.note(both.alarm)
    return placed_here.with_notes(*(both.notes[:1] if stays else both.notes), *[_STAYS] * stays)


def _check_suffices(both: Placement) -> None:
    try:
        check_swing_suffices(both)
    except Refused as reason:
        raise BadInput(str(reason), file="trials") from None


def _settled(calibration: SessionCalibration, board: Placement, chosen: Sequence[Unit], pool: Workers):
    """The calibration moved to where board and strokes together have the rig, and that placement.

    The strokes are read by cameras whose uncertainty leaves out T_rig_board's, which is weighed on the other side.
    """
    exact = replace(board, covariance=np.zeros((6, 6)))
    here = _moved(calibration, board, exact)
    for round_number in range(_MOST_ROUNDS):
        units = [replace(unit, calibration=here, stage=f"swing{round_number}") for unit in chosen]
        both = combine(board, _by_strokes(units, pool))
        if np.all(np.abs(both.step) < _SMALL_STEP):
            break
        here = _moved(here, exact, replace(both, covariance=exact.covariance))
        board, both = replace(board, step=board.step - both.step), replace(both, step=exact.step)
    return _moved(here, exact, both), both


def _moved(calibration: SessionCalibration, before: Placement, after: Placement) -> SessionCalibration:
    cameras = placed(calibration.cameras, before, after)
    T_rig_board = compose(invert_transform(after.T_board_rig), calibration.T_rig_board)
    made = hash_of([[camera, cameras.covariance, cameras.placement] for camera in cameras], calibration.hash)
    return replace(calibration, cameras=cameras, T_rig_board=T_rig_board, hash=made)


def _by_board(session: Session) -> Placement:
    T = np.eye(3, 4) if session.T_rig_board is None else session.T_rig_board
    return by_board(T, session.T_rig_board_sigma_mm, session.T_rig_board_sigma_rad)


def _chosen(units: Sequence[Unit]) -> list[Unit]:
    """A few of the trials with pictures, spread over the session."""
    seen = [unit for unit in units if unit.trial.camera_sources]
    return [seen[k] for k in np.unique(np.linspace(0, len(seen) - 1, _MOST_TRIALS).astype(int))] if seen else []


def _by_strokes(units: Sequence[Unit], pool: Workers) -> Placement:
    """What the free strokes of these trials say, of every whisk whose base is seen before touch."""
    pool.run(see_unit, units, "free strokes")
    bases = [whisk["base"] for unit in units for whisk in see_unit(unit)["whisks"] if whisk.get("base")]
    return by_strokes([BaseLines(*(np.array(base[field.name]) for field in fields(BaseLines))) for base in bases])
