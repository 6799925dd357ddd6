"""TOML files of people: their tables, and what is wrong with them in the words of who writes TOML."""

import re
import tomllib
from pathlib import Path
from typing import Any

from bench.base.errors import BadInput
from bench.base.text_files import check_size, read_text

# [bytes] Largest file that is read: a thousand times what people write.
_MOST_BYTES = 1 << 22
# How msgspec calls kinds of values and what is wrong with them, and what we write instead.
_KINDS = {
    "float": "a number",
    "int": "a whole number",
    "str": "text",
    "bool": "true or false",
    "array": "a list",
    "object": "a table",
    "null": "nothing",
}
_FAULTS = {
    "Expected": "expected",
    "got": "found",
    "Object missing required field": "there is no",
    "Object contains unknown field": "there is no key",
}


def read_toml(path: Path, label: str) -> dict[str, Any]:
    """Return the tables of a TOML file. Raise BadInput, naming it as `label`, where it is not one."""
    check_size(path, _MOST_BYTES, "a few lines are expected", label)
    text = read_text(path, "save it as UTF-8", label)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as problem:
        raise _bad_toml(str(problem), text, label) from None
    except RecursionError:
        raise BadInput("is not TOML: brackets within brackets without end", file=label) from None
    except ValueError:  # Python converts no whole number of more than 4300 digits
        raise BadInput("holds a number of thousands of digits", file=label) from None


def _bad_toml(problem: str, text: str, label: str) -> BadInput:
    """Return the error of a text that is not TOML, with its line."""
    place = re.search(r"line (\d+)", problem)
    if not place:
        return BadInput(f"is not TOML: {problem}", file=label)
    row = int(place.group(1))
    line = text.splitlines()[row - 1].strip()
    if re.search(r"=\s*-?\d+,\d", line):
        return BadInput(f"found {line!r}; a decimal comma? Write a point.", file=label, row=row)
    return BadInput(f"is not TOML: {problem}; found {line!r}", file=label, row=row)


def what_and_where(problem: str) -> tuple[str, str]:
    """Return msgspec's message "Expected `float | null`, got `str` - at `$.a[0].b`" as what is wrong
    and the path of the key, 'a[0].b'."""
    what, _, place = problem.partition(" - at `$")
    return what, place.rstrip("`").removeprefix(".")


def in_toml_words(what: str) -> str:
    """Return what msgspec finds wrong, such as "Expected `float | null`, got `str`", in plain words."""
    for fault, words in _FAULTS.items():
        what = re.sub(rf"\b{fault}\b", words, what)
    what = re.sub(r"of length (<=|>=)? ?(\d+)", _length_in_words, what)
    return re.sub("`([a-z| ]+)`", _kinds_in_words, what)


def _length_in_words(found: re.Match) -> str:
    """Return a list's length, such as `of length <= 3`, in words."""
    bound = {"<=": "at most ", ">=": "at least ", None: ""}[found[1]]
    return f"of {bound}{found[2]} values"


def _kinds_in_words(quoted: re.Match) -> str:
    """Return kinds of values, such as `float | array`, in words; the name of a key as it is.

    A key that may be null is left out of the file: nobody writes "nothing".
    """
    kinds = quoted[1].removesuffix(" | null").split(" | ")
    if not set(kinds) <= set(_KINDS):
        return quoted[0]
    return " or ".join(_KINDS[kind] for kind in kinds)
