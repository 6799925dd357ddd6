"""A session folder, read strictly: what a lab recorded in one sitting (format 1)."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from bench.base.doubts import Doubts
from bench.base.errors import BadInput
from bench.session import manifest
from bench.session.daq import daq_file
from bench.session.footage import camera_sources, single_pictures, visible
from bench.session.inside import check_inside
from bench.session.plausible import YOUNGS_MODULUS
from bench.session.strict_toml import as_keys, read_toml, values
from bench.session.trial import Trial, load_trial
from bench.session.whisker import Whisker
from vision.geometry.board import Board
from vision.geometry.reasons import Reason
from vision.geometry.refusals import Refused
from vision.geometry.rotation import invert_transform, nearest_rotation
from vision.pictures.files import natural_order

FORMAT = 1  # of session.toml; another one is refused
MANIFEST = "session.toml"
NMM2_PER_NM2 = 1e6  # N·mm² in a N·m²
# Three written digits are exact to 1e-3; a transposed, scaled or mirrored matrix is off by far more.
_ROTATION_TOLERANCE = 2e-3
# a board's origin this near to the whisker's base is a board placed in metres
_NEAREST_BOARD_MM = 0.5
_FARTHEST_BOARD_MM = 5000.0  # mm: no bench is larger; written in another unit


@dataclass(frozen=True)
class GivenGauges:
    """[m_y, m_z] in the follicle's axes = matrix · ([y_V, z_V] − offset), N·mm; sigmas 0: taken as exact."""

    offset_V: np.ndarray
    matrix_Nmm_per_V: np.ndarray
    offset_sigma_V: np.ndarray
    matrix_sigma_Nmm_per_V: np.ndarray


@dataclass(frozen=True)
class Base:
    """Where a whisker of an array stands: T_rig_base is (3, 4), mm; its z is the axis that the whisker turns about, its
    x the whisker at motor angle 0. Sigmas are of each shift and each turn."""

    name: str
    T_rig_base: np.ndarray
    sigma_mm: float
    sigma_rad: float

    @property
    def T_base_rig(self) -> np.ndarray:
        """(3, 4): coordinates of the rig frame to those of the base's."""
        return invert_transform(self.T_rig_base)


@dataclass(frozen=True)
class Session:
    """What session.toml and the folders say; T_rig_board is (3, 4), mm; sigmas are 0 where taken as exact.

    whisker and bar are given wherever there are trials; board wherever there is no cameras.toml but pictures. base: of
    the whisker whose view of an array this is (`bench.session.array_view`), whole: the array's session, in the rig frame;
    both None where the session is one whisker's.
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
    board_sources: dict[str, Path]
    rig_pictures: dict[str, Path]
    trials: tuple[Trial, ...]
    cameras_toml: Path | None
    gauges_toml: Path | None
    base: Base | None = None
    whole: "Session | None" = None

    @property
    def whole_name(self) -> str:
        """Its name without that of the whisker whose view it is."""
        return self.name.removesuffix(f", whisker {self.base.name}") if self.base else self.name

    def trial(self, name: str) -> Trial:
        """The trial of that name. Raises BadInput, naming those that there are."""
        for trial in self.trials:
            if trial.name == name:
                return trial
        raise BadInput(
            f"there is no trial {name!r}; there are {_listed(t.name for t in self.trials)}",
            file="trials",
        )


def load_session(
    path: Path | str,
    doubts: Doubts | None = None,
    *,
    lenses_known: bool = False,
    trials: Collection[str] | None = None,
    follow_links: bool = False,
) -> Session:
    """Read the manifests and find every file of a session. Signals and frames are not read here.

    lenses_known: board views of each camera are not asked for. trials: names of those that are read; None: all.
    follow_links: pictures and videos may lie elsewhere.

    Raises BadInput at the first thing that is wrong; with a collecting `doubts`, reads on where it can.
    """
    path, doubts = Path(path), doubts or Doubts()
    keys = read_manifest(path, doubts, follow_links)
    if keys.whiskers:
        raise BadInput(
            "has several whiskers ([[whiskers]]); evaluate and check alone take them", file=MANIFEST
        )
    return loaded(path, keys, doubts, lenses_known=lenses_known, trials=trials)


def loaded(
    path: Path,
    keys: manifest.SessionKeys,
    doubts: Doubts,
    *,
    lenses_known: bool = False,
    trials: Collection[str] | None = None,
) -> Session:
    """The session of a manifest that is read; options and errors of `load_session`."""
    parts = (
        partial(_whisker, keys.whisker),
        partial(_board, keys.board),
        partial(_pose, keys.rig.T_rig_board),
    )
    whisker, board, T_rig_board = doubts.each(parts)
    bar = keys.bar
    board_sources = camera_sources(path / "boards", "boards")
    board_sources.pop("rig", None)
    found = _by_surface(_trials(path, keys, doubts, trials), keys.surfaces)
    if trials is None:
        _check_surfaces(found, keys.surfaces, doubts)
    session = Session(
        path=path,
        name=keys.name or path.resolve().name,
        whisker=whisker,
        bar_diameter_mm=bar and bar.diameter_mm,
        bar_diameter_sigma_mm=bar.diameter_sigma_mm if bar else 0.0,
        board=board,
        T_rig_board=T_rig_board,
        T_rig_board_sigma_mm=keys.rig.T_rig_board_sigma_mm,
        T_rig_board_sigma_rad=float(np.radians(keys.rig.T_rig_board_sigma_deg)),
        gauges=given_gauges(keys.gauges),
        camera_names=_camera_names(board_sources, found),
        board_sources=board_sources,
        rig_pictures=single_pictures(path / "boards" / "rig", "boards/rig"),
        trials=found,
        cameras_toml=_if_there(path / "cameras.toml"),
        gauges_toml=_if_there(path / "gauges.toml"),
    )
    _check_cameras(session, [c.name for c in keys.cameras], doubts, lenses_known)
    return session


def read_manifest(path: Path, doubts: Doubts, follow_links: bool) -> manifest.SessionKeys:
    """session.toml of a folder that holds nothing else than a session may. Raises BadInput."""
    if not path.is_dir():
        raise BadInput("there is no such folder; give the session's folder", file=str(path))
    if not (path / MANIFEST).is_file():
        raise BadInput(
            f"there is no {MANIFEST} in this folder, so it is not a session", file=str(path)
        )
    check_inside(path, doubts, follow_links)
    tables = read_toml(path / MANIFEST, MANIFEST)
    if tables.get("format", FORMAT) != FORMAT:
        raise BadInput(
            f"format is {tables['format']!r}; this version reads format {FORMAT}", file=MANIFEST
        )
    named = ("bar",) if "whiskers" in tables else ("whisker", "bar")
    needed = named if visible(path / "trials") else ()
    return as_keys(tables, manifest.SessionKeys, MANIFEST, doubts, needed)


def _whisker(keys: manifest.WhiskerKeys | None) -> Whisker | None:
    return None if keys is None else stated_whisker(keys, "[whisker]")


def stated_whisker(keys: manifest.WhiskerKeys, table: str) -> Whisker:
    """The whisker of a table, which messages name so. Raises BadInput for one that cannot be."""
    try:
        whisker = Whisker(
            **{name: getattr(keys, name) for name in manifest.WhiskerKeys.__struct_fields__}
        )
    except ValueError as problem:
        raise BadInput(f"{table} {problem}", file=MANIFEST) from None
    _check_rigidity(whisker, table)
    return whisker


def _check_rigidity(whisker: Whisker, table: str) -> None:
    """Rigidity and diameter must amount to a material. Raises BadInput."""
    modulus_GPa = whisker.implied_modulus_GPa
    if YOUNGS_MODULUS.holds(modulus_GPa):
        return
    in_metres = YOUNGS_MODULUS.holds(modulus_GPa * NMM2_PER_NM2)
    hint = f" Is it in N m2? Then write {whisker.EI_Nmm2 * NMM2_PER_NM2:.6g}." if in_metres else ""
    found = f"flexural_rigidity_Nmm2 and diameter_mm amount to a Young's modulus of {modulus_GPa:.3g} GPa"
    raise BadInput(f"{table} {found}; {YOUNGS_MODULUS.allowed} is allowed.{hint}", file=MANIFEST)


def _board(keys: manifest.BoardKeys | None) -> Board | None:
    if keys is None:
        return None
    try:
        return Board(**values(keys, leave_out=("marker_sigma_mm",)))
    except Refused as problem:
        raise BadInput(f"{problem}", file=MANIFEST) from None


def _pose(rows: list[list[float]] | None) -> np.ndarray | None:
    """T_rig_board with its rotation made exact. Raises BadInput where it is no rotation, or not in mm."""
    if rows is None:
        return None
    pose = np.array(rows, dtype=float)
    rotation, shift_mm = pose[:, :3], np.linalg.norm(pose[:, 3])
    off = np.abs(rotation.T @ rotation - np.eye(3)).max()
    if off > _ROTATION_TOLERANCE or np.linalg.det(rotation) < 0:
        raise BadInput(
            "[rig] T_rig_board: the first three columns are not a right-handed rotation "
            f"(RᵀR is off by {off:.2g}, determinant {np.linalg.det(rotation):.3g})",
            file=MANIFEST,
        )
    if 0 < shift_mm < _NEAREST_BOARD_MM or shift_mm > _FARTHEST_BOARD_MM:
        hint = " Is the last column in metres? It is mm." if shift_mm < _NEAREST_BOARD_MM else ""
        raise BadInput(
            f"[rig] T_rig_board puts the board {shift_mm:.3g} mm from the base.{hint}",
            file=MANIFEST,
        )
    return np.column_stack([nearest_rotation(rotation), pose[:, 3]])


def given_gauges(keys: manifest.GaugeKeys | None) -> GivenGauges | None:
    """Gauges as a table states them; None without one."""
    if keys is None:
        return None
    given = {name: np.array(value) for name, value in values(keys).items() if value is not None}
    exact = {"offset_sigma_V": np.zeros(2), "matrix_sigma_Nmm_per_V": np.zeros((2, 2))}
    return GivenGauges(**exact | given)


def _trials(
    path: Path, keys: manifest.SessionKeys, doubts: Doubts, names: Collection[str] | None
) -> tuple[Trial, ...]:
    found, daq = [], None
    with doubts.guard():
        daq = daq_file(keys.signals, MANIFEST)
    for entry in visible(path / "trials"):
        if entry.is_dir() and (names is None or entry.name in names):
            with doubts.guard():
                found.append(load_trial(entry, keys, doubts, daq))
    return tuple(found)


def _by_surface(trials: Iterable[Trial], order: Sequence[str]) -> tuple[Trial, ...]:
    """The trials in the session's order of surfaces, within one by name; other surfaces after those named."""
    place = {name: k for k, name in enumerate(dict.fromkeys(order))}
    return tuple(sorted(trials, key=lambda trial: place.get(trial.surface, len(place))))


def _check_surfaces(trials: Iterable[Trial], order: Sequence[str], doubts: Doubts) -> None:
    """A surface that no trial has was misspelt, or is not recorded yet."""
    there = {t.surface for t in trials}
    for name in order:
        if there and name not in there:
            found = (
                f"surfaces has {name!r}, which is no trial's; there are {_listed(sorted(there))}"
            )
            doubts.note(Reason("surface_unused", f"{MANIFEST}: {found}"))


def _camera_names(board_sources: dict[str, Path], trials: Iterable[Trial]) -> tuple[str, ...]:
    names = set(board_sources).union(*(t.camera_sources for t in trials))
    return tuple(sorted(names, key=lambda name: natural_order(Path(name))))


def _check_cameras(session: Session, named: list[str], doubts: Doubts, lenses_known: bool) -> None:
    for name in named:
        if session.camera_names and name not in session.camera_names:
            line = f"{MANIFEST}: [[cameras]] {name!r} has no pictures in boards/ or trials/"
            doubts.note(Reason("camera_unused", line))
    for trial in session.trials:
        with doubts.guard():
            _check_trial_cameras(trial, session.camera_names)
    if (
        any(t.camera_sources for t in session.trials)
        and session.cameras_toml is None
        and not lenses_known
    ):
        for name in session.camera_names:
            with doubts.guard():
                _check_camera_boards(session, name)


def _check_trial_cameras(trial: Trial, names: tuple[str, ...]) -> None:
    missing = [name for name in names if name not in trial.camera_sources]
    if trial.camera_sources and missing:
        raise BadInput(
            f"camera {missing[0]} has no frames here, {_listed(trial.camera_sources)} has; add them or leave "
            f"camera {missing[0]} out of the whole session (boards/ and all trials)",
            file=f"trials/{trial.name}",
        )


def _check_camera_boards(session: Session, name: str) -> None:
    """Without cameras.toml a camera is calibrated from its own board views."""
    if session.board is None:
        raise BadInput("[board] is missing, and there is no cameras.toml", file=MANIFEST)
    if name not in session.board_sources:
        raise BadInput(
            f"there are no board views of camera {name}, and no cameras.toml", file=f"boards/{name}"
        )
    if session.T_rig_board is not None and name not in session.rig_pictures:
        raise BadInput(
            f"there is no picture of the board on the rig by camera {name}",
            file=f"boards/rig/{name}",
        )


def _if_there(path: Path) -> Path | None:
    return path if path.is_file() else None


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names) or "none"
