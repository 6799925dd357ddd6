"""TOML files of people: every unknown key is named with the one probably meant, every value checked.

A file is declared as a tree of `Keys`: the type of a key says what it holds, the range of plausible
values (`Annotated[float, PlausibleRange(...)]`), or that it is a table of its own. What a table
states is used under the names of its keys: `Whisker` and `Trial` derive from theirs.
"""

import difflib
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import MISSING, dataclass, fields
from functools import lru_cache, partial
from typing import Any, ClassVar, TypeAlias, TypeVar, get_args, get_origin, get_type_hints

import msgspec

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.base.toml_text import in_toml_words, what_and_where
from bench.session import plausible

# Keys that people set by a protractor, and may write in radians.
_SET_BY_PROTRACTOR = ("beta_deg", "follicle_roll_deg")
# The names of the tables that lead to one, outermost first; a list of tables ends in [].
TablePath: TypeAlias = tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Keys:
    """A table of a file: its keys with their types and defaults.

    one_of: groups of keys of which the table needs one.
    """

    one_of: ClassVar[tuple[tuple[str, ...], ...]] = ()


KeysOf = TypeVar("KeysOf", bound=Keys)


def as_keys(
    tables: dict[str, Any],
    kind: type[KeysOf],
    label: str,
    problems: InputProblems,
    needed: Sequence[str] = (),
) -> KeysOf:
    """Check a file's tables against `kind`: names, types, plausible values. Return them as `kind`.

    needed: tables that must be there. Raises BadInput with the key's path. A collecting `problems`
    keeps every key that is unknown, missing or implausible; unknown ones are left out.
    """
    absent = [f"[{name}] is missing" for name in needed if name not in tables]
    for line in (*_unknown_keys(tables, kind), *absent, *_missing_keys(tables, kind)):
        with problems.guard():
            raise BadInput(line, file=label)
    try:
        keys = convert(tables, kind)
    except msgspec.ValidationError as problem:
        raise BadInput(_in_plain_words(str(problem), kind), file=label) from None
    problems.each(_value_checks(tables, kind, label))
    return keys


def convert(tables: dict[str, Any], kind: type[KeysOf]) -> KeysOf:
    """Return tables that were checked as `kind`; keys that it does not have are left out."""
    return msgspec.convert(tables, kind, strict=True)


@lru_cache
def key_names(kind: type[Keys]) -> tuple[str, ...]:
    """Return the names of a table's keys."""
    return tuple(field.name for field in fields(kind))


def is_sigma(key: str) -> bool:
    """Return whether a key is of a standard deviation: 'd_x_sigma_mm', or 'stretch_sigma' of a share."""
    return "_sigma_" in key or key.endswith("_sigma")


def values(keys: Keys, leave_out: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return a table's values by key."""
    return {name: getattr(keys, name) for name in key_names(type(keys)) if name not in leave_out}


@lru_cache
def plausible_ranges(kind: type[Keys]) -> dict[str, plausible.PlausibleRange]:
    """Return the ranges of plausible values that a table declares, by key."""
    return declared_parts(kind, plausible.PlausibleRange)


def declared_parts(kind: type[Keys], wanted: type) -> dict[str, Any]:
    """Return what each key's type has of this class in `Annotated`, by key; keys without are left out."""
    return _declared(kind, lambda part: isinstance(part, wanted))


@lru_cache
def inner_tables(kind: type[Keys]) -> dict[str, type[Keys]]:
    """Return the kinds of the tables within a table, by key."""
    return _declared(kind, lambda part: isinstance(part, type) and issubclass(part, Keys))


def _declared(kind: type[Keys], is_wanted: Callable[[Any], bool]) -> dict[str, Any]:
    """Return the first wanted part of each key's type, by key; keys without one are left out."""
    found = {}
    for name, annotation in get_type_hints(kind, include_extras=True).items():
        for part in filter(is_wanted, _parts(annotation)):
            found.setdefault(name, part)
    return found


def _parts(annotation: Any) -> Iterator[Any]:
    """Yield a type and what it is made of. The keys of a dict are free, so it is no table."""
    yield annotation
    if get_origin(annotation) is not dict:
        for part in get_args(annotation):
            yield from _parts(part)


def _tables(
    value: Any, kind: type[Keys], path: TablePath = ()
) -> Iterator[tuple[dict[str, Any], type[Keys], TablePath]]:
    """Yield a table, or each of a list of tables, and all tables within, with their kinds and paths."""
    for table in value if isinstance(value, list) else [value]:
        if not isinstance(table, dict):
            continue
        yield table, kind, path
        for key, inner in table.items():
            if key in inner_tables(kind):
                name = f"{key}[]" if isinstance(inner, list) else key
                yield from _tables(inner, inner_tables(kind)[key], (*path, name))


def _unknown_keys(tables: dict[str, Any], top: type[Keys]) -> Iterator[str]:
    """Yield a line for each key that its table does not have."""
    for table, kind, path in _tables(tables, top):
        for key in table:
            if key not in key_names(kind):
                place = _key_path([*path, key])
                yield f"{place} is not a key of this file; {_probably_meant(key, kind, top)}"


def _missing_keys(tables: dict[str, Any], top: type[Keys]) -> Iterator[str]:
    """Yield a line for each key that a table needs and lacks."""
    for table, kind, path in _tables(tables, top):
        for field in fields(kind):
            is_needed = field.default is MISSING and field.default_factory is MISSING
            if is_needed and field.name not in table:
                yield f"{_key_path([*path, field.name])} is missing"
        for alternatives in kind.one_of:
            if not any(name in table for name in alternatives):
                yield f"{_key_path([*path, ' or '.join(alternatives)])} is missing"


def _value_checks(
    tables: dict[str, Any], top: type[Keys], label: str
) -> Iterator[Callable[[], None]]:
    """Yield a check of each value, tables within included."""
    for table, kind, path in _tables(tables, top):
        for key, value in table.items():
            if key not in key_names(kind):
                continue
            if is_sigma(key):
                is_angle = key.endswith("_deg")
                plausible_range = plausible.ANGLE_SIGMA if is_angle else plausible.SIGMA
            else:
                plausible_range = plausible_ranges(kind).get(key, plausible.NUMBER)
            yield partial(_check_value, value, key, plausible_range, path[-1:], label)


def _check_value(
    value: Any, key: str, plausible_range: plausible.PlausibleRange, path: TablePath, label: str
) -> None:
    """Raise BadInput where a value, or a number of its lists, is not plausible."""
    name = _key_path([*path, key])
    for number in _numbers(value):
        plausible_range.check(number, name, label)
    if key in _SET_BY_PROTRACTOR and plausible.looks_like_radians(value):
        degrees = value * plausible.DEGREES_PER_RADIAN
        found = f"{name} is {value:g}. Is it in radians? Then write {degrees:.4g}."
        raise BadInput(found, file=label)


def _numbers(value: Any) -> Iterator[float]:
    """Yield the numbers of a value that is one, or of its lists; nothing for anything else."""
    if isinstance(value, list):
        for item in value:
            yield from _numbers(item)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield float(value)


def _probably_meant(key: str, kind: type[Keys], top: type[Keys]) -> str:
    """Return which key was meant: one like it, the same one of another table, or which there are."""
    allowed = key_names(kind)
    if near := difflib.get_close_matches(key, allowed, n=1, cutoff=0.6):
        return f"did you mean {near[0]!r}?"
    tables = inner_tables(top).items()
    if homes := [f"[{name}]" for name, table in tables if key in key_names(table)]:
        return f"it belongs in {' or '.join(homes)}."
    return f"allowed are {', '.join(name for name in allowed if '_sigma_' not in name)}."


def _in_plain_words(problem: str, kind: type[Keys]) -> str:
    """Return msgspec's message with the key's path as in the file; kind: of the whole file."""
    what, place = what_and_where(problem)
    path = [part for part in place.split(".") if part]
    if missing := re.match(r"Object missing required field `(.*)`", what):
        return f"{_key_path([*path, missing.group(1)])} is missing"
    if choice := re.match(r"Invalid enum value (.*)", what):
        found = f"{choice.group(1)} is none of its values"
        return f"{_key_path(path)}: {found}; allowed are {_choices(path, kind)}"
    if len(path) == 1 and path[0] in inner_tables(kind):
        if what == "Expected `array`, got `object`":
            return f"[{path[0]}] is one table where there may be several: write [[{path[0]}]]"
        if re.fullmatch("Expected `object.*`, got `array`", what):
            return f"[[{path[0]}]] are several tables where one is expected: write [{path[0]}]"
    return f"{_key_path(path)}: {in_toml_words(what)}"


def _choices(path: list[str], kind: type[Keys]) -> str:
    """Return the values of a key that has a few, as text."""
    *tables, key = path
    for table in tables:
        kind = inner_tables(kind)[re.sub(r"\[.*", "", table)]
    return ", ".join(map(repr, get_args(get_type_hints(kind)[key])))


def _key_path(path: Sequence[str]) -> str:
    """Return ['board', 'square_mm'] as '[board] square_mm', ['cameras[]', 'name'] as '[[cameras]] name'."""
    *tables, key = path
    return " ".join([*map(_header, tables), key])


def _header(table: str) -> str:
    """Return the line that begins a table: 'rig' as '[rig]', 'cameras[0]' as '[[cameras]]'."""
    listed = re.fullmatch(r"(\w+)\[[\d.]*\]", table)
    return f"[[{listed.group(1)}]]" if listed else f"[{table}]"
