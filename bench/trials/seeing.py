"""Settings of the evaluation of pictures: two named presets, and files with any other setting."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.base.settings import Seeing, Settings
from bench.base.toml_text import read_toml
from bench.session.plausible import PlausibleRange
from bench.session.strict_toml import Keys, as_keys, plausible_ranges, values
from vision.geometry import VisionSettings

# The second has what the first leaves out. What it costs and how wrong it is, `tradeoff` measures.
PRESETS = {
    "draft": VisionSettings(rounds=0, every_frame=2, check_beam=False),
    "standard": VisionSettings(),
}
STANDARD = "standard"
_OWN_TABLE = "seeing"


@dataclass(frozen=True, kw_only=True)
class SeeingKeys(Keys):
    """Table [seeing] of a settings file; the preset has what is not given."""

    preset: str = STANDARD
    cameras: tuple[str, ...] = ()
    rounds: Annotated[int, PlausibleRange(0, 5)] | None = None
    every_frame: Annotated[int, PlausibleRange(1, 20)] | None = None
    picture_scale: Annotated[int, PlausibleRange(1, 8)] | None = None
    wire_piece_px: Annotated[int, PlausibleRange(4, 60)] | None = None
    bar_piece_px: Annotated[int, PlausibleRange(4, 60)] | None = None
    bar_reach_mm: Annotated[float, PlausibleRange(10.0, 200.0)] | None = None
    check_beam: bool | None = None


@dataclass(frozen=True, kw_only=True)
class SettingsFile(Keys):
    """A settings file, which `evaluate --settings` reads and `tradeoff` writes."""

    seeing: SeeingKeys = SeeingKeys()


def by_preset(name: str) -> Seeing:
    """Return the settings of a preset. Raise BadInput for a name that is none."""
    if name not in PRESETS:
        raise BadInput(f"--preset {name}: there are {', '.join(PRESETS)}")
    return Seeing(name, PRESETS[name])


def from_file(path: Path) -> Seeing:
    """Return the settings of a TOML file. Raise BadInput, naming the key that is wrong."""
    keys = as_keys(read_toml(path, path.name), SettingsFile, path.name, InputProblems()).seeing
    given = {}
    for name, value in values(keys, ("preset", "cameras")).items():
        if value is not None:
            given[name] = value
    base = by_preset(keys.preset)
    return Seeing(path.name if given else base.name, replace(base.vision, **given), keys.cameras)


def presets_for(settings: Settings) -> list[Seeing]:
    """Return the settings to try on a whisk, one after another until d_x is exact enough."""
    if settings.accuracy_mm is None:
        return [settings.seeing]
    return [replace(by_preset(name), cameras=settings.seeing.cameras) for name in PRESETS]


def as_toml(seeing: Seeing) -> str:
    """Return the settings as a file that `from_file` reads."""
    lines = [f"[{_OWN_TABLE}]"]
    if seeing.cameras:
        names = ", ".join(f'"{name}"' for name in seeing.cameras)
        lines.append(f"cameras = [{names}]")
    for name in plausible_ranges(SeeingKeys):
        lines.append(f"{name} = {getattr(seeing.vision, name):g}")
    lines.append(f"check_beam = {str(seeing.vision.check_beam).lower()}")
    return "\n".join(lines) + "\n"
