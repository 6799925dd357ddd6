"""Records as JSON has them, and back.

A `Value` is two keys there, its own and that of its sigma. A `Reason` is two, too: its text, and the
code and text of each of its sentences. NaN is null.
"""

from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import lru_cache
from types import NoneType, UnionType
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

import numpy as np

from bench.base.results import plain
from bench.base.tables import sigma_name
from vision.geometry.reasons import Reason, as_reason
from vision.truth.value import NAN, Value

Record = TypeVar("Record")
WHERE_THERE = {"where_there": True}  # of a field that has no key where it is None


def to_plain(value: object) -> Any:
    """Return a record, or a list or mapping of records, as plain values."""
    if is_dataclass(value) and not isinstance(value, type):
        table = {}
        for field in fields(value):
            table |= _keys(field, getattr(value, field.name))
        return table
    if isinstance(value, Mapping):
        return {str(key): to_plain(item) for key, item in value.items()}
    return [to_plain(item) for item in value] if isinstance(value, (list, tuple)) else plain(value)


def codes_name(name: str) -> str:
    """Return the key of the codes of a status."""
    return f"{name}_codes"


def _keys(field: Field, value: object) -> dict[str, Any]:
    """Return the keys of a field with their plain values."""
    name = field.name
    if field.type is Reason:
        return {name: str(value), codes_name(name): to_plain(as_reason(value).parts)}
    if isinstance(value, Value):
        return {name: plain(value.value), sigma_name(name): plain(value.sigma)}
    if value is None and field.metadata == WHERE_THERE:
        return {}
    return {name: to_plain(value)}


def from_plain(kind: type[Record], value: Any) -> Record:
    """Return the record of this kind. Raise ValueError where it is of an older version, or damaged."""
    try:
        return _read(kind, value)
    except (TypeError, AttributeError) as problem:
        raise ValueError(f"is no {kind.__name__}: {problem}") from problem


def _read(kind: Any, value: Any) -> Any:
    """Return a plain value as its annotation has it; fields of other types stay as they are."""
    if isinstance(kind, UnionType):
        inner = next(each for each in get_args(kind) if each is not NoneType)
        return None if value is None else _read(inner, value)
    if kind is float:
        return NAN if value is None else float(value)
    if kind is np.ndarray:
        return _array(value)
    if is_dataclass(kind):
        given = {}
        for field in fields(kind):
            given |= _field(kind, field, value)
        return kind(**given)
    if get_origin(kind) is tuple:
        return tuple(_read(get_args(kind)[0], item) for item in value)
    if get_origin(kind) is dict:
        return {key: _read(get_args(kind)[1], item) for key, item in value.items()}
    return value


def _field(kind: type, field: Field, table: Mapping) -> dict[str, Any]:
    """Return the value of a field by its name; nothing where its default is to stand.

    Raises ValueError where there is neither.
    """
    name = field.name
    has_default = field.default is not MISSING or field.default_factory is not MISSING
    if table.get(name) is None and has_default:
        return {}
    if name not in table:
        raise ValueError(f"{kind.__name__}: {name} is missing")
    hint = _hints(kind)[name]
    if hint in (Value, Value | None):
        return {name: Value(_number(table[name]), _number(table.get(sigma_name(name))))}
    if hint is Reason:
        return {name: _reason(table[name], table.get(codes_name(name)))}
    return {name: _read(hint, table[name])}


def _reason(text: str, parts: list | None) -> Reason:
    """Return a status from its text and its codes. Raise ValueError where a text has none."""
    if text and parts is None:
        raise ValueError(f"the status {text!r} has no codes")
    return Reason.of_parts(parts or [])


def _number(value: Any) -> float | np.ndarray:
    """Return a number, or an array of a list; NaN for null."""
    return _array(value) if isinstance(value, list) else _read(float, value)


def _array(value: Any) -> np.ndarray:
    """Return an array of numbers, null as NaN; truth values and whole numbers stay such."""
    found = np.array(value)
    return found.astype(float) if found.dtype == object else found


@lru_cache
def _hints(kind: type) -> dict[str, Any]:
    """Return the annotations of a record, by field."""
    return get_type_hints(kind)
