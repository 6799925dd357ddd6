"""How hard pictures are looked at: three named rungs of one ladder, and files with any other setting."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import msgspec

from bench.base.doubts import Doubts
from bench.base.errors import BadInput
from bench.base.settings import Seeing, Settings
from bench.session.plausible import PlausibleRange
from bench.session.strict_toml import Keys, as_keys, plausible_ranges, read_toml, values
from vision.geometry.vision_settings import VisionSettings

# Each rung has what the one before leaves out. What a rung costs and how wrong it is, `tradeoff` measures.
PRESETS = {
    "draft": VisionSettings(rounds=0, every_frame=2, check_beam=False),
    "standard": VisionSettings(),
    "fine": VisionSettings(rounds=2),
}
STANDARD = "standard"
_OWN_TABLE = "seeing"


class SeeingKeys(Keys, kw_only=True):
    """[seeing] of a settings file. What is not given goes by the preset."""

    preset: str = STANDARD
    cameras: tuple[str, ...] = ()
    rounds: Annotated[int, PlausibleRange(0, 5)] | None = None
    every_frame: Annotated[int, PlausibleRange(1, 20)] | None = None
    picture_scale: Annotated[int, PlausibleRange(1, 8)] | None = None
    wire_piece_px: Annotated[int, PlausibleRange(4, 60)] | None = None
    bar_piece_px: Annotated[int, PlausibleRange(4, 60)] | None = None
    bar_reach_mm: Annotated[float, PlausibleRange(10.0, 200.0)] | None = None
    check_beam: bool | None = None


class SettingsFile(Keys, kw_only=True):
    """A settings file: what `evaluate --settings` reads and `tradeoff` writes."""

    seeing: SeeingKeys = msgspec.field(default_factory=SeeingKeys)


def by_preset(name: str) -> Seeing:
    """The settings of a rung. Raises BadInput for a name that is none."""
    if name not in PRESETS:
        raise BadInput(f"--preset {name}: there are {', '.join(PRESETS)}")
    return Seeing(name, PRESETS[name])


def from_file(path: Path) -> Seeing:
    """The settings of a TOML file. Raises BadInput, naming the key that is wrong."""
    keys = as_keys(read_toml(path, path.name), SettingsFile, path.name, Doubts()).seeing
    given = {
        name: value
        for name, value in values(keys, ("preset", "cameras")).items()
        if value is not None
    }
    base = by_preset(keys.preset)
    return Seeing(path.name if given else base.name, replace(base.vision, **given), keys.cameras)


def rungs(settings: Settings) -> list[Seeing]:
    """What is tried on a whisk, one after another until its d_x is known as well as asked."""
    if settings.accuracy_mm is None:
        return [settings.seeing]
    return [replace(by_preset(name), cameras=settings.seeing.cameras) for name in PRESETS]


def as_toml(seeing: Seeing) -> str:
    """The settings as a file that `from_file` reads."""
    lines = [f"[{_OWN_TABLE}]"]
    if seeing.cameras:
        lines.append(
            f"cameras = [{', '.join(f'{name!r}'.replace(chr(39), chr(34)) for name in seeing.cameras)}]"
        )
    for name in [*plausible_ranges(SeeingKeys), "check_beam"]:
        value = getattr(seeing.vision, name)
        lines.append(f"{name} = {str(value).lower() if isinstance(value, bool) else f'{value:g}'}")
    return "\n".join(lines) + "\n"
