"""One trial of a session: its settings and where its files are. The files are read elsewhere."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.base.statuses import reason
from bench.base.toml_text import read_toml
from bench.session import manifest
from bench.session.daq import DaqFile
from bench.session.file_names import TRIAL_TOML
from bench.session.footage import camera_sources, single_pictures
from bench.session.givens import Given, with_sigmas
from bench.session.stage import STAGE, StageLog, read_stage
from bench.session.stated import StatedSession
from bench.session.strict_toml import as_keys, convert, values
from bench.session.trace_files import IN_SPACE, OBJECT, trace_files
from vision.pictures import PicturePart

SIGNALS = "signals.csv"
# Of a trial of traces alone whose object is placed by a stage or a board on it.
PLACE_UNCHECKED = (
    "nothing checks where along the wire the object is said to stand: traces show no object, and a wrong place "
    f"gives as wrong a d_x; tracked points of it ({OBJECT}<camera>) or pictures would"
)
BOARD = "board_"  # before a camera's name, of a picture of the board on the object


@dataclass(frozen=True, kw_only=True)
class Trial(manifest.TrialKeys):
    """One recording: what trial.toml and [trial] state, and where its files are.

    Nominal values are None where not given, sigmas 0 where exact; first_frame_sigma_s is None where
    the frames say it. bar_diameter_mm: the session's where the trial has no own. camera_sources: camera
    to folder of pictures or video, empty where the trial has none. whisker: of an array, whose
    channels `daq` names; '' where it is the only one. givens: what trial.toml and [trial] state.
    trace_files, object_files: the wire's lines and points of the object by another program, see
    `bench.session.traces`. board_pictures: of a board on the object, by camera.
    stage: what stage.csv says, where the session's truth is a stage's; None elsewhere.
    """

    name: str
    folder: Path
    camera_sources: dict[str, Path | PicturePart]
    signals_path: Path
    daq: DaqFile | None = None
    whisker: str = ""
    givens: tuple[Given, ...] = ()
    trace_files: dict[str, Path] = field(default_factory=dict)
    object_files: dict[str, Path] = field(default_factory=dict)
    board_pictures: dict[str, Path | PicturePart] = field(default_factory=dict)
    stage: StageLog | None = None

    @property
    def is_traced_alone(self) -> bool:
        """Return whether another program's traces are all that is seen of it: they came without pictures."""
        return bool(self.trace_files) and not self.camera_sources

    @property
    def is_seen(self) -> bool:
        """Return whether there are pictures or traces of it."""
        return bool(self.trace_files or self.camera_sources)

    @property
    def cameras(self) -> list[str]:
        """Return the names of the cameras that have pictures or traces of it."""
        traced = [name for name in self.trace_files if name != IN_SPACE]
        return list(self.camera_sources) or traced

    @property
    def shows_board(self) -> bool:
        """Return whether there are pictures of a board on the object, and where it is in that board's frame."""
        is_stated = self.object is not None and self.object.board_point_mm is not None
        return bool(self.board_pictures) and is_stated

    @property
    def states_place(self) -> bool:
        """Return whether trial.toml or stage.csv says where the object stands."""
        has_point = self.object is not None and self.object.point_mm is not None
        return has_point or self.stage is not None

    @property
    def is_bar(self) -> bool:
        """Return whether the object is a straight bar, as far as trial.toml says."""
        return self.object is None or self.object.shape == "bar"

    @property
    def object_stands(self) -> bool:
        """Return whether the object neither moves nor gives way."""
        has_velocity = self.object_velocity_mm_s is not None
        is_moved = self.stage is not None and self.stage.moves
        return not (has_velocity or is_moved or self.object_gives_way)

    @property
    def place(self) -> str:
        """Return how messages name the trial: its path in the session, and the whisker of an array."""
        return f"trials/{self.name}{self._of_whisker}"

    def label(self, file: str) -> str:
        """Return how messages name one of its files: its path, and the whisker of an array."""
        return f"trials/{self.name}/{file}{self._of_whisker}"

    @property
    def _of_whisker(self) -> str:
        """Return what messages say of the whisker; '' where it is the only one."""
        return f" (whisker {self.whisker})" if self.whisker else ""

    def own(self, file: str) -> Path:
        """Return the path of a file of which each whisker of an array has its own.

        It is truth.toml, or truth@NAME.toml.
        """
        stem, _, suffix = file.rpartition(".")
        return self.folder / (f"{stem}@{self.whisker}.{suffix}" if self.whisker else file)


def load_trial(
    folder: Path,
    session: StatedSession,
    problems: InputProblems,
    daq: DaqFile | None = None,
) -> Trial:
    """Read trial.toml over the session's defaults and find the trial's files. Raises BadInput.

    daq: of [signals].
    """
    place = f"trials/{folder.name}"
    label = f"{place}/{TRIAL_TOML}"
    table = _trial_table(folder, session.trial_table, label, problems)
    table, givens = with_sigmas(table, manifest.TrialKeys, "[trial]", exact=session.keys.exact)
    keys = convert(table, manifest.TrialKeys)
    _check_keys(keys, label)
    settings = values(keys) | _bar_diameter(keys, session.keys.bar)
    if keys.object is not None:
        _check_object(keys.object, settings["bar_diameter_mm"], label)
    trial = Trial(
        name=folder.name,
        folder=folder,
        camera_sources=camera_sources(folder, place),
        signals_path=_signals_path(folder, daq, place),
        daq=daq,
        givens=givens,
        trace_files=trace_files(folder, place),
        object_files=trace_files(folder, place, OBJECT),
        board_pictures=single_pictures(folder, place, BOARD),
        **settings,
    )
    if session.keys.truth is None:
        _warn_of_unread_stage(trial, problems)
    else:
        trial = _with_stage(trial, table, place)
    if trial.is_traced_alone:
        _check_traced_alone(trial)
    else:
        _warn_of_unread_object(trial, problems)
    return trial


def require_object_placed(trial: Trial, *, has_points: bool, is_stated: bool) -> None:
    """Raise BadInput where nothing places the object of a trial that has traces and no pictures.

    has_points: whether points of it are tracked. is_stated: whether the session's truth is a stage's.
    """
    if has_points or trial.shows_board or (is_stated and trial.states_place):
        return
    found = "there are no pictures, in which the object is found, and nothing else says where it is"
    cure = (
        f"add its points ({OBJECT}<camera>.csv, or joints bar_… in the trace), pictures of a board on it "
        f'({BOARD}<camera>.png, board_point_mm), or its place by a stage ([truth] source = "stage")'
    )
    raise BadInput(f"{found}; {cure}", file=_first_trace(trial))


def _first_trace(trial: Trial) -> str:
    """Return how messages name the first of the trial's traces."""
    return trial.label(next(iter(trial.trace_files.values())).name)


def _check_traced_alone(trial: Trial) -> None:
    """Raise BadInput for an object that a trial of traces without pictures cannot have."""
    label = _first_trace(trial)
    if not trial.object_stands:
        raise BadInput("traces without pictures need an object that stands", file=label)
    if not trial.is_bar:
        found = f"traces without pictures need a straight bar; [object] is a {trial.object.shape}"
        raise BadInput(found, file=label)


def _signals_path(folder: Path, daq: DaqFile | None, place: str) -> Path:
    """Return the path of the trial's signals. Raises BadInput where there is no such file."""
    path = folder / (daq.file if daq else SIGNALS)
    if not path.is_file():
        raise BadInput("is not there; a trial needs its signals", file=f"{place}/{path.name}")
    return path


def _with_stage(trial: Trial, table: dict, place: str) -> Trial:
    """Return the trial with the log of its stage, of a session whose truth is stated. Raises BadInput."""
    trial = replace(trial, stage=read_stage(trial.folder, trial.folder.parents[1], place))
    _check_stated_truth(trial, table)
    return trial


def _warn_of_unread_stage(trial: Trial, problems: InputProblems) -> None:
    """Warn of a stage.csv that no key of session.toml asks for."""
    if (trial.folder / STAGE).is_file():
        cure = 'write [truth] source = "stage" in session.toml'
        problems.warn(reason("stage_not_read", label=trial.label(STAGE), cure=cure))


def _warn_of_unread_object(trial: Trial, problems: InputProblems) -> None:
    """Warn of files on where the object is, of a trial whose pictures show it."""
    for path in (*trial.object_files.values(), *trial.board_pictures.values()):
        problems.warn(reason("object_points_not_read", label=trial.label(path.name)))


def _check_stated_truth(trial: Trial, table: dict[str, Any]) -> None:
    """Raise BadInput where what trial.toml states is no truth. table: the keys that it states."""
    label = trial.label(TRIAL_TOML)
    moves = trial.object_velocity_mm_s is not None and any(trial.object_velocity_mm_s)
    if trial.states_place:
        _check_place(trial, label)
        if moves and (trial.stage is None or not trial.stage.moves):
            found = "object_velocity_mm_s says that the object moves"
            if trial.stage is None:
                raise BadInput(f"{found}; write its places into {STAGE}", file=label)
            raise BadInput(f"is one place at all times, and {found}", file=trial.stage.label)
    elif trial.d_x_mm is not None and "d_x_sigma_mm" not in table and not table.get("exact"):
        found = "d_x_mm is the truth here, and d_x_sigma_mm is missing"
        raise BadInput(f"{found}; write one sigma, 0 where it is exact", file=label)
    is_turned = trial.object is not None and trial.object.axis is not None
    has_slope = is_turned or (trial.states_place and not trial.is_bar)
    if trial.purpose == "measure" and trial.beta_deg is None and not has_slope:
        found = "beta_deg is missing: the truth of a stage needs the bar's slope"
        raise BadInput(f"{found}, 0 where it is upright", file=label)


def _check_place(trial: Trial, label: str) -> None:
    """Raise BadInput for an object whose contact does not follow from its place."""
    if trial.bar_diameter_mm is None:
        raise BadInput("bar_diameter_mm is missing: d_x follows from place and size", file=label)
    if trial.angle_from != "log":
        given = f'angle_from = "{trial.angle_from}" gives the motor no zero in the rig'
        found = f"{given}, so a place does not say when it is touched"
        raise BadInput(f"{found}; state d_x_mm, and no place", file=label)


def _check_keys(keys: manifest.TrialKeys, label: str) -> None:
    """Raise BadInput for a weight without force or place, and an object that moves and gives way."""
    if keys.purpose == "weight" and None in (keys.force_N, keys.at_mm):
        raise BadInput('purpose = "weight" needs force_N and at_mm', file=label)
    if keys.object_gives_way and keys.object_velocity_mm_s is not None:
        found = "an object that moves does not give way, too; leave out object_velocity_mm_s"
        raise BadInput(f"object_gives_way: {found}", file=label)


def _trial_table(
    folder: Path, defaults: dict[str, Any], label: str, problems: InputProblems
) -> dict[str, Any]:
    """Return the checked table of trial.toml, with absent keys from the session's [trial].

    A sigma comes from where its value comes from.
    """
    file = folder / TRIAL_TOML
    if not file.is_file():
        return defaults
    own = read_toml(file, label)
    as_keys(own, manifest.TrialKeys, label, problems)
    elsewhere = {manifest.sigma_key(key) for key in own}
    kept = {key: value for key, value in defaults.items() if key not in elsewhere}
    return kept | own


def _check_object(keys: manifest.ObjectKeys, thickness_mm: float | None, label: str) -> None:
    """Raise BadInput for an impossible object. thickness_mm: bar_diameter_mm."""
    for key, shape in manifest.shape_of_size().items():
        if (keys.shape == shape) != (getattr(keys, key) is not None):
            found = f'{key} belongs to shape = "{shape}", and to no other shape'
            raise BadInput(f"[object] {found}", file=label)
    if keys.axis is not None and not any(keys.axis):
        raise BadInput("[object] axis is a direction, not zero", file=label)
    if keys.point_mm is None and (keys.axis is not None or keys.point_sigma_mm):
        found = "says how it stands, and not where; point_mm is missing"
        raise BadInput(f"[object] {found}", file=label)
    _check_board_on_object(keys, label)
    ring_mm = keys.ring_diameter_mm
    if ring_mm is not None and thickness_mm is not None and ring_mm <= thickness_mm:
        found = (
            f"ring_diameter_mm is {ring_mm:g}, of a bar of {thickness_mm:g} mm (bar_diameter_mm)"
        )
        meant = "it is the diameter along the bar's middle, and larger"
        raise BadInput(f"[object] {found}; {meant}", file=label)


def _check_board_on_object(keys: manifest.ObjectKeys, label: str) -> None:
    """Raise BadInput for a board on the object that does not say how the object stands."""
    if (keys.board_point_mm is None) != (keys.board_axis is None):
        raise BadInput("[object] board_point_mm and board_axis go together", file=label)
    if keys.board_axis is not None and not any(keys.board_axis):
        raise BadInput("[object] board_axis is a direction, not zero", file=label)


def _bar_diameter(keys: manifest.TrialKeys, bar: manifest.BarKeys | None) -> dict[str, float]:
    """Return the trial's own bar diameter with its sigma, else the session's."""
    if keys.bar_diameter_mm is not None or bar is None:
        return {}
    return {
        "bar_diameter_mm": bar.diameter_mm,
        "bar_diameter_sigma_mm": bar.diameter_sigma_mm,
    }
