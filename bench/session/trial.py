"""One trial of a session: its settings and where its files are. The files themselves are read elsewhere."""

from dataclasses import dataclass
from pathlib import Path

from bench.base.doubts import Doubts
from bench.base.errors import BadInput
from bench.session import manifest
from bench.session.daq import DaqFile
from bench.session.footage import camera_sources
from bench.session.strict_toml import as_keys, read_toml, values

MANIFEST = "trial.toml"
SIGNALS = "signals.csv"
_UPRIGHT = (0.0, 0.0, 1.0)  # axis of an object that stands somewhere, where it is not said


@dataclass(frozen=True)
class StatedObject:
    """What the object is, and where it stands in the rig frame, with one sigma of each coordinate; None where that is
    not said. point_mm (3,): of a bar's axis, the centre of a ring or sphere, or a cone's tip; axis (3,): the bar's
    direction, the normal of the ring's plane, or where the cone points."""

    shape: str
    point_mm: tuple[float, ...] | None
    point_sigma_mm: float
    axis: tuple[float, ...] | None
    ring_diameter_mm: float | None
    half_angle_deg: float | None = None


@dataclass(frozen=True)
class Trial:
    """Settings of one recording; nominal values are None where not given, sigmas 0 where taken as exact.

    purpose: "measure", "gauge" or "weight" (then force_N hung at_mm from the base). follicle_roll_deg: how
    the follicle was turned about the whisker. both_ways: each way back is evaluated, too. object_velocity_mm_s: (3,) in
    the rig frame, of an object that moves at constant speed, with one sigma each way. object_gives_way: it moves as
    it is pushed. camera_sources: camera to folder of pictures or video, empty where the trial has none. whisker: of an
    array, whose channels `daq` names; '' where it is the only one.
    """

    name: str
    folder: Path
    camera_sources: dict[str, Path]
    signals_path: Path
    surface: str
    purpose: str
    speed_deg_s: float | None
    speed_sigma_deg_s: float
    beta_deg: float | None
    beta_sigma_deg: float
    d_x_mm: float | None
    d_x_sigma_mm: float
    bar_diameter_mm: float
    bar_diameter_sigma_mm: float
    follicle_roll_deg: float
    follicle_roll_sigma_deg: float
    force_N: float | None
    force_sigma_N: float
    at_mm: float | None
    at_sigma_mm: float
    frame_rate_Hz: float | None
    frame_rate_sigma_Hz: float
    first_frame_s: float | None
    first_frame_sigma_s: float
    gauge_filter_Hz: float | None
    object: StatedObject | None = None
    both_ways: bool = False
    object_velocity_mm_s: list[float] | None = None
    object_velocity_sigma_mm_s: float = 0.0
    object_gives_way: bool = False
    daq: DaqFile | None = None
    whisker: str = ""

    @property
    def is_bar(self) -> bool:
        """Whether the object is a straight bar, as far as trial.toml says."""
        return self.object is None or self.object.shape == "bar"

    @property
    def place(self) -> str:
        """How messages name it: by the path inside the session, and the whisker of an array."""
        return f"trials/{self.name}{self._of_whisker}"

    def shown(self, file: str) -> str:
        """How messages name one of its files, likewise."""
        return f"trials/{self.name}/{file}{self._of_whisker}"

    @property
    def _of_whisker(self) -> str:
        return f" (whisker {self.whisker})" if self.whisker else ""

    def own(self, file: str) -> Path:
        """The path of a file that each whisker of an array has its own of: truth.toml, or truth@NAME.toml."""
        stem, _, suffix = file.rpartition(".")
        return self.folder / (f"{stem}@{self.whisker}.{suffix}" if self.whisker else file)


def load_trial(
    folder: Path, session: manifest.SessionKeys, doubts: Doubts, daq: DaqFile | None = None
) -> Trial:
    """Read trial.toml over the session's defaults and find the trial's files. Raises BadInput. daq: of [signals]."""
    shown = f"trials/{folder.name}"
    keys = _trial_keys(folder, session.trial, f"{shown}/{MANIFEST}", doubts)
    _check_weight(keys, f"{shown}/{MANIFEST}")
    _check_motion(keys, f"{shown}/{MANIFEST}")
    signals_path = folder / (daq.file if daq else SIGNALS)
    if not signals_path.is_file():
        raise BadInput(
            "is not there; a trial needs its signals", file=f"{shown}/{signals_path.name}"
        )
    trial = Trial(
        name=folder.name,
        folder=folder,
        camera_sources=camera_sources(folder, shown),
        signals_path=signals_path,
        daq=daq,
        **values(keys)
        | _bar(keys, session.bar)
        | {"object": _object(keys.object, f"{shown}/{MANIFEST}")},
    )
    _check_size(trial, f"{shown}/{MANIFEST}")
    return trial


def _check_size(trial: Trial, shown: str) -> None:
    """Raises BadInput for an object that is no straight bar and as said cannot be."""
    if trial.is_bar:
        return
    thick, wide = trial.bar_diameter_mm, trial.object.ring_diameter_mm
    if wide is not None and thick is not None and wide <= thick:
        found = f"[object] ring_diameter_mm is {wide:g}, of a bar of {thick:g} mm (bar_diameter_mm)"
        raise BadInput(
            f"{found}; it is the diameter along the bar's middle, and larger", file=shown
        )


def _trial_keys(
    folder: Path, defaults: manifest.TrialKeys, shown: str, doubts: Doubts
) -> manifest.TrialKeys:
    """trial.toml, absent keys from the session's [trial]; a sigma comes from where its value comes from."""
    file = folder / MANIFEST
    if not file.is_file():
        return defaults
    given = read_toml(file, shown)
    own = as_keys(given, manifest.TrialKeys, shown, doubts)
    decided = set(given) | {manifest.sigma_key(key) for key in given}
    return manifest.TrialKeys(
        **{name: value for name, value in values(own).items() if name in decided}
        | {name: value for name, value in values(defaults).items() if name not in decided}
    )


def _check_weight(keys: manifest.TrialKeys, shown: str) -> None:
    if keys.purpose == "weight" and None in (keys.force_N, keys.at_mm):
        raise BadInput('purpose = "weight" needs force_N and at_mm', file=shown)


def _check_motion(keys: manifest.TrialKeys, shown: str) -> None:
    if keys.object_gives_way and keys.object_velocity_mm_s is not None:
        found = "an object that moves does not give way, too; leave out object_velocity_mm_s"
        raise BadInput(f"object_gives_way: {found}", file=shown)


def _object(keys: manifest.ObjectKeys | None, shown: str) -> StatedObject | None:
    """Raises BadInput for one that cannot be."""
    if keys is None:
        return None
    for key, shape in (("ring_diameter_mm", "ring"), ("half_angle_deg", "cone")):
        if (keys.shape == shape) != (getattr(keys, key) is not None):
            raise BadInput(
                f'[object] {key} belongs to shape = "{shape}", and to no other shape', file=shown
            )
    if keys.axis is not None and not any(keys.axis):
        raise BadInput("[object] axis is a direction, not zero", file=shown)
    sizes = keys.ring_diameter_mm, keys.half_angle_deg
    if keys.point_mm is None:
        if keys.axis is not None or keys.point_sigma_mm:
            raise BadInput(
                "[object] says how it stands, and not where; point_mm is missing", file=shown
            )
        return StatedObject(keys.shape, None, 0.0, None, *sizes)
    point, axis = tuple(keys.point_mm), tuple(keys.axis or _UPRIGHT)
    return StatedObject(keys.shape, point, keys.point_sigma_mm, axis, *sizes)


def _bar(keys: manifest.TrialKeys, bar: manifest.BarKeys | None) -> dict[str, float | None]:
    """The trial's own bar diameter with its sigma, else the session's."""
    if keys.bar_diameter_mm is not None:
        return {
            "bar_diameter_mm": keys.bar_diameter_mm,
            "bar_diameter_sigma_mm": keys.bar_diameter_sigma_mm,
        }
    return {
        "bar_diameter_mm": bar and bar.diameter_mm,
        "bar_diameter_sigma_mm": bar.diameter_sigma_mm if bar else 0.0,
    }
