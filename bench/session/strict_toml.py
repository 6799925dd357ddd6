"""TOML files of people: every unknown key named with the one likely meant, every type and value checked."""

import difflib
import re
import tomllib
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, get_args, get_type_hints

import msgspec

from bench.base.doubts import Doubts
from bench.base.errors import BadInput
from bench.session import plausible

_MOST_BYTES = 1 << 22  # a thousand times what people write


class Keys(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """One table of a file. `windows`: what is plausible for its keys; `tables`: the tables within it, by name."""

    windows: ClassVar[dict[str, plausible.Window]] = {}
    tables: ClassVar[dict[str, type["Keys"]]] = {}


def read_toml(path: Path, shown: str) -> dict[str, Any]:
    """The tables of a TOML file. Raises BadInput, naming the file as `shown`, where it is not one."""
    if path.stat().st_size > _MOST_BYTES:
        raise BadInput(
            f"has more than {_MOST_BYTES >> 20} MB; a few lines are expected", file=shown
        )
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
    except RecursionError:
        raise BadInput("is not TOML: brackets within brackets without end", file=shown) from None


def _bad_toml(problem: str, text: str, shown: str) -> BadInput:
    place = re.search(r"line (\d+)", problem)
    if not place:
        return BadInput(f"is not TOML: {problem}", file=shown)
    row = int(place.group(1))
    line = text.splitlines()[row - 1].strip()
    if re.search(r"=\s*-?\d+,\d", line):
        return BadInput(f"found {line!r}; a decimal comma? Write a point.", file=shown, row=row)
    return BadInput(f"is not TOML: {problem}; found {line!r}", file=shown, row=row)


def as_keys(
    tables: dict[str, Any], kind: type[Keys], shown: str, doubts: Doubts, needed: Sequence[str] = ()
) -> Keys:
    """Check tables against `kind`: names, types, plausible values. Raises BadInput with the key's path.

    needed: tables that must be there.

    With a collecting `doubts` every key that is unknown, missing or implausible is kept there; unknown ones are left
    out.
    """
    without = (f"[{name}] is missing" for name in needed if name not in tables)
    for line in (*_unknown_keys(tables, kind, top=kind), *without, *_missing_keys(tables, kind)):
        with doubts.guard():
            raise BadInput(line, file=shown)
    try:
        keys = msgspec.convert(_only_keys_of(tables, kind), kind, strict=True)
    except msgspec.ValidationError as problem:
        raise BadInput(_in_plain_words(str(problem), kind), file=shown) from None
    doubts.each(_value_checks(keys, "", shown))
    return keys


def values(keys: Keys, leave_out: tuple[str, ...] = ()) -> dict[str, Any]:
    """A table's values by key."""
    return {name: getattr(keys, name) for name in keys.__struct_fields__ if name not in leave_out}


def _value_checks(keys: Keys, table: str, shown: str) -> Iterator[Callable[[], None]]:
    """A check of each value, tables within included."""
    for name in keys.__struct_fields__:
        value = getattr(keys, name)
        if name in keys.tables:
            listed = isinstance(value, tuple)
            for inner in value if listed else [value] if value else []:
                yield from _value_checks(inner, f"[[{name}]] " if listed else f"[{name}] ", shown)
        elif value is not None:
            yield partial(_check_value, value, name, keys.windows.get(name), table, shown)


def _check_value(
    value: Any, name: str, window: plausible.Window | None, table: str, shown: str
) -> None:
    if "_sigma_" in name:
        window = plausible.SIGMA
    for number in _numbers(value):
        (window or plausible.CLOCK).check(number, table + name, shown)
    if name in ("beta_deg", "follicle_roll_deg") and plausible.looks_like_radians(value):
        degrees = value * plausible.DEGREES_PER_RADIAN
        raise BadInput(
            f"{table}{name} is {value:g}. Is it in radians? Then write {degrees:.4g}.", file=shown
        )


def _numbers(value: Any) -> list[float]:
    if isinstance(value, list):
        return [number for item in value for number in _numbers(item)]
    return [float(value)] if isinstance(value, int | float) and not isinstance(value, bool) else []


def _unknown_keys(
    value: Any, kind: type[Keys], top: type[Keys], path: tuple[str, ...] = ()
) -> Iterator[str]:
    """A line for each key of a table, or of a list of tables, that is none of `kind`'s; tables within included."""
    for table in value if isinstance(value, list) else [value]:
        for key, inner in table.items() if isinstance(table, dict) else ():
            if key not in kind.__struct_fields__:
                yield f"{_key_path([*path, key])} is not a key of this file; {_meant(key, kind, top)}"
            elif key in kind.tables:
                name = f"{key}[]" if isinstance(inner, list) else key
                yield from _unknown_keys(inner, kind.tables[key], top, (*path, name))


def _missing_keys(value: Any, kind: type[Keys], path: tuple[str, ...] = ()) -> Iterator[str]:
    """A line for each key that `kind` needs and a table, or one of a list of tables, lacks; tables within included."""
    for table in value if isinstance(value, list) else [value]:
        if not isinstance(table, dict):
            continue
        for field in msgspec.structs.fields(kind):
            if field.required and field.name not in table:
                yield f"{_key_path([*path, field.name])} is missing"
        for key in filter(kind.tables.__contains__, table):
            name = f"{key}[]" if isinstance(table[key], list) else key
            yield from _missing_keys(table[key], kind.tables[key], (*path, name))


def _only_keys_of(value: Any, kind: type[Keys] | None) -> Any:
    """A table, or a list of tables, without its unknown keys; anything else as it is."""
    if kind and isinstance(value, list):
        return [_only_keys_of(item, kind) for item in value]
    if kind and isinstance(value, dict):
        return {
            k: _only_keys_of(v, kind.tables.get(k))
            for k, v in value.items()
            if k in kind.__struct_fields__
        }
    return value


def _meant(key: str, kind: type[Keys], top: type[Keys]) -> str:
    """Which key was likely meant: a like one of this table, the same one of another table, or any."""
    allowed = kind.__struct_fields__
    if near := difflib.get_close_matches(key, allowed, n=1, cutoff=0.6):
        return f"did you mean {near[0]!r}?"
    if homes := [
        f"[{name}]" for name, table in top.tables.items() if key in table.__struct_fields__
    ]:
        return f"it belongs in {' or '.join(homes)}."
    return f"allowed are {', '.join(name for name in allowed if '_sigma_' not in name)}."


def _in_plain_words(problem: str, kind: type[Keys]) -> str:
    """msgspec's message with the key's path as in the file; kind: of the whole file."""
    what, _, place = problem.partition(" - at `$")
    path = [part for part in re.split(r"[.`]", place) if part]
    if missing := re.match(r"Object missing required field `(.*)`", what):
        return f"{_key_path([*path, missing.group(1)])} is missing"
    if choice := re.match(r"Invalid enum value (.*)", what):
        return f"{_key_path(path)}: {choice.group(1)} is none of its values; allowed are {_choices(path, kind)}"
    return f"{_key_path(path)}: {_what_is_wrong(what)}"


def _choices(path: list[str], kind: type[Keys]) -> str:
    """The values of a key that has a few."""
    *tables, key = path
    for table in tables:
        kind = kind.tables[re.sub(r"\[.*", "", table)]
    return ", ".join(map(repr, get_args(get_type_hints(kind)[key])))


def _what_is_wrong(what: str) -> str:
    """msgspec's "Expected `float | null`, got `str`" in the words of a person who writes TOML."""
    words = {
        "float": "a number",
        "int": "a whole number",
        "str": "text",
        "bool": "true or false",
        "null": "nothing",
    }
    found = re.sub(
        r"`([^`]*)`", lambda m: words.get(m.group(1).removesuffix(" | null"), m.group(1)), what
    )
    return found.replace("Expected", "expected").replace("got", "found")


def _key_path(path: list[str]) -> str:
    """['board', 'square_mm'] -> '[board] square_mm'; ['cameras[]', 'name'] -> '[[cameras]] name'."""
    *tables, key = path
    return " ".join([*(_table(name) for name in tables), key])


def _table(name: str) -> str:
    listed = re.fullmatch(r"(\w+)\[[\d.]*\]", name)
    return f"[[{listed.group(1)}]]" if listed else f"[{name}]"
