"""The session's own calibration: cameras in the rig frame and the scene without rods, made from the whole session.

Kept in OUT/calibration with the hash of what it was made from, and made again only where that changed.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from bench.base.digests import Digests
from bench.base.input_problems import refused_as_bad_input, require_cameras
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
from bench.cameras.measured_place import moved_by_file, stated_place
from bench.session.footage import frame_count, read_frames, rig_picture
from bench.session.rig_file import RIG_FILE
from bench.session.session import Session
from vision.boards import camera_moved, estimate_optics, refine_corners
from vision.calibration import Placement, move_rig_frame, read_cameras
from vision.geometry import (
    NO_REASON,
    Board,
    Cameras,
    Reason,
    Refused,
    apply,
    compose,
    counted,
    invert_transform,
    skew,
    spread,
)

# [sigmas] A camera whose board stands farther elsewhere than this, and than the next, was moved. Chance alone gives a
# motion (six numbers) 3 sigma, RMS, once in 1e9 pictures; five leave room for errors of the lens. Derived; study:
# bench_thresholds.py cameras.session_cameras _MOVED_SIGMAS 3 4 changes nothing.
_MOVED_SIGMAS = 5.0
# [px] Least shift that counts, whatever its sigma: 0.05 mm at 350 mm before a lens of 2000 px. Stated; study:
# bench_thresholds.py cameras.session_cameras _MOVED_PX 0.02 0.1 changes nothing.
_MOVED_PX = 0.3
# [trials] In fewer the bar stands before a place too often.
_FEWEST_FOR_MEDIAN = 5
# [trials] More do not change the median.
_MOST_FOR_MEDIAN = 9
_EXACT = Placement(np.zeros(6), np.zeros((6, 6)))


@dataclass(frozen=True)
class SessionCalibration:
    """The cameras of a session and the scenes without whisker and bar.

    cameras: None where the session has neither pictures nor traces. background: the scene by camera, None where
    there is no such picture. hash: of both. notes: lines on what they rest on. T_rig_board: where
    the board on the rig stands in the cameras' frame, (3, 4) mm, None where not known. board_mm:
    the board's points as calibrated, (m, 3), None where they are as stated. warnings: where the board's views or the bars' widths
    contradict what is stated. placed_by: name of the pass over free strokes that placed the rig, hashes_before: by
    trial the hash of what was seen in it; none where the cameras are as they were, or moved far.
    """

    cameras: Cameras | None
    background: dict[str, np.ndarray | None]
    hash: str
    notes: tuple[str, ...] = ()
    T_rig_board: np.ndarray | None = None
    board_mm: np.ndarray | None = None
    warnings: tuple[Reason, ...] = ()
    placed_by: str = ""
    hashes_before: Mapping[str, str] = field(default_factory=dict)

    def with_notes(self, *notes: str) -> "SessionCalibration":
        """Return the calibration with more notes."""
        return replace(self, notes=(*self.notes, *notes))


def calibrate_session(session: Session, out: Path) -> SessionCalibration:
    """Return cameras and backgrounds of a session.

    Raises BadInput where the session cannot be calibrated, saying what to record.
    """
    if not session.is_seen:
        return SessionCalibration(None, {}, hash_of("no pictures"))
    if session.cameras_toml:
        with refused_as_bad_input("cameras.toml"):
            cameras = read_cameras(session.cameras_toml, session.pixel_aspects)
        notes = ("cameras as given in cameras.toml",)
        known = SessionCalibration(cameras, {}, "", notes, session.T_rig_board)
    else:
        known = _from_boards(session, out / "calibration")
        cameras = known.cameras
    require_cameras(cameras, session.camera_names, "cameras.toml", "; calibrate it")
    background = {name: _background(session, name) for name in cameras.names}
    cameras = _with_optics(cameras, background, session.board)
    of_cameras = [[c, cameras.covariance, cameras.placement] for c in cameras.cameras]
    made = hash_of(of_cameras, list(background.values()), known.board_mm, session.crops)
    known = replace(known, cameras=cameras, background=background, hash=made)
    return known.with_notes(*_optics_notes(cameras))


def _with_optics(
    cameras: Cameras, background: Mapping[str, np.ndarray | None], board: Board | None
) -> Cameras:
    """Return the cameras with the transfer curve and lens blur that the board on the rig shows."""
    if board is None:
        return cameras
    known = []
    for camera in cameras:
        picture = background[camera.name]
        optics = camera.optics if picture is None else estimate_optics(picture, board)
        known.append(replace(camera, optics=optics))
    return replace(cameras, cameras=tuple(known))


def _optics_notes(cameras: Cameras) -> Iterator[str]:
    """Yield a line on the optics of each camera that the board on the rig shows."""
    for camera in cameras:
        optics = camera.optics
        if optics.is_known:
            curve = f"gamma {optics.gamma:.2f} ± {optics.gamma * optics.log_gamma_sigma:.2f}"
            blur = f"{optics.blur_px:.2f} ± {optics.blur_px * optics.log_blur_sigma:.2f} px"
            yield f"camera {camera.name}, by the board on the rig: {curve}, lens blur {blur}"


def at_base(calibration: SessionCalibration, view: Session) -> SessionCalibration:
    """Return an array's calibration in the base frame of the whisker whose view this is.

    As well as the rig frame is known the base's is, and besides as well as the base: both by the
    sigmas of the view's board (see `by_board`), or, of cameras that were brought along, by the
    sigmas of the base.
    """
    if calibration.cameras is None:
        return calibration
    T_base_board = calibration.T_rig_board
    if T_base_board is not None:
        T_base_board = compose(view.base.T_base_rig, T_base_board)
    return replace(
        calibration,
        cameras=_cameras_at_base(calibration.cameras, view),
        T_rig_board=T_base_board,
        hash=hash_of(calibration.hash, view.base),
    )


def _cameras_at_base(cameras: Cameras, view: Session) -> Cameras:
    """Return an array's cameras in the base frame of the whisker whose view this is."""
    T_rig_base = view.base.T_rig_base
    if view.whole.cameras_toml is not None:
        before = np.zeros((6, 6)) if cameras.placement is None else cameras.placement
        lever = np.eye(6)
        lever[3:, :3] = -skew(T_rig_base[:, 3])
        variances = np.repeat([view.base.sigma_rad**2, view.base.sigma_mm**2], 3)
        after = lever @ before @ lever.T + np.diag(variances)
    else:
        before = _board_covariance(view.whole)
        turn = np.kron(np.eye(2), T_rig_base[:, :3])
        after = turn @ _board_covariance(view) @ turn.T
    return move_rig_frame(
        cameras, replace(_EXACT, covariance=before), Placement.of(T_rig_base, after)
    )


def _board_covariance(session: Session) -> np.ndarray:
    """Return the covariance (6, 6) of the rig frame as the board on the rig gives it."""
    return stated_place(session).covariance


def _from_boards(session: Session, folder: Path) -> SessionCalibration:
    """Return the calibration kept in `folder`, or made there, without backgrounds and hash.

    The cameras are those that the file holds, in every run.
    """
    digests = Digests(folder.parent)
    key = _key(session, digests)
    digests.keep()
    kept = read_result(folder / "cameras.json")
    if not (kept and kept.get("hash") == key and (folder / "cameras.toml").is_file()):
        kept = _calibrate_into(session, folder, key)
    T_rig_board = None if kept["T_rig_board"] is None else np.array(kept["T_rig_board"])
    return SessionCalibration(
        cameras=read_cameras(folder / "cameras.toml", session.pixel_aspects),
        background={},
        hash="",
        notes=tuple(kept["notes"]),
        T_rig_board=T_rig_board,
        board_mm=np.array(kept["board_mm"]),
        warnings=tuple(Reason(code, sentence) for code, sentence in kept["warnings"]),
    )


def _calibrate_into(session: Session, folder: Path, key: str) -> dict:
    """Calibrate the cameras and write them into `folder`; return what cameras.json then holds."""
    views = read_board_views(session)
    made = calibrate_from(session, views)
    board = board_in_world(session, views)
    cameras, T_rig_board, note = on_the_rig(session, made.cameras, board)
    lengths, warnings = check_scale(session, cameras)
    folder.mkdir(parents=True, exist_ok=True)
    write_cameras(folder / "cameras.toml", cameras, session.crops)
    notes = [*report_lines(made), *([note] if note else []), *lengths]
    parts = []
    for warning in (*made.warnings, *warnings):
        parts += warning.parts
    kept = plain(
        {
            "hash": key,
            "notes": notes,
            "T_rig_board": T_rig_board,
            "board_mm": made.board_mm,
            "warnings": parts,
        }
    )
    write_result(folder / "cameras.json", kept)
    return kept


def on_the_rig(
    session: Session, cameras: Cameras, T_world_board: np.ndarray | None
) -> tuple[Cameras, np.ndarray | None, str | None]:
    """Return cameras in the rig frame, T_rig_board (None where there is no such board) and a note.

    Where session.toml does not state where the rig is, rig.toml does, or the free strokes give it.
    """
    if session.T_rig_board is not None:
        return cameras, session.T_rig_board, None
    if session.measured_rig is not None:
        note = f"{RIG_FILE} places the rig, by {session.measured_rig.source}."
        return moved_by_file(session, cameras), session.measured_rig.T_rig_board, note
    first = first_look(session, cameras)
    step = Placement.of(invert_transform(first.T_rig_world), by_first_look().covariance)
    strokes = counted(first.strokes, "stroke")
    note = f"T_rig_board is missing: a first look at {strokes} says where whisker and motor are."
    T_rig_board = None if T_world_board is None else compose(first.T_rig_world, T_world_board)
    return move_rig_frame(cameras, _EXACT, step), T_rig_board, note


def _key(session: Session, digests: Digests) -> str:
    """Return a hash of all that the cameras are made from.

    That is boards, their givens, and the trials' frames, which have the rig board in them.
    """
    paths = [session.path / "boards"]
    for trial in session.trials:
        # without T_rig_board motor angles count too
        sources = map(Path, trial.camera_sources.values())
        paths += sources if session.is_rig_placed else [trial.folder]
    given = [
        session.board,
        session.T_rig_board,
        session.T_rig_board_sigma_mm,
        session.T_rig_board_sigma_rad,
        session.measured_rig,
        session.crops,
        session.pixel_aspects,
    ]
    files = hash_of_files(paths, digests.of)
    return hash_of(hash_of_code(SEEING), given, session.whisker, files)


def _background(session: Session, camera: str) -> np.ndarray | None:
    """Return the rig picture of a camera, in which neither whisker nor bar stands.

    Without one it is the trials' median, None of too few trials.
    """
    path = session.rig_pictures.get(camera)
    return _median(session, camera) if path is None else rig_picture(path)


def _median(session: Session, camera: str) -> np.ndarray | None:
    """Return the median picture of a frame early and one late in each of some trials.

    The trials' bars stand in different places. None of too few trials.
    """
    sources = [t.camera_sources[camera] for t in session.trials if camera in t.camera_sources]
    if len(sources) < _FEWEST_FOR_MEDIAN:
        return None
    pictures: list[np.ndarray] = []
    for source in spread(sources, _MOST_FOR_MEDIAN):
        last = max(0, frame_count(source) - 1)
        read = read_frames(source, {0, last})
        pictures += [picture for picture in read.values() if picture is not None]
    return np.median(pictures, axis=0).astype(np.float32) if pictures else None


def moved_cameras(
    session: Session,
    calibration: SessionCalibration,
    frames: Mapping[str, Mapping[int, np.ndarray]],
) -> dict[str, str]:
    """Return the cameras that moved since they were calibrated: name to a line on what is seen.

    A camera is compared in the first and the last of these frames; one that does not see the rig
    board is not checked.
    """
    moved: dict[str, str] = {}
    if session.board is None or calibration.T_rig_board is None:
        return moved
    for name, pictures in frames.items():
        if not pictures or calibration.background.get(name) is None:
            continue
        for k in (min(pictures), max(pictures)):
            reason = _move_of(session, calibration, name, pictures[k])
            if reason:
                moved[name] = reason
                break
    return moved


def _move_of(
    session: Session, calibration: SessionCalibration, name: str, grey: np.ndarray
) -> Reason:
    """Return what to say of a camera that moved; nothing where it did not."""
    camera = calibration.cameras[name]
    T = calibration.T_rig_board
    as_made = calibration.board_mm
    points = apply(T, session.board.corners_mm if as_made is None else as_made)
    corners = refine_corners(grey, camera.project(points), np.arange(len(points)), session.board)
    try:
        shift_px, sigma_px = camera_moved(camera, corners, points)
    except Refused:
        return NO_REASON
    if shift_px <= max(_MOVED_PX, _MOVED_SIGMAS * sigma_px):
        return NO_REASON
    shift = f"the rig board is {shift_px:.2f} ± {sigma_px:.2f} px off"
    return Reason("camera_moved", f"camera {name} moved and was left out: {shift}")
