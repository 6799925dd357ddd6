"""Where the rig is, learnt from the free strokes of the session's own trials and weighed against T_rig_board."""

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from bench.calibration import SessionCalibration
from bench.doubts import Doubts
from bench.results import hash_of
from bench.session import Session
from bench.unit import Unit, see_unit
from bench.workers import Workers
from vision.errors import Refused
from vision.place import BaseLines, Placement, by_board, by_strokes, combine, placed

# Strokes beyond these say little more: what they share (light, lenses) no average makes smaller.
_MOST_TRIALS = 6
_STAGE = "swing"
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
    board = _by_board(session)
    stays = session.cameras_toml is not None or not board.covariance.any()
    chosen = _chosen(units) if stays else [replace(unit, stage=_STAGE) for unit in _chosen(units)]
    pool.run(see_unit, chosen, "free strokes")
    try:
        swing = by_strokes(_base_lines(see_unit(unit) for unit in chosen))
    except Refused as reason:
        return calibration.with_notes(f"The free strokes do not tell where the rig is: {reason}")
    # The cameras' uncertainty, T_rig_board's in it, is in the swing too: it counts for less than it could.
    both = combine(board, swing)
    if both.alarm:
        doubts.note(both.alarm)
    if stays:
        return calibration.with_notes(*swing.notes, _STAYS)
    cameras = placed(calibration.cameras, board, both)
    made = hash_of([[camera, cameras.covariance] for camera in cameras], calibration.hash)
    return replace(calibration, cameras=cameras, hash=made).with_notes(*both.notes)


def _by_board(session: Session) -> Placement:
    T = np.eye(3, 4) if session.T_rig_board is None else session.T_rig_board
    return by_board(T, session.T_rig_board_sigma_mm, session.T_rig_board_sigma_rad)


def _chosen(units: Sequence[Unit]) -> list[Unit]:
    """A few of the trials with pictures, spread over the session."""
    seen = [unit for unit in units if unit.trial.camera_sources]
    return [seen[k] for k in np.unique(np.linspace(0, len(seen) - 1, _MOST_TRIALS).astype(int))] if seen else []


def _base_lines(seen) -> list[BaseLines]:
    """Of every whisk whose base is seen before touch."""
    found = [whisk["base"] for trial in seen for whisk in trial["whisks"] if whisk.get("base")]
    return [BaseLines(*(np.array(base[field.name]) for field in fields(BaseLines))) for base in found]
