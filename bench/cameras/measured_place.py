"""The place of the rig by rig.toml and by session.toml: each with its sigma, and whether they agree."""

from dataclasses import replace

import numpy as np

from bench.base.statuses import reason
from bench.session.rig_file import RIG_FILE
from bench.session.session import Session
from vision.calibration import Placement, by_board, combine, move_rig_frame
from vision.geometry import Cameras, Reason, compose, invert_transform


def measured_place(session: Session, T_board: np.ndarray) -> Placement:
    """Return the placement by rig.toml, in the frame in which the board's pose is T_board (3, 4)."""
    measured = session.measured_rig
    T_board_rig = compose(T_board, invert_transform(measured.T_rig_board))
    turn = np.kron(np.eye(2), T_board_rig[:, :3])
    placement = Placement.of(T_board_rig, turn @ measured.covariance @ turn.T)
    note = f"{RIG_FILE}, by {measured.source}: {_in_own_frame(session).spread}."
    return replace(placement, source=RIG_FILE, notes=(note,))


def stated_place(session: Session) -> Placement:
    """Return the placement by session.toml's T_rig_board."""
    return replace(by_board_of(session, session.T_rig_board), source="T_rig_board")


def by_board_of(session: Session, T_rig_board: np.ndarray) -> Placement:
    """Return the placement by a pose (3, 4) of the board, with the sigmas that the session states."""
    square_sigma = 0.0
    if session.board is not None:
        square_sigma = session.board.square_sigma_mm / session.board.square_mm
    return by_board(
        T_rig_board, session.T_rig_board_sigma_mm, session.T_rig_board_sigma_rad, square_sigma
    )


def both_places(session: Session) -> Placement:
    """Return the placement by session.toml and rig.toml together, in the frame of the first."""
    return combine(stated_place(session), measured_place(session, session.T_rig_board))


def moved_by_file(session: Session, cameras: Cameras) -> Cameras:
    """Return cameras in the frame that session.toml gives moved to that of rig.toml, or of both together.

    Without T_rig_board their frame is the board's. They stay without rig.toml, and where T_rig_board is
    taken as exact.
    """
    if session.measured_rig is None:
        return cameras
    if session.T_rig_board is None:
        exact = Placement(np.zeros(6), np.zeros((6, 6)))
        return move_rig_frame(cameras, exact, measured_place(session, np.eye(3, 4)))
    stated = stated_place(session)
    if not stated.covariance.any():
        return cameras
    return move_rig_frame(cameras, stated, both_places(session))


def contradiction(session: Session) -> Reason | None:
    """Return the warning on a T_rig_board that contradicts rig.toml; None where there are not both,
    or chance explains it.
    """
    if session.T_rig_board is None or session.measured_rig is None:
        return None
    alarm = both_places(session).alarm
    if alarm is None:
        return None
    return reason("rig_file_contradicts", alarm=alarm, counts=_what_counts(session))


def place_line(session: Session) -> str:
    """Return a sentence on what places the rig, and how well."""
    if session.cameras_toml is not None:
        unused = f"; {RIG_FILE} is not used" if (session.path / RIG_FILE).is_file() else ""
        return f"the cameras stand where cameras.toml has them{unused}"
    measured = session.measured_rig
    if not session.is_rig_placed:
        by_strokes = "the free strokes place the rig when the session is evaluated"
        if not session.rig_pictures:
            return by_strokes
        return f"{by_strokes}; `whisker-bench calibrate rig` measures it, by a marker on the hub, too, and says how well"
    if session.T_rig_board is None:
        return f"placed by {RIG_FILE} ({measured.source}): {_in_own_frame(session).spread}"
    if measured is not None:
        return f"placed by T_rig_board and {RIG_FILE}: {_what_counts(session)}"
    if not stated_place(session).covariance.any():
        return "placed by T_rig_board, taken as exact"
    sigma_deg = np.degrees(session.T_rig_board_sigma_rad)
    sigmas = f"± {session.T_rig_board_sigma_mm:.3g} mm and ± {sigma_deg:.3g} degrees"
    return f"placed by T_rig_board, {sigmas}, with the free strokes when it is evaluated"


def _what_counts(session: Session) -> str:
    """Return in words which of T_rig_board and rig.toml counts."""
    if not stated_place(session).covariance.any():
        return f"T_rig_board is taken as exact and counts, {RIG_FILE} does not"
    return f"both count, by their sigmas: {both_places(session).spread}"


def _in_own_frame(session: Session) -> Placement:
    """Return the placement by rig.toml in its own frame: no step, and its covariance."""
    return Placement(np.zeros(6), session.measured_rig.covariance)
