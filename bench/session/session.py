"""A session folder, read strictly: what a lab recorded in one sitting (format 1)."""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.base.toml_text import read_toml
from bench.session import manifest
from bench.session.angle_source import SOURCES, missing_key
from bench.session.daq import daq_file
from bench.session.file_names import SESSION_TOML
from bench.session.footage import camera_sources, single_pictures, visible
from bench.session.givens import Given
from bench.session.inside import check_inside
from bench.session.picture_parts import check_camera_tables, in_parts, stated_crops
from bench.session.plausible import YOUNGS_MODULUS
from bench.session.profile import read_profile
from bench.session.rest_shape import read_rest_shape
from bench.session.rig_file import RIG_FILE, MeasuredRig, exact_pose, read_rig
from bench.session.stated import StatedSession
from bench.session.stated_board import missing_parts, stated_board, with_kalibr_target
from bench.session.strict_toml import as_keys, key_names
from bench.session.trial import Trial, load_trial
from bench.session.whisker import Whisker, profiled_sizes
from vision.boards import CharucoBoard
from vision.geometry import Board, Crop, Reason, invert_transform
from vision.pictures import PicturePart, natural_order

FORMAT = 1  # of session.toml; another one is refused
# [N·mm² in a N·m²] For a guess at the unit.
NMM2_PER_NM2 = 1e6
# [1], [mm] A T_rig_board of session.toml this near to rig.toml's was copied from there: no two measurements
# agree in four digits of each of twelve numbers. Stated.
_COPIED = 1e-4


@dataclass(frozen=True)
class GivenGauges:
    """Gauge coefficients of [gauges]; sigmas 0: exact.

    [m_y, m_z] in the follicle's axes = matrix · ([y_V, z_V] − offset), N·mm.
    """

    offset_V: np.ndarray
    matrix_Nmm_per_V: np.ndarray
    offset_sigma_V: np.ndarray
    matrix_sigma_Nmm_per_V: np.ndarray


@dataclass(frozen=True)
class Base:
    """The base of a whisker of an array.

    T_rig_base: (3, 4), mm; its z is the axis that the whisker turns about, its x the whisker at
    motor angle 0. Sigmas are of each shift and each turn.
    """

    name: str
    T_rig_base: np.ndarray
    sigma_mm: float
    sigma_rad: float

    @property
    def T_base_rig(self) -> np.ndarray:
        """Return the transform (3, 4) of coordinates of the rig frame to those of the base's."""
        return invert_transform(self.T_rig_base)


@dataclass(frozen=True)
class Session:
    """A recorded session by session.toml and its folders; sigmas are 0 where exact.

    T_rig_board: (3, 4), mm. whisker and bar are given wherever there are trials; board wherever
    there is no cameras.toml but pictures. base: of the whisker whose view of an array this is
    (`bench.session.array_view`), whole: the array's session, in the rig frame; both None where the
    session is one whisker's. givens: what session.toml states, without its trials'. measured_rig: of
    rig.toml, None without it. crops: of cameras that are parts of another one's picture. truth: of
    [truth], None where the pictures are the truth. pixel_aspects: fx/fy of cameras, where stated.
    """

    path: Path
    name: str
    whisker: Whisker | None
    bar_diameter_mm: float | None
    bar_diameter_sigma_mm: float
    board: Board | None
    T_rig_board: np.ndarray | None
    T_rig_board_sigma_mm: float
    T_rig_board_sigma_rad: float
    gauges: GivenGauges | None
    camera_names: tuple[str, ...]
    board_sources: dict[str, Path | PicturePart]
    rig_pictures: dict[str, Path | PicturePart]
    trials: tuple[Trial, ...]
    cameras_toml: Path | None
    gauges_toml: Path | None
    base: Base | None = None
    whole: "Session | None" = None
    givens: tuple[Given, ...] = ()
    measured_rig: MeasuredRig | None = None
    crops: Mapping[str, Crop] = field(default_factory=dict)
    truth: manifest.TruthKeys | None = None
    pixel_aspects: Mapping[str, float] = field(default_factory=dict)

    @property
    def is_rig_placed(self) -> bool:
        """Return whether session.toml or rig.toml says where the board on the rig stands."""
        return self.T_rig_board is not None or self.measured_rig is not None

    @property
    def whole_name(self) -> str:
        """Return the name without that of the whisker whose view it is."""
        return self.name.removesuffix(f", whisker {self.base.name}") if self.base else self.name

    @property
    def has_pictures(self) -> bool:
        """Return whether any trial has frames."""
        return any(trial.camera_sources for trial in self.trials)

    @property
    def is_seen(self) -> bool:
        """Return whether there are pictures or traces of any trial."""
        return any(trial.is_seen for trial in self.trials)

    def mirrored(self, camera: str) -> bool:
        """Return whether a camera is what another one sees in a mirror."""
        return camera in self.crops and self.crops[camera].mirrored

    def board_place(self, camera: str) -> str:
        """Return how messages name a camera's pictures of the board."""
        crop = self.crops.get(camera)
        return f"boards/{camera}" if crop is None else f"boards/{crop.of}, camera {camera}"

    def trial(self, name: str) -> Trial:
        """Return the trial of that name. Raise BadInput, naming those that there are."""
        for trial in self.trials:
            if trial.name == name:
                return trial
        names = _listed(trial.name for trial in self.trials)
        raise BadInput(f"there is no trial {name!r}; there are {names}", file="trials")


def load_session(
    path: Path | str,
    problems: InputProblems | None = None,
    *,
    lenses_known: bool = False,
    trials: Collection[str] | None = None,
    follow_links: bool = False,
) -> Session:
    """Read the manifests and find every file of a session. Signals and frames are not read here.

    lenses_known: board views of each camera are not required. trials: names of those that are read;
    None: all. follow_links: pictures and videos may lie elsewhere. Raises BadInput at the first
    thing that is wrong; with a collecting `problems`, reads on where it can.
    """
    path = Path(path)
    problems = problems or InputProblems()
    stated = read_manifest(path, problems, follow_links)
    if stated.keys.whiskers:
        found = "has several whiskers ([[whiskers]]); evaluate and check alone take them"
        raise BadInput(found, file=SESSION_TOML)
    return session_of(path, stated, problems, lenses_known=lenses_known, trials=trials)


def session_of(
    path: Path,
    stated: StatedSession,
    problems: InputProblems,
    *,
    lenses_known: bool = False,
    trials: Collection[str] | None = None,
) -> Session:
    """Return the session of a manifest; options and errors are those of `load_session`."""
    keys = stated.keys
    whisker, board, T_rig_board = _stated_bench(path, keys, problems)
    bar_mm, bar_sigma_mm = _bar_diameter(keys.bar)
    recorded = _find_recorded(path, stated, problems, trials)
    session = Session(
        path=path,
        name=keys.name or path.resolve().name,
        whisker=whisker,
        bar_diameter_mm=bar_mm,
        bar_diameter_sigma_mm=bar_sigma_mm,
        board=board,
        T_rig_board=T_rig_board,
        T_rig_board_sigma_mm=keys.rig.T_rig_board_sigma_mm,
        T_rig_board_sigma_rad=math.radians(keys.rig.T_rig_board_sigma_deg),
        gauges=given_gauges(keys.gauges),
        camera_names=_camera_names(recorded.board_sources, recorded.trials),
        board_sources=recorded.board_sources,
        rig_pictures=recorded.rig_pictures,
        trials=recorded.trials,
        cameras_toml=_existing(path / "cameras.toml"),
        gauges_toml=_existing(path / "gauges.toml"),
        givens=stated.givens_of(),
        crops=recorded.crops,
        truth=keys.truth,
        pixel_aspects={c.name: c.pixel_aspect for c in keys.cameras if c.pixel_aspect},
    )
    with problems.guard():
        session = _with_measured_rig(session)
    _warn_of_unused_cameras(session, keys.cameras, problems)
    _check_cameras(session, problems, lenses_known)
    return session


@dataclass(frozen=True)
class _Recorded:
    """Pictures of the board and trials of a session's folder, by camera as crops divide the files.

    Of cameras: board_sources, rig_pictures (the board on the rig), crops.
    """

    board_sources: dict[str, Path | PicturePart]
    rig_pictures: dict[str, Path | PicturePart]
    trials: tuple[Trial, ...]
    crops: dict[str, Crop]


def _find_recorded(
    path: Path,
    stated: StatedSession,
    problems: InputProblems,
    trials: Collection[str] | None,
) -> _Recorded:
    """Find pictures of the board and trials in the session's folder. Raises BadInput."""
    board_sources = camera_sources(path / "boards", "boards")
    board_sources.pop("rig", None)
    rig_pictures = single_pictures(path / "boards" / "rig", "boards/rig")
    found = _ordered_trials(path, stated, problems, trials)
    crops: dict[str, Crop] = {}
    with problems.guard():
        sources = _one_source_each(board_sources, rig_pictures, found)
        if sources or any(trial.cameras for trial in found):  # something is recorded
            crops = stated_crops(stated.keys.cameras, sources)
    in_crops = tuple(_in_crops(trial, crops) for trial in found)
    return _Recorded(in_parts(board_sources, crops), in_parts(rig_pictures, crops), in_crops, crops)


def _in_crops(trial: Trial, crops: Mapping[str, Crop]) -> Trial:
    """Return a trial with the pictures of each camera, of a part of a picture that part."""
    frames = in_parts(trial.camera_sources, crops)
    return replace(
        trial, camera_sources=frames, board_pictures=in_parts(trial.board_pictures, crops)
    )


def _with_measured_rig(session: Session) -> Session:
    """Return the session with what rig.toml holds. Raise BadInput where that is no rig of this session.

    Where cameras.toml places the cameras it is not read. A T_rig_board of session.toml that was copied
    from there is no second measurement, and left out.
    """
    path = session.path / RIG_FILE
    if session.cameras_toml is not None or not path.is_file():
        return session
    measured = read_rig(path, session.rig_pictures)
    stated = session.T_rig_board
    if stated is not None and np.abs(stated - measured.T_rig_board).max() < _COPIED:
        others = tuple(given for given in session.givens if not given.key.startswith("[rig]"))
        session = replace(session, T_rig_board=None, givens=others)
    return replace(session, measured_rig=measured)


def _stated_bench(
    path: Path, keys: manifest.SessionKeys, problems: InputProblems
) -> tuple[Whisker | None, Board | None, np.ndarray | None]:
    """Return whisker, board and T_rig_board (3, 4), each None where it is not stated."""
    return problems.each(
        [
            partial(_whisker, keys.whisker, path),
            partial(_board, keys.board),
            partial(_board_pose, keys.rig.T_rig_board),
        ]
    )


def _bar_diameter(keys: manifest.BarKeys | None) -> tuple[float | None, float]:
    """Return the bar's diameter by [bar] and its sigma, mm; None and 0 without that table."""
    return (None, 0.0) if keys is None else (keys.diameter_mm, keys.diameter_sigma_mm)


def _ordered_trials(
    path: Path, stated: StatedSession, problems: InputProblems, names: Collection[str] | None
) -> tuple[Trial, ...]:
    """Return the trials of these names, None for all, in the session's order of surfaces."""
    surfaces = stated.keys.surfaces
    found = _by_surface(_trials(path, stated, problems, names), surfaces)
    if names is None:
        _warn_of_unused_surfaces(found, surfaces, problems)
    return found


def read_manifest(path: Path, problems: InputProblems, follow_links: bool) -> StatedSession:
    """Read session.toml of a folder that holds nothing else than a session may. Raises BadInput."""
    if not path.is_dir():
        raise BadInput("there is no such folder; give the session's folder", file=str(path))
    if not (path / SESSION_TOML).is_file():
        found = f"there is no {SESSION_TOML} in this folder, so it is not a session"
        raise BadInput(found, file=str(path))
    check_inside(path, problems, follow_links)
    return _stated_session(path, read_toml(path / SESSION_TOML, SESSION_TOML), problems)


def _stated_session(path: Path, tables: dict, problems: InputProblems) -> StatedSession:
    """Return what session.toml states in its tables. Raises BadInput where that is no session."""
    if tables.get("format", FORMAT) != FORMAT:
        found = f"format is {tables['format']!r}; this version reads format {FORMAT}"
        raise BadInput(found, file=SESSION_TOML)
    tables = with_kalibr_target(tables, path)
    _check_board_parts(tables.get("board"), problems)
    check_camera_tables(tables.get("cameras"), problems)
    has_trials = bool(visible(path / "trials"))
    if not has_trials:
        _check_angle_parts(tables.get("trial"), problems)
    needed = []
    if has_trials:
        needed = ["bar"] if "whiskers" in tables else ["whisker", "bar"]
    as_keys(tables, manifest.SessionKeys, SESSION_TOML, problems, needed)
    return StatedSession.of(tables)


def _check_board_parts(board: Any, problems: InputProblems) -> None:
    """Report each key that the kind of board in [board] needs and that is not there.

    Where the table has a key that is none, that one is reported alone, elsewhere: it may be the one misspelt.
    """
    if not isinstance(board, dict) or not board.keys() <= set(key_names(manifest.BoardKeys)):
        return
    for line in missing_parts(board.get("kind", CharucoBoard.kind), board):
        with problems.guard():
            raise BadInput(line, file=SESSION_TOML)


def _check_angle_parts(trial: Any, problems: InputProblems) -> None:
    """Report each key that angles without a motor log need and that [trial] does not have.

    Where there are trials, each of them may have it.
    """
    if not isinstance(trial, dict):
        return
    angle_from = str(trial.get("angle_from"))
    for key in SOURCES[angle_from].keys if angle_from in SOURCES else ():
        with problems.guard():
            if key not in trial:
                raise BadInput(f"[trial] {missing_key(key, angle_from)}", file=SESSION_TOML)


def _whisker(keys: manifest.WhiskerKeys | None, path: Path) -> Whisker | None:
    """Return the whisker of [whisker]; None without that table."""
    return None if keys is None else stated_whisker(keys, "[whisker]", path)


def stated_whisker(keys: manifest.WhiskerKeys, table: str, path: Path) -> Whisker:
    """Return the whisker of a table of the session at `path`, with the file that it names.

    table: its name in messages. Raises BadInput for an impossible whisker, or file.
    """
    sizes = {name: getattr(keys, name) for name in key_names(manifest.WhiskerKeys)}
    if keys.rest_shape is not None:
        sizes["rest_mm"] = read_rest_shape(path, keys.rest_shape, keys.length_mm)
    try:
        if keys.profile is not None:
            sizes |= profiled_sizes(keys, read_profile(path, keys.profile, keys.length_mm))
        whisker = Whisker(**sizes)
    except ValueError as problem:
        raise BadInput(f"{table} {problem}", file=SESSION_TOML) from None
    _check_rigidity(whisker, table)
    return whisker


def _check_rigidity(whisker: Whisker, table: str) -> None:
    """Raise BadInput where rigidity and diameter do not amount to a material."""
    modulus_GPa = whisker.implied_modulus_GPa
    if YOUNGS_MODULUS.holds(modulus_GPa):
        return
    hint = ""
    if YOUNGS_MODULUS.holds(modulus_GPa * NMM2_PER_NM2):
        hint = f" Is it in N m2? Then write {whisker.EI_Nmm2 * NMM2_PER_NM2:.6g}."
    keys = "flexural_rigidity_Nmm2 and diameter_mm"
    found = f"{keys} amount to a Young's modulus of {modulus_GPa:.3g} GPa"
    raise BadInput(
        f"{table} {found}; {YOUNGS_MODULUS.allowed} is allowed.{hint}", file=SESSION_TOML
    )


def _board(keys: manifest.BoardKeys | None) -> Board | None:
    """Return the board of [board]; None without that table. Raise BadInput for an impossible one."""
    if keys is None:
        return None
    return stated_board(keys, SESSION_TOML)


def _board_pose(rows: list[list[float]] | None) -> np.ndarray | None:
    """Return T_rig_board (3, 4) of [rig]; None without rows. Raise BadInput for an impossible one."""
    return None if rows is None else exact_pose(rows, "[rig] T_rig_board", SESSION_TOML)


def given_gauges(keys: manifest.GaugeKeys | None) -> GivenGauges | None:
    """Return the gauges that a table states; None without one."""
    if keys is None:
        return None
    return GivenGauges(
        np.array(keys.offset_V),
        np.array(keys.matrix_Nmm_per_V),
        np.array(keys.offset_sigma_V or np.zeros(2)),
        np.array(keys.matrix_sigma_Nmm_per_V or np.zeros((2, 2))),
    )


def _trials(
    path: Path, stated: StatedSession, problems: InputProblems, names: Collection[str] | None
) -> list[Trial]:
    """Return the trials of these names that can be read; None: of all."""
    found = []
    daq = None
    with problems.guard():
        daq = daq_file(stated.keys.signals)
    for entry in visible(path / "trials"):
        if entry.is_dir() and (names is None or entry.name in names):
            with problems.guard():
                found.append(load_trial(entry, stated, problems, daq))
    return found


def _by_surface(trials: Iterable[Trial], order: Sequence[str]) -> tuple[Trial, ...]:
    """Return the trials in the session's order of surfaces, within one by name.

    Other surfaces come after those named.
    """
    rank = {name: k for k, name in enumerate(dict.fromkeys(order))}
    return tuple(sorted(trials, key=lambda trial: rank.get(trial.surface, len(rank))))


def _warn_of_unused_surfaces(
    trials: Iterable[Trial], order: Sequence[str], problems: InputProblems
) -> None:
    """Warn of each surface that no trial has: it is misspelt, or not recorded yet."""
    recorded = sorted({trial.surface for trial in trials})
    for name in order:
        if recorded and name not in recorded:
            found = f"surfaces has {name!r}, which is no trial's; there are {_listed(recorded)}"
            problems.warn(Reason("surface_unused", f"{SESSION_TOML}: {found}"))


def _one_source_each(
    board_sources: Mapping[str, Path], rig_pictures: Mapping[str, Path], trials: Iterable[Trial]
) -> dict[str, Path]:
    """Return a folder, film or picture of each camera that has one, of the board or of a trial."""
    sources = {**rig_pictures, **board_sources}
    for trial in trials:
        sources = trial.board_pictures | trial.camera_sources | sources
    return sources


def _camera_names(
    board_sources: Mapping[str, Path | PicturePart], trials: Iterable[Trial]
) -> tuple[str, ...]:
    """Return the names of all cameras with pictures of the board or of a trial, or traces, in natural order."""
    names = set(board_sources).union(*(trial.cameras for trial in trials))
    return tuple(sorted(names, key=lambda name: natural_order(Path(name))))


def _warn_of_unused_cameras(
    session: Session, cameras: Iterable[manifest.CameraKeys], problems: InputProblems
) -> None:
    """Warn of each of [[cameras]] that has no pictures, but of no part: that has them, or is refused."""
    known = {*session.camera_names, *(crop.of for crop in session.crops.values())}
    for camera in cameras:
        if session.camera_names and camera.name not in known and camera.of is None:
            found = f"[[cameras]] {camera.name!r} has no pictures in boards/ or trials/"
            problems.warn(Reason("camera_unused", f"{SESSION_TOML}: {found}"))


def _check_cameras(session: Session, problems: InputProblems, lenses_known: bool) -> None:
    """Raise BadInput where a camera lacks frames of a trial, or what it is calibrated from."""
    for trial in session.trials:
        with problems.guard():
            _check_trial_cameras(trial, session.camera_names)
    if session.is_seen and session.cameras_toml is None and not lenses_known:
        for name in session.camera_names:
            with problems.guard():
                _check_camera_boards(session, name)


def _check_trial_cameras(trial: Trial, names: tuple[str, ...]) -> None:
    """Raise BadInput where some cameras have frames of a trial, and others have none."""
    missing = [name for name in names if name not in trial.camera_sources]
    if trial.camera_sources and missing:
        found = f"camera {missing[0]} has no frames here, {_listed(trial.camera_sources)} has"
        raise BadInput(
            f"{found}; add them or leave camera {missing[0]} out of the whole session "
            "(boards/ and all trials)",
            file=f"trials/{trial.name}",
        )


def _check_camera_boards(session: Session, name: str) -> None:
    """Raise BadInput where a camera has no board views to be calibrated from."""
    if session.board is None:
        raise BadInput("[board] is missing, and there is no cameras.toml", file=SESSION_TOML)
    if name not in session.board_sources:
        found = f"there are no board views of camera {name}, and no cameras.toml"
        raise BadInput(found, file=f"boards/{name}")
    if session.T_rig_board is not None and name not in session.rig_pictures:
        found = f"there is no picture of the board on the rig by camera {name}"
        raise BadInput(found, file=f"boards/rig/{name}")


def _existing(path: Path) -> Path | None:
    """Return a path where there is such a file, else None."""
    return path if path.is_file() else None


def _listed(names: Iterable[str]) -> str:
    """Return names as messages list them."""
    return ", ".join(names) or "none"
