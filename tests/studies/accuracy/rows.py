"""Tables of independent trials, a row each, that go on where they were interrupted."""

import csv
import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TypeVar

Key = TypeVar("Key", int, str)
HALF_WIDTH_95 = 1.959964
# Columns of words; the others hold numbers.
_WORDS = ("scene", "look", "status")


def all_rows(
    table: Path, columns: Sequence[str], keys: Iterable[Key], make: Callable[[Key], dict]
) -> list[dict]:
    """Return the rows of a CSV table by its first column, a whole number or a name.

    Rows of other keys and those that are there stay as they are; the others are made, and each is written as soon as
    it is known.
    """
    rows = read_rows(table, columns)
    table.parent.mkdir(parents=True, exist_ok=True)
    with table.open("w", newline="") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(rows)
        file.flush()  # a row may take long, and be interrupted
        for key in sorted(set(keys) - {row[columns[0]] for row in rows}):
            rows.append(make(key))
            writer.writerow(rows[-1])
            file.flush()
    return rows


def read_rows(table: Path, columns: Sequence[str]) -> list[dict]:
    """Return the rows of a table, none where there is no table; a last row that was cut off is left out.

    Numbers are floats, NaN where empty; the first column is a whole number or a name.
    """
    if not table.exists():
        return []
    with table.open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row[columns[-1]] is not None]
    return [_values(row, columns) for row in rows]


def _values(row: dict[str, str], columns: Sequence[str]) -> dict:
    """Return a row's cells as words and numbers."""
    values = {name: _value(name, row[name]) for name in columns}
    if columns[0] not in _WORDS:
        values[columns[0]] = int(row[columns[0]])
    return values


def _value(name: str, text: str) -> str | float:
    """Return the cell of a column as a word or a number."""
    if name in _WORDS:
        return text
    return float(text) if text else math.nan
