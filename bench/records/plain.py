"""Conversion of records to plain values of JSON, and back.

A `Value` has two keys there, its own and that of its sigma. A `Reason` has two, too: its text, and the
code and text of each of its sentences. NaN is null, None is too. A field with the metadata "optional"
has no key where it is None or empty.
"""

from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import lru_cache
from types import NoneType, UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from bench.base.results import plain
from bench.base.tables import sigma_name
from vision import NAN, Value
from vision.geometry import Reason, as_reason

Record = TypeVar("Record")


def to_plain(value: object) -> Any:
    """Convert a record, or a list or mapping of records, to plain values."""
    if is_dataclass(value) and not isinstance(value, type):
        table: dict[str, Any] = {}
        for field in fields(value):
            table |= _keys(field, getattr(value, field.name))
        return table
    if isinstance(value, Mapping):
        return {str(key): to_plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_plain(item) for item in value]
    return plain(value)


def codes_name(name: str) -> str:
    """Return the key of the codes of a status."""
    return f"{name}_codes"


def _keys(field: Field, value: object) -> dict[str, Any]:
    """Return the keys of a field with their plain values."""
    name = field.name
    if field.type is Reason:
        parts = [list(part) for part in as_reason(value).parts]
        return {name: str(value), codes_name(name): parts}
    if isinstance(value, Value):
        return {name: plain(value.value), sigma_name(name): plain(value.sigma)}
    if field.metadata.get("optional") and not value:
        return {}
    return {name: to_plain(value)}


def from_plain(kind: type[Record], value: Any) -> Record:
    """Convert plain values to a record of a kind.

    Raises ValueError where they are no such record: of an older version, or damaged.
    """
    try:
        return _read(kind, value)
    except (TypeError, AttributeError) as problem:
        raise ValueError(f"is no {kind.__name__}: {problem}") from problem


def _read(kind: Any, value: Any) -> Any:
    """Convert a plain value by its annotation; values of other types stay as they are."""
    if get_origin(kind) in (Union, UnionType):
        if value is None:
            return None
        kind = next(k for k in get_args(kind) if k is not NoneType)
    if kind is float:
        return NAN if value is None else float(value)
    if kind is np.ndarray:
        return _array(value)
    if is_dataclass(kind):
        return _read_record(kind, value)
    if get_origin(kind) is tuple:
        return tuple(_read(get_args(kind)[0], item) for item in value)
    if get_origin(kind) is dict:
        return {key: _read(get_args(kind)[1], item) for key, item in value.items()}
    return value


def _read_record(kind: type[Record], table: Mapping) -> Record:
    """Convert a table to a record. Raise ValueError where a field without a default is missing."""
    hints = _hints(kind)
    values = {}
    for field in fields(kind):
        name = field.name
        has_default = field.default is not MISSING or field.default_factory is not MISSING
        if has_default and table.get(name) is None:
            continue
        if name not in table:
            raise ValueError(f"{kind.__name__}: {name} is missing")
        values[name] = _read_field(hints[name], name, table)
    return kind(**values)


def _read_field(hint: Any, name: str, table: Mapping) -> Any:
    """Convert the keys of one field to its value."""
    if hint in (Value, Value | None):
        return Value(_number(table[name]), _number(table.get(sigma_name(name))))
    if hint is Reason:
        return _reason(table[name], table.get(codes_name(name)))
    return _read(hint, table[name])


def _reason(text: str, parts: list | None) -> Reason:
    """Return a status from its text and its codes. Raise ValueError where a text has none."""
    if text and parts is None:
        raise ValueError(f"the status {text!r} has no codes")
    return Reason.of_parts(parts or [])


def _number(value: Any) -> float | np.ndarray:
    """Convert a list to an array, anything else to a float."""
    return _array(value) if isinstance(value, list) else _read(float, value)


def _array(value: Any) -> np.ndarray:
    """Convert a list of numbers, null as NaN; truth values and whole numbers stay such."""
    found = np.array(value)
    return found.astype(float) if found.dtype == object else found


@lru_cache
def _hints(kind: type) -> dict[str, Any]:
    """Return the annotations of a record's fields as types."""
    return get_type_hints(kind)
