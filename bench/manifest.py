"""session.toml and trial.toml as people write them: strict types, no unknown keys, plausible values."""

import difflib
import re
import tomllib
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import msgspec

from bench import plausible
from bench.errors import BadInput

Row3 = Annotated[list[float], msgspec.Meta(min_length=3, max_length=3)]
Row4 = Annotated[list[float], msgspec.Meta(min_length=4, max_length=4)]
Pair = Annotated[list[float], msgspec.Meta(min_length=2, max_length=2)]


class Keys(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """One table of a manifest. `windows` says what is plausible for its keys; sigmas are never negative."""

    windows: ClassVar[dict[str, plausible.Window]] = {}


class WhiskerKeys(Keys, kw_only=True):
    shape: Literal["cylinder", "cone"] = "cylinder"
    length_mm: float
    length_sigma_mm: float = 0.0
    diameter_mm: float
    diameter_sigma_mm: float = 0.0
    youngs_modulus_GPa: float | None = None
    youngs_modulus_sigma_GPa: float = 0.0
    flexural_rigidity_Nmm2: float | None = None
    flexural_rigidity_sigma_Nmm2: float = 0.0

    windows: ClassVar = {
        "length_mm": plausible.LENGTH,
        "diameter_mm": plausible.THICKNESS,
        "youngs_modulus_GPa": plausible.YOUNGS_MODULUS,
        "flexural_rigidity_Nmm2": plausible.RIGIDITY,
    }


class BarKeys(Keys, kw_only=True):
    diameter_mm: float
    diameter_sigma_mm: float = 0.0

    windows: ClassVar = {"diameter_mm": plausible.WIDTH}


class BoardKeys(Keys, kw_only=True):
    squares: Annotated[list[int], msgspec.Meta(min_length=2, max_length=2)]
    square_mm: float
    square_sigma_mm: float = 0.0
    marker_mm: float
    marker_sigma_mm: float = 0.0
    dictionary: str
    legacy: bool = False
    inverted: bool = False

    windows: ClassVar = {
        "square_mm": plausible.WIDTH,
        "marker_mm": plausible.WIDTH,
    }


class RigKeys(Keys, kw_only=True):
    T_rig_board: Annotated[list[Row4], msgspec.Meta(min_length=3, max_length=3)] | None = None
    T_rig_board_sigma_mm: float = 0.0
    T_rig_board_sigma_deg: float = 0.0


class CameraKeys(Keys, kw_only=True):
    name: str
    exposure_s: float | None = None
    exposure_sigma_s: float = 0.0

    windows: ClassVar = {"exposure_s": plausible.EXPOSURE}


class GaugeKeys(Keys, kw_only=True):
    offset_V: Pair
    offset_sigma_V: Pair | None = None
    matrix_Nmm_per_V: Annotated[list[Pair], msgspec.Meta(min_length=2, max_length=2)]
    matrix_sigma_Nmm_per_V: Annotated[list[Pair], msgspec.Meta(min_length=2, max_length=2)] | None = None


class TrialKeys(Keys, kw_only=True):
    surface: str = ""
    speed_deg_s: float | None = None
    speed_sigma_deg_s: float = 0.0
    beta_deg: float | None = None
    beta_sigma_deg: float = 0.0
    d_x_mm: float | None = None
    d_x_sigma_mm: float = 0.0
    bar_diameter_mm: float | None = None
    bar_diameter_sigma_mm: float = 0.0
    purpose: Literal["measure", "gauge", "weight"] = "measure"
    force_N: float | None = None
    force_sigma_N: float = 0.0
    at_mm: float | None = None
    at_sigma_mm: float = 0.0
    frame_rate_Hz: float | None = None
    frame_rate_sigma_Hz: float = 0.0
    first_frame_s: float | None = None
    first_frame_sigma_s: float = 0.0
    follicle_roll_deg: float = 0.0
    follicle_roll_sigma_deg: float = 0.0

    windows: ClassVar = {
        "speed_deg_s": plausible.SPEED,
        "beta_deg": plausible.SLOPE,
        "d_x_mm": plausible.LENGTH,
        "bar_diameter_mm": BarKeys.windows["diameter_mm"],
        "force_N": plausible.FORCE,
        "at_mm": plausible.LENGTH,
        "frame_rate_Hz": plausible.RATE,
        "first_frame_s": plausible.CLOCK,
        "follicle_roll_deg": plausible.ANGLE,
    }


class SessionKeys(Keys, kw_only=True):
    format: int
    name: str = ""
    whisker: WhiskerKeys | None = None
    bar: BarKeys | None = None
    board: BoardKeys | None = None
    rig: RigKeys = RigKeys()
    cameras: list[CameraKeys] = []
    gauges: GaugeKeys | None = None
    signals: dict[str, Any] | None = None
    trial: TrialKeys = TrialKeys()


def read_toml(path: Path, shown: str) -> dict[str, Any]:
    """The tables of a TOML file. Raises BadInput, naming the file as `shown`, where it is not one."""
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as problem:
        raise BadInput(f"cannot be read ({problem.strerror})", file=shown) from None
    except UnicodeDecodeError:
        raise BadInput("is not UTF-8 text; save it as UTF-8", file=shown) from None
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as problem:
        raise _bad_toml(str(problem), text, shown) from None


def _bad_toml(problem: str, text: str, shown: str) -> BadInput:
    place = re.search(r"line (\d+)", problem)
    if not place:
        return BadInput(f"is not TOML: {problem}", file=shown)
    row = int(place.group(1))
    line = text.splitlines()[row - 1].strip()
    if re.search(r"=\s*-?\d+,\d", line):
        return BadInput(f"found {line!r}; a decimal comma? Write a point.", file=shown, row=row)
    return BadInput(f"is not TOML: {problem}; found {line!r}", file=shown, row=row)


def as_keys(tables: dict[str, Any], kind: type[Keys], shown: str) -> Keys:
    """Check tables against `kind`: names, types, plausible values. Raises BadInput with the key's path."""
    try:
        keys = msgspec.convert(tables, kind, strict=True)
    except msgspec.ValidationError as problem:
        raise BadInput(_in_plain_words(str(problem), kind), file=shown) from None
    _check_values(keys, "", shown)
    return keys


def values(keys: Keys, leave_out: tuple[str, ...] = ()) -> dict[str, Any]:
    """A table's values by key."""
    return {name: getattr(keys, name) for name in keys.__struct_fields__ if name not in leave_out}


def sigma_key(key: str) -> str:
    """The key of a value's standard deviation, or '' for a key that has none: 'd_x_mm' -> 'd_x_sigma_mm'."""
    names = (n for n in TrialKeys.__struct_fields__ if "_sigma_" in n and n.replace("_sigma_", "_") == key)
    return next(names, "")


def _check_values(keys: Keys, table: str, shown: str) -> None:
    for name in keys.__struct_fields__:
        value = getattr(keys, name)
        if isinstance(value, Keys):
            _check_values(value, f"[{name}] ", shown)
        elif name == "cameras":
            for camera in value:
                _check_values(camera, f"[[cameras]] {camera.name}: ", shown)
        elif value is not None:
            _check_value(value, name, keys.windows.get(name), table, shown)


def _check_value(value: Any, name: str, window: plausible.Window | None, table: str, shown: str) -> None:
    if "_sigma_" in name:
        window = plausible.SIGMA
    for number in _numbers(value):
        (window or plausible.CLOCK).check(number, table + name, shown)
    if name in ("beta_deg", "follicle_roll_deg") and plausible.looks_like_radians(value):
        degrees = value * plausible.DEGREES_PER_RADIAN
        raise BadInput(f"{table}{name} is {value:g}. Is it in radians? Then write {degrees:.4g}.", file=shown)


def _numbers(value: Any) -> list[float]:
    if isinstance(value, list):
        return [number for item in value for number in _numbers(item)]
    return [float(value)] if isinstance(value, int | float) and not isinstance(value, bool) else []


def _in_plain_words(problem: str, kind: type[Keys]) -> str:
    """msgspec's message with the key's path as in the file, and the likely meant key."""
    what, _, place = problem.partition(" - at `$")
    path = [part for part in re.split(r"[.`]", place) if part]
    if unknown := re.match(r"Object contains unknown field `(.*)`", what):
        return _unknown_key(unknown.group(1), path, kind)
    if missing := re.match(r"Object missing required field `(.*)`", what):
        return f"{_key_path([*path, missing.group(1)])} is missing"
    return f"{_key_path(path)}: {_what_is_wrong(what)}"


def _what_is_wrong(what: str) -> str:
    """msgspec's "Expected `float | null`, got `str`" in the words of a person who writes TOML."""
    if choice := re.match(r"Invalid enum value (.*)", what):
        return f"{choice.group(1)} is none of its values"
    words = {"float": "a number", "int": "a whole number", "str": "text", "bool": "true or false", "null": "nothing"}
    found = re.sub(r"`([^`]*)`", lambda m: words.get(m.group(1).removesuffix(" | null"), m.group(1)), what)
    return found.replace("Expected", "expected").replace("got", "found")


def _key_path(path: list[str]) -> str:
    """['board', 'square_mm'] -> '[board] square_mm'; ['cameras[0]', 'name'] -> '[[cameras]] name'."""
    *tables, key = path
    return " ".join([*(_table(name) for name in tables), key])


def _table(name: str) -> str:
    listed = re.fullmatch(r"(\w+)\[(\d+|\.*)\]", name)
    return f"[[{listed.group(1)}]]" if listed else f"[{name}]"


def _unknown_key(key: str, path: list[str], kind: type[Keys]) -> str:
    allowed = _tables(kind)[re.sub(r"\W.*", "", path[0]) if path else ""].__struct_fields__
    near = difflib.get_close_matches(key, allowed, n=1, cutoff=0.6)
    places = [table for table, other in _tables(kind).items() if table and key in other.__struct_fields__]
    if near:
        hint = f"did you mean {near[0]!r}?"
    elif places:
        hint = f"it belongs in [{places[0]}]."
    else:
        hint = f"allowed are {', '.join(a for a in allowed if '_sigma_' not in a)}."
    return f"{_key_path([*path, key])} is not a key of this file; {hint}"


def _tables(kind: type[Keys]) -> dict[str, type[Keys]]:
    """The tables of a manifest by name; '' is its top level."""
    inner = {
        "whisker": WhiskerKeys, "bar": BarKeys, "board": BoardKeys, "rig": RigKeys, "cameras": CameraKeys,
        "gauges": GaugeKeys, "trial": TrialKeys,
    }  # fmt: skip
    return {"": kind} | (inner if kind is SessionKeys else {})
