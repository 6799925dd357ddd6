"""A CSV file of numbers, read strictly: the first bad cell is named by file, row and column."""

import csv
import difflib
import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.base.errors import BadInput
from vision.geometry.counted import counted

_MOST_BYTES = 1 << 29  # two hours at 2 kHz, which as text and numbers fill 4 GB of memory


@dataclass(frozen=True)
class NumberTable:
    """columns: name to array (n,); row: the file's row of each entry (the header is row 1), (n,)."""

    columns: dict[str, np.ndarray]
    row: np.ndarray

    def __getitem__(self, name: str) -> np.ndarray:
        return self.columns[name]

    def __len__(self) -> int:
        return len(self.row)

    def keep(self, kept: np.ndarray) -> "NumberTable":
        """The entries where `kept` (n,) is true."""
        return NumberTable(
            {name: values[kept] for name, values in self.columns.items()}, self.row[kept]
        )


def read_table(path: Path, shown: str, only: Collection[str] | None = None) -> NumberTable:
    """The columns of a comma-separated file of finite numbers: all, or those of `only` that are there, which is as fast
    as they are few. A byte-order mark and CRLF are taken.

    Raises BadInput, naming the file as `shown`: semicolons, tabs, decimal commas, text, an empty cell or row,
    NaN, infinity, a row too short or too long, no rows at all.
    """
    lines = _lines(path, shown)
    names = _header(lines, shown)
    if len(lines) < 2:
        raise BadInput(f"has a header and no rows ({','.join(names)})", file=shown)
    chosen = [k for k, name in enumerate(names) if only is None or name in only]
    values = _fast(lines[1:], len(names), chosen)
    if values is None:
        values = _row_by_row(lines[1:], names, shown)[:, chosen]
    return NumberTable(
        {names[k]: column for k, column in zip(chosen, values.T)}, np.arange(2, len(values) + 2)
    )


def column_names(path: Path, shown: str) -> list[str]:
    """Of a CSV file's first line, which alone is read. Raises BadInput as `read_table` does."""
    with path.open("rb") as file:
        first = file.readline(_MOST_BYTES)
    try:
        return _header([first.decode("utf-8-sig").rstrip("\r\n")], shown)
    except UnicodeDecodeError:
        raise BadInput("is not UTF-8 text; export it as CSV, UTF-8", file=shown) from None


def forward_in_time(table: NumberTable, time: str, shown: str) -> tuple[NumberTable, int]:
    """The table without rows that repeat the one before them, and how many those were.

    Raises BadInput where time goes back, or stands still while another value changes.
    """
    values = np.column_stack(list(table.columns.values()))
    repeats = np.concatenate([[False], (np.diff(values, axis=0) == 0).all(axis=1)])
    table = table.keep(~repeats)
    wrong = np.flatnonzero(np.diff(table[time]) <= 0)
    if len(wrong):
        before, after = table[time][wrong[0]], table[time][wrong[0] + 1]
        found = (
            f"goes back from {before:.10g} to {after:.10g}"
            if after < before
            else f"{after:.10g} comes twice"
        )
        fix = "; times must increase (rows that are wholly the same are dropped)"
        raise BadInput(found + fix, file=shown, row=int(table.row[wrong[0] + 1]), column=time)
    return table, int(repeats.sum())


def require_columns(table: NumberTable, names: tuple[str, ...], shown: str) -> None:
    """Raises BadInput for the first column that is not there, with what it may have been called."""
    for name in names:
        if name not in table.columns:
            near = difflib.get_close_matches(name, table.columns, n=1, cutoff=0.6)
            hint = (
                f"; found {near[0]!r} (names carry units)"
                if near
                else f"; found {','.join(table.columns)}"
            )
            raise BadInput(f"column {name} is missing{hint}", file=shown, row=1)


def _lines(path: Path, shown: str) -> list[str]:
    if path.stat().st_size > _MOST_BYTES:
        raise BadInput(
            f"has more than {_MOST_BYTES >> 20} MB; record in several trials", file=shown
        )
    try:
        lines = path.read_bytes().decode("utf-8-sig").splitlines()
    except OSError as problem:
        raise BadInput(f"cannot be read ({problem.strerror})", file=shown) from None
    except UnicodeDecodeError:
        raise BadInput("is not UTF-8 text; export it as CSV, UTF-8", file=shown) from None
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise BadInput("is empty", file=shown)
    return lines


def _header(lines: list[str], shown: str) -> list[str]:
    header = lines[0]
    for mark, name in ((";", "semicolons"), ("\t", "tabs")):
        if mark in header:
            raise BadInput(
                f"columns are separated by {name}; export with commas (and decimal points)",
                file=shown,
            )
    names = [name.strip() for name in next(csv.reader([header]))]
    if all(_is_number(name) for name in names):
        raise BadInput(f"the first row must name the columns; found {header!r}", file=shown, row=1)
    if len(set(names)) < len(names):
        raise BadInput(f"a column is named twice: {header}", file=shown, row=1)
    return names


def _fast(lines: list[str], width: int, chosen: list[int]) -> np.ndarray | None:
    """The numbers of the chosen columns, (rows, chosen), or None where anything at all is unusual."""
    some = {} if len(chosen) == width else {"usecols": chosen}
    if some and (not chosen or any(line.count(",") != width - 1 for line in lines)):
        return None
    try:
        values = np.loadtxt(lines, delimiter=",", comments=None, quotechar='"', ndmin=2, **some)
    except ValueError:
        return None
    return (
        values if values.shape == (len(lines), len(chosen)) and np.isfinite(values).all() else None
    )


def _row_by_row(lines: list[str], names: list[str], shown: str) -> np.ndarray:
    """The same, slowly, to say which cell is bad."""
    return np.array(
        [_row(cells, names, shown, row) for row, cells in enumerate(csv.reader(lines), start=2)]
    )


def _row(cells: list[str], names: list[str], shown: str, row: int) -> list[float]:
    if not cells or not "".join(cells).strip():
        raise BadInput("is empty", file=shown, row=row)
    if ";" in "".join(cells):
        raise BadInput(
            "values are separated by semicolons; export with commas", file=shown, row=row
        )
    if len(cells) != len(names):
        hint = (
            " Decimal commas? Export with decimal points."
            if len(names) < len(cells) <= 2 * len(names)
            else ""
        )
        raise BadInput(
            f"has {counted(len(cells), 'value')}, the header names {len(names)}.{hint}",
            file=shown,
            row=row,
        )
    return [_cell(cell.strip(), name, shown, row) for cell, name in zip(cells, names)]


def _cell(cell: str, name: str, shown: str, row: int) -> float:
    if _is_number(cell):
        return float(cell)
    if cell == "":
        found = "is empty"
    elif re.fullmatch(r"[+-]?\d+,\d*", cell):
        found = f"{cell!r} has a decimal comma; export with decimal points"
    else:
        found = f"{cell!r} is not a finite number"
    raise BadInput(found, file=shown, row=row, column=name)


def _is_number(cell: str) -> bool:
    try:
        return bool(np.isfinite(float(cell))) and "_" not in cell
    except ValueError:
        return False
