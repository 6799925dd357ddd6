"""The session's own calibration: cameras in the rig frame and the scene without rods, made from the whole session.

Kept in OUT/calibration with the hash of what it was made from, and made again only where that changed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

import numpy as np

from bench.base.digests import Digests
from bench.base.errors import BadInput
from bench.base.results import (
    SEEING,
    hash_of,
    hash_of_code,
    hash_of_files,
    plain,
    read_result,
    write_result,
)
from bench.cameras.board_views import read_board_views
from bench.cameras.calibrate_session import board_in_world, calibrate_from, report_lines
from bench.cameras.cameras_toml import write_cameras
from bench.cameras.first_look import by_first_look, first_look
from bench.cameras.known_scale import check_scale
from bench.session.footage import frame_count, read_frames, rig_picture
from bench.session.session import Session
from vision.boards.corners import refine_corners
from vision.boards.static_board import camera_moved
from vision.calibration.cameras_file import read_cameras
from vision.calibration.place import Placement, by_board, move_rig_frame
from vision.geometry.camera import Cameras
from vision.geometry.counted import counted
from vision.geometry.reasons import NO_REASON, Reason
from vision.geometry.refusals import Refused
from vision.geometry.rotation import compose, invert_transform, log_rotation, skew

# Sigmas, px: a camera whose board stands farther elsewhere than both was moved. Set by eye.
_MOVED_SIGMAS, _MOVED_PX = 5.0, 0.3
_FEWEST_FOR_MEDIAN, _MOST_FOR_MEDIAN = (
    5,
    9,
)  # trials: in fewer the bar stands before a place too often


@dataclass(frozen=True)
class SessionCalibration:
    """Cameras (None where the session has no pictures), the scene without whisker and bar by camera (None where there
    is no such picture), a hash of both, lines that say what they rest on, and where the board on the rig stands in the
    cameras' frame, (3, 4) mm, None where not told."""

    cameras: Cameras | None
    background: dict[str, np.ndarray | None]
    hash: str
    notes: tuple[str, ...] = ()
    T_rig_board: np.ndarray | None = None

    def with_notes(self, *notes: str) -> "SessionCalibration":
        """The same with more to say."""
        return replace(self, notes=(*self.notes, *notes))


def calibrate_session(session: Session, out: Path) -> SessionCalibration:
    """Cameras and backgrounds. Raises BadInput where the session cannot be calibrated, saying what to record."""
    if not any(trial.camera_sources for trial in session.trials):
        return SessionCalibration(None, {}, hash_of("no pictures"))
    made = _given(session) if session.cameras_toml else _made(session, out / "calibration")
    cameras, notes, T_rig_board = made
    missing = [name for name in session.camera_names if name not in cameras]
    if missing:
        raise BadInput(
            f"has no camera {missing[0]}, which has frames; calibrate it", file="cameras.toml"
        )
    background = _backgrounds(session, cameras)
    content = (
        [[c, cameras.covariance, cameras.placement] for c in cameras.cameras],
        list(background.values()),
    )
    return SessionCalibration(cameras, background, hash_of(*content), notes, T_rig_board)


def at_base(calibration: SessionCalibration, view: Session) -> SessionCalibration:
    """An array's calibration in the base frame of the whisker whose view this is.

    As well as the rig frame is known the base's is, and besides as well as the base: both by the sigmas of the view's
    board (see `by_board`), or, of cameras that were brought along, by the sigmas of the base.
    """
    if calibration.cameras is None:
        return calibration
    there = _at_base(calibration.cameras, view)
    T_base_board = calibration.T_rig_board
    if T_base_board is not None:
        T_base_board = compose(view.base.T_base_rig, T_base_board)
    made = hash_of(calibration.hash, view.base)
    return replace(calibration, cameras=there, T_rig_board=T_base_board, hash=made)


def _at_base(cameras: Cameras, view: Session) -> Cameras:
    T_rig_base, whole, base = view.base.T_rig_base, view.whole, view.base
    step = np.append(log_rotation(T_rig_base[:, :3]), T_rig_base[:, 3])
    if whole.cameras_toml is not None:
        before = np.zeros((6, 6)) if cameras.placement is None else cameras.placement
        lever = np.eye(6)
        lever[3:, :3] = -skew(T_rig_base[:, 3])
        own = lever @ before @ lever.T + np.diag(
            np.repeat([base.sigma_rad**2, base.sigma_mm**2], 3)
        )
    else:
        before = by_board(
            whole.T_rig_board, whole.T_rig_board_sigma_mm, whole.T_rig_board_sigma_rad
        ).covariance
        board = by_board(
            view.T_rig_board, view.T_rig_board_sigma_mm, view.T_rig_board_sigma_rad
        ).covariance
        turned = np.kron(np.eye(2), T_rig_base[:, :3])
        own = turned @ board @ turned.T
    return move_rig_frame(cameras, Placement(np.zeros(6), before), Placement(step, own))


def _given(session: Session) -> tuple[Cameras, tuple[str, ...], np.ndarray | None]:
    try:
        return (
            read_cameras(session.cameras_toml),
            ("cameras as given in cameras.toml",),
            session.T_rig_board,
        )
    except Refused as reason:
        raise BadInput(str(reason), file="cameras.toml") from None


def _made(session: Session, folder: Path) -> tuple[Cameras, tuple[str, ...], np.ndarray | None]:
    """Cameras as kept in `folder`, or calibrated there, notes and where the board on the rig stands. What is used is
    what the file holds, in every run."""
    digests = Digests(folder.parent)
    key, kept = _key(session, digests), read_result(folder / "cameras.json")
    digests.keep()
    if not (kept and kept.get("hash") == key and (folder / "cameras.toml").is_file()):
        views = read_board_views(session)
        made = calibrate_from(session, views)
        cameras, T_rig_board, first = on_the_rig(
            session, made.cameras, board_in_world(session, views)
        )
        lengths = check_scale(session, cameras)
        folder.mkdir(parents=True, exist_ok=True)
        write_cameras(folder / "cameras.toml", cameras)
        notes = [*report_lines(made), *filter(None, [first]), *chain(*lengths)]
        kept = plain({"hash": key, "notes": notes, "T_rig_board": T_rig_board})
        write_result(folder / "cameras.json", kept)
    T_rig_board = None if kept["T_rig_board"] is None else np.array(kept["T_rig_board"])
    return read_cameras(folder / "cameras.toml"), tuple(kept["notes"]), T_rig_board


def on_the_rig(
    session: Session, cameras: Cameras, T_world_board: np.ndarray | None
) -> tuple[Cameras, np.ndarray | None, str | None]:
    """Cameras in the rig frame, T_rig_board (None where there is no such board) and a note, by a first look at the
    free strokes where session.toml does not say where the rig is."""
    if session.T_rig_board is not None:
        return cameras, session.T_rig_board, None
    first = first_look(session, cameras)
    T_world_rig = invert_transform(first.T_rig_world)
    there = replace(
        by_first_look(), step=np.append(log_rotation(T_world_rig[:, :3]), T_world_rig[:, 3])
    )
    strokes = counted(first.strokes, "stroke")
    note = f"T_rig_board is missing: a first look at {strokes} says where whisker and motor are."
    T_rig_board = None if T_world_board is None else compose(first.T_rig_world, T_world_board)
    return (
        move_rig_frame(cameras, Placement(np.zeros(6), np.zeros((6, 6))), there),
        T_rig_board,
        note,
    )


def _key(session: Session, digests: Digests) -> str:
    """Hash of all that the cameras are made from: boards, their givens, and the trials' frames (the rig board is in
    them)."""
    by_strokes = session.T_rig_board is None  # then motor angles count too
    frames = [
        p for t in session.trials for p in ([t.folder] if by_strokes else t.camera_sources.values())
    ]
    given = [
        session.board,
        session.T_rig_board,
        session.T_rig_board_sigma_mm,
        session.T_rig_board_sigma_rad,
    ]
    files = hash_of_files([session.path / "boards", *frames], digests.of)
    return hash_of(hash_of_code(SEEING), given, session.whisker, files)


def _backgrounds(session: Session, cameras: Cameras) -> dict[str, np.ndarray | None]:
    """The rig picture of each camera, in which neither whisker nor bar stands; without one, the trials' median."""
    paths = {name: session.rig_pictures.get(name) for name in cameras.names}
    return {
        name: _median(session, name) if path is None else rig_picture(path)
        for name, path in paths.items()
    }


def _median(session: Session, camera: str) -> np.ndarray | None:
    """Median over trials whose bars stand elsewhere, of a frame early and one late in each; None of too few trials."""
    sources = [
        trial.camera_sources[camera] for trial in session.trials if camera in trial.camera_sources
    ]
    if len(sources) < _FEWEST_FOR_MEDIAN:
        return None
    chosen = np.unique(np.linspace(0, len(sources) - 1, _MOST_FOR_MEDIAN).round().astype(int))
    frames = (read_frames(sources[k], {0, max(0, frame_count(sources[k]) - 1)}) for k in chosen)
    pictures = [picture for read in frames for picture in read.values() if picture is not None]
    return np.median(pictures, axis=0).astype(np.float32) if pictures else None


def moved_cameras(
    session: Session,
    calibration: SessionCalibration,
    frames: Mapping[str, Mapping[int, np.ndarray]],
) -> dict[str, str]:
    """Cameras that stand elsewhere in the first or last of these frames than when calibrated: name to what was seen.

    A camera that does not see the rig board is not checked.
    """
    moved = {}
    if session.board is None or calibration.T_rig_board is None:
        return moved
    for name, pictures in frames.items():
        if pictures and calibration.background.get(name) is not None:
            doubts = (
                _moved(session, calibration, name, pictures[k])
                for k in (min(pictures), max(pictures))
            )
            doubt = next(filter(None, doubts), "")
            moved |= {name: doubt} if doubt else {}
    return moved


def _moved(session: Session, calibration: SessionCalibration, name: str, grey) -> Reason:
    """Return what to say of a camera that moved; nothing where it did not."""
    camera, T = calibration.cameras[name], calibration.T_rig_board
    points = session.board.corners_mm @ T[:, :3].T + T[:, 3]
    corners = refine_corners(grey, camera.project(points), np.arange(len(points)), session.board)
    try:
        shift_px, sigma_px = camera_moved(camera, corners, session.board, T)
    except Refused:
        return NO_REASON
    if shift_px <= max(_MOVED_PX, _MOVED_SIGMAS * sigma_px):
        return NO_REASON
    off = f"the rig board is {shift_px:.2f} ± {sigma_px:.2f} px off"
    return Reason("camera_moved", f"camera {name} moved and was left out: {off}")
