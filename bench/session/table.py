"""A CSV file of numbers, read strictly: the first bad cell is named by file, row and column."""

import csv
import difflib
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.base.errors import BadInput
from bench.base.text_files import check_size, decode, read_text
from vision.geometry import counted

# [bytes] Two hours at 2 kHz, which as text and numbers fill 4 GB of memory.
_MOST_BYTES = 1 << 29
_EXPORT = "export it as CSV, UTF-8"
_SEPARATORS = {";": "semicolons", "\t": "tabs"}


@dataclass(frozen=True)
class NumberTable:
    """A table of numbers.

    columns: name to array (n,); row: the file's row of each entry (the header is row 1), (n,).
    """

    columns: dict[str, np.ndarray]
    row: np.ndarray

    def __getitem__(self, name: str) -> np.ndarray:
        """Return a column."""
        return self.columns[name]

    def __len__(self) -> int:
        """Return the number of entries."""
        return len(self.row)

    def keep(self, kept: np.ndarray) -> "NumberTable":
        """Return the entries where `kept` (n,) is true."""
        columns = {name: values[kept] for name, values in self.columns.items()}
        return NumberTable(columns, self.row[kept])


def read_table(path: Path, label: str, only: Collection[str] | None = None) -> NumberTable:
    """Read the columns of a comma-separated file of finite numbers.

    only: names of the columns wanted, of which those that are there are read; None: all. A
    byte-order mark and CRLF are taken. Raises BadInput, naming the file as `label`: semicolons,
    tabs, decimal commas, text, an empty cell or row, NaN, infinity, a row too short or too long, no
    rows at all.
    """
    lines = _lines(path, label)
    names = _column_names(lines[0], label)
    if len(lines) < 2:
        raise BadInput(f"has a header and no rows ({','.join(names)})", file=label)
    chosen = [k for k, name in enumerate(names) if only is None or name in only]
    values = _read_at_once(lines[1:], len(names), chosen)
    if values is None:
        values = _read_row_by_row(lines[1:], names, label)[:, chosen]
    columns = {names[k]: column for k, column in zip(chosen, values.T)}
    return NumberTable(columns, np.arange(2, len(values) + 2))


def column_names(path: Path, label: str) -> list[str]:
    """Read the names of a CSV file's columns. Raises BadInput as `read_table` does."""
    with path.open("rb") as file:
        first = file.readline(_MOST_BYTES)
    if not first:
        raise BadInput("is empty", file=label)
    return _column_names(decode(first, _EXPORT, label).rstrip("\r\n"), label)


def forward_in_time(table: NumberTable, time: str, label: str) -> tuple[NumberTable, int]:
    """Drop the rows that repeat the one before them; return the table and how many those were.

    Raises BadInput where time goes back, or stands still while another value changes.
    """
    values = np.column_stack(list(table.columns.values()))  # (n, columns)
    repeats = np.concatenate([[False], (np.diff(values, axis=0) == 0).all(axis=1)])
    table = table.keep(~repeats)
    rule = "times must increase (rows that are wholly the same are dropped)"
    require_rising(table, time, rule, label)
    return table, int(repeats.sum())


def require_columns(table: NumberTable, names: Sequence[str], label: str) -> None:
    """Raise BadInput for the first column that is not there, with what it may have been called."""
    for name in names:
        if name in table.columns:
            continue
        near = difflib.get_close_matches(name, table.columns, n=1, cutoff=0.6)
        hint = f"{near[0]!r} (names carry units)" if near else ",".join(table.columns)
        raise BadInput(f"column {name} is missing; found {hint}", file=label, row=1)


def require_rows(table: NumberTable, least: int, what: str, label: str) -> None:
    """Raise BadInput where a table has fewer rows; what: of a row, "places"."""
    if len(table) < least:
        raise BadInput(f"has {len(table)} {what}; {least} or more are needed", file=label)


def refuse_where(
    table: NumberTable, column: str, is_wrong: np.ndarray, rule: str, label: str
) -> None:
    """Raise BadInput for the first row (n,) that is wrong, with its value and the rule that it breaks."""
    if is_wrong.any():
        first = int(np.argmax(is_wrong))
        found = f"{table[column][first]:g}; {rule}"
        raise BadInput(found, file=label, row=int(table.row[first]), column=column)


def require_rising(table: NumberTable, column: str, rule: str, label: str) -> None:
    """Raise BadInput for the first value of a column that is no larger than the one before it."""
    wrong = np.flatnonzero(np.diff(table[column]) <= 0)
    if len(wrong):
        before, after = table[column][wrong[0] : wrong[0] + 2]
        found = f"{after:.10g} comes twice"
        if after < before:
            found = f"goes back from {before:.10g} to {after:.10g}"
        row = int(table.row[wrong[0] + 1])
        raise BadInput(f"{found}; {rule}", file=label, row=row, column=column)


def _lines(path: Path, label: str) -> list[str]:
    """Return a file's lines without empty ones at its end. Raise BadInput where it has none."""
    check_size(path, _MOST_BYTES, "record in several trials", label)
    lines = read_text(path, _EXPORT, label).splitlines()
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise BadInput("is empty", file=label)
    return lines


def _column_names(header: str, label: str) -> list[str]:
    """Return the names in a file's first line. Raise BadInput where it does not name columns."""
    for mark, name in _SEPARATORS.items():
        if mark in header:
            fix = "export with commas (and decimal points)"
            raise BadInput(f"columns are separated by {name}; {fix}", file=label)
    names = [name.strip() for name in next(csv.reader([header]))]
    if all(_is_number(name) for name in names):
        raise BadInput(f"the first row must name the columns; found {header!r}", file=label, row=1)
    if len(set(names)) < len(names):
        raise BadInput(f"a column is named twice: {header!r}", file=label, row=1)
    return names


def _read_at_once(lines: list[str], width: int, chosen: list[int]) -> np.ndarray | None:
    """Read the chosen columns (rows, chosen); return None where anything at all is unusual."""
    wanted = None
    if len(chosen) < width:  # NumPy then does not count the cells of a row
        if not chosen or any(line.count(",") != width - 1 for line in lines):
            return None
        wanted = chosen
    try:
        values = np.loadtxt(
            lines, delimiter=",", comments=None, quotechar='"', ndmin=2, usecols=wanted
        )
    except ValueError:
        return None
    is_whole = values.shape == (len(lines), len(chosen)) and np.isfinite(values).all()
    return values if is_whole else None


def _read_row_by_row(lines: list[str], names: list[str], label: str) -> np.ndarray:
    """Read all columns (rows, columns). Raise BadInput naming the first cell that is bad."""
    rows = enumerate(csv.reader(lines), start=2)
    return np.array([_row(cells, names, label, row) for row, cells in rows])


def _row(cells: list[str], names: list[str], label: str, row: int) -> list[float]:
    """Return the numbers of a row. Raise BadInput where it is not a number a column."""
    if not "".join(cells).strip():
        raise BadInput("is empty", file=label, row=row)
    if ";" in "".join(cells):
        found = "values are separated by semicolons; export with commas"
        raise BadInput(found, file=label, row=row)
    if len(cells) != len(names):
        found = f"has {counted(len(cells), 'value')}, the header names {len(names)}."
        if len(names) < len(cells) <= 2 * len(names):
            found += " Decimal commas? Export with decimal points."
        raise BadInput(found, file=label, row=row)
    return [_cell(cell.strip(), name, label, row) for cell, name in zip(cells, names)]


def _cell(cell: str, name: str, label: str, row: int) -> float:
    """Return the number of a cell. Raise BadInput where it is none."""
    if _is_number(cell):
        return float(cell)
    if cell == "":
        found = "is empty"
    elif re.fullmatch(r"[+-]?\d+,\d*", cell):
        found = f"{cell!r} has a decimal comma; export with decimal points"
    else:
        found = f"{cell!r} is not a finite number"
    raise BadInput(found, file=label, row=row, column=name)


def _is_number(cell: str) -> bool:
    """Return whether a text is a finite number, without Python's underscores."""
    try:
        return bool(np.isfinite(float(cell))) and "_" not in cell
    except ValueError:
        return False
