"""Tables of independent trials, a row each, that go on where they were interrupted."""

import csv
import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

HALF_WIDTH_95 = 1.959964


def all_rows(
    table: Path, columns: Sequence[str], keys: Iterable[int], make: Callable[[int], dict]
) -> list[dict]:
    """Rows of a CSV table by its first column, a whole number: those of other keys and those there already as they
    are, the rest made and each written as soon as it is known."""
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
    """Rows with numbers as floats (NaN where empty), the first column an int, `status` a text; without a last row that
    was cut off. None where there is no table."""
    if not table.exists():
        return []
    with table.open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row[columns[-1]] is not None]
    return [
        {name: _value(name, row[name]) for name in columns} | {columns[0]: int(row[columns[0]])}
        for row in rows
    ]


def _value(name: str, text: str):
    if name == "status":
        return text
    return float(text) if text else math.nan
