"""One trial of a session: its settings and where its files are. The files are read elsewhere."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.session import manifest
from bench.session.daq import DaqFile
from bench.session.footage import camera_sources
from bench.session.givens import Given, with_sigmas
from bench.session.stated import StatedSession
from bench.session.strict_toml import as_keys, convert, read_toml, values
from bench.session.trace_files import trace_files
from vision.pictures import PicturePart

MANIFEST = "trial.toml"
SIGNALS = "signals.csv"
_UPRIGHT = (0.0, 0.0, 1.0)  # axis of an object that stands somewhere, where it is not stated


@dataclass(frozen=True, kw_only=True)
class Trial(manifest.TrialKeys):
    """One recording: what trial.toml and [trial] state, and where its files are.

    Nominal values are None where not given, sigmas 0 where exact; first_frame_sigma_s is None where
    the frames say it. bar_diameter_mm: the session's where the trial has no own. camera_sources: camera
    to folder of pictures or video, empty where the trial has none. whisker: of an array, whose
    channels `daq` names; '' where it is the only one. givens: what trial.toml and [trial] state.
    trace_files: the wire's lines by another program, see `bench.session.traces`.
    """

    name: str
    folder: Path
    camera_sources: dict[str, Path | PicturePart]
    signals_path: Path
    daq: DaqFile | None = None
    whisker: str = ""
    givens: tuple[Given, ...] = ()
    trace_files: dict[str, Path] = field(default_factory=dict)

    @property
    def is_bar(self) -> bool:
        """Return whether the object is a straight bar, as far as trial.toml says."""
        return self.object is None or self.object.shape == "bar"

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
    label = f"{place}/{MANIFEST}"
    table = _trial_table(folder, session.trial_table, label, problems)
    table, givens = with_sigmas(table, manifest.TrialKeys, "[trial]", exact=session.keys.exact)
    keys = convert(table, manifest.TrialKeys)
    _check_keys(keys, label)
    signals_path = folder / (daq.file if daq else SIGNALS)
    if not signals_path.is_file():
        found = "is not there; a trial needs its signals"
        raise BadInput(found, file=f"{place}/{signals_path.name}")
    settings = values(keys) | _bar_diameter(keys, session.keys.bar)
    settings["object"] = _stated_object(keys.object, settings["bar_diameter_mm"], label)
    return Trial(
        name=folder.name,
        folder=folder,
        camera_sources=camera_sources(folder, place),
        signals_path=signals_path,
        daq=daq,
        givens=givens,
        trace_files=trace_files(folder, place),
        **settings,
    )


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
    file = folder / MANIFEST
    if not file.is_file():
        return defaults
    own = read_toml(file, label)
    as_keys(own, manifest.TrialKeys, label, problems)
    elsewhere = {manifest.sigma_key(key) for key in own}
    kept = {key: value for key, value in defaults.items() if key not in elsewhere}
    return kept | own


def _stated_object(
    keys: manifest.ObjectKeys | None, thickness_mm: float | None, label: str
) -> manifest.ObjectKeys | None:
    """Return the object of trial.toml; None where there is none. Raise BadInput for an impossible one.

    One that stands somewhere, and says not how, stands upright. thickness_mm: bar_diameter_mm.
    """
    if keys is None:
        return None
    _check_object(keys, thickness_mm, label)
    if keys.point_mm is not None and keys.axis is None:
        return replace(keys, axis=list(_UPRIGHT))
    return keys


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
    ring_mm = keys.ring_diameter_mm
    if ring_mm is not None and thickness_mm is not None and ring_mm <= thickness_mm:
        found = (
            f"ring_diameter_mm is {ring_mm:g}, of a bar of {thickness_mm:g} mm (bar_diameter_mm)"
        )
        meant = "it is the diameter along the bar's middle, and larger"
        raise BadInput(f"[object] {found}; {meant}", file=label)


def _bar_diameter(keys: manifest.TrialKeys, bar: manifest.BarKeys | None) -> dict[str, float]:
    """Return the trial's own bar diameter with its sigma, else the session's."""
    if keys.bar_diameter_mm is not None or bar is None:
        return {}
    return {
        "bar_diameter_mm": bar.diameter_mm,
        "bar_diameter_sigma_mm": bar.diameter_sigma_mm,
    }
