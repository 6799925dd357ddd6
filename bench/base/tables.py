"""Tables of results: CSV files whose columns are declared once.

A `Table` names its columns in their order, each with what it means and what kind of cell it has.
Writing and reading a file and its section of docs/formats.md (`docs/formats.py`) are made from
that. Files are written whole. A missing number is an empty cell.
"""

import csv
import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np

from bench.base.atomic import write_whole
from bench.base.errors import BadInput


class Kind(Enum):
    """Kinds of cells. A whole number is never missing. A sentence is ours, and written in ASCII."""

    NUMBER = "number"
    WHOLE = "whole number"
    TEXT = "text"
    SENTENCE = "sentence"


@dataclass(frozen=True)
class Column:
    """A column: its name, which ends in the unit where there is one, and what it means."""

    name: str
    meaning: str
    kind: Kind = Kind.NUMBER


def sigma_name(name: str) -> str:
    """Return the name of a value's standard deviation: the sigma stands before the unit."""
    stem, _, unit = name.rpartition("_")
    return f"{stem}_sigma_{unit}"


def shared_name(name: str) -> str:
    """Return the name of the part of a value's standard deviation that all whisks have in common."""
    stem, _, unit = name.rpartition("_")
    return f"{stem}_shared_sigma_{unit}"


def with_sigma(name: str, meaning: str, sigma: str | None = None) -> tuple[Column, Column]:
    """Return the columns of a value and of its standard deviation.

    sigma: name of the latter where the unit has an underscore in it, such as give_sigma_mm_N.
    """
    return Column(name, meaning), Column(sigma or sigma_name(name), meaning)


def alike(names: Iterable[str], meaning: str, kind: Kind = Kind.NUMBER) -> tuple[Column, ...]:
    """Return columns that one sentence explains together."""
    return tuple(Column(name, meaning, kind) for name in names)


def status(meaning: str) -> Column:
    """Return the column that says in a sentence why something is missing, or what the warnings are."""
    return Column("status", meaning, Kind.SENTENCE)


# Columns that many tables have.
TRIAL = Column("trial", "name of the trial's folder", Kind.TEXT)
WHISK = Column("whisk", "number of the trial's forward stroke, from 0", Kind.WHOLE)
SURFACE = Column("surface", "as the manifest names it", Kind.TEXT)
SPEED = Column("speed_deg_s", "nominal speed of the motor")
WHISKER = Column("whisker", "name of the array's whisker", Kind.TEXT)
TRUTH_SOURCE = Column(
    "truth_source",
    "what d_x and the slopes of the truth rest on: pictures or stage; empty without a truth",
    Kind.TEXT,
)
ANGLE_FROM = Column(
    "angle_from",
    "where the motor's angle is from, as in trial.toml; marker, whisker: θ is seen in the trial's own pictures",
    Kind.TEXT,
)
WHISKS_KNOWN = Column("whisks", "how many whisks with a distance", Kind.WHOLE)
WHISKS_WITHOUT = Column("none", "how many whisks without a distance")


@dataclass(frozen=True)
class Table:
    """A table of results.

    name: of its file, without .csv; in angle brackets stands what differs from file to file.
    rows: what has a row, as Markdown for docs/formats.md.
    """

    name: str
    rows: str
    columns: tuple[Column, ...]

    @property
    def file(self) -> str:
        """Return the name of the file."""
        return f"{self.name}.csv"

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the columns in their order."""
        return tuple(column.name for column in self.columns)

    def write(self, folder: Path, rows: Iterable[dict]) -> None:
        """Write the table under its own name into a folder: a cell a column, others left out."""
        self.write_file(folder / self.file, rows)

    def write_file(self, path: Path, rows: Iterable[dict]) -> None:
        """Write the table under any name. None, NaN and infinity are empty cells.

        Our sentences are written in ASCII: spreadsheets take a file without a byte-order mark for
        another encoding, and other readers take the mark for a part of the first column's name.
        """
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.names)
        for row in rows:
            writer.writerow([_cell(row.get(column.name), column.kind) for column in self.columns])
        write_whole(path, text.getvalue())

    def read(self, folder: Path) -> np.ndarray:
        """Read the table of a folder as `read_file` does. Raises BadInput as that does."""
        return self.read_file(folder / self.file)

    def read_file(self, path: Path) -> np.ndarray:
        """Read a file of this table as a structured array (rows,), NaN where a number is missing.

        Rows that sum up others, without a whisk, are left out. Raises BadInput where the file is
        damaged.
        """
        kinds = {column.name: column.kind for column in self.columns}
        try:
            with path.open(newline="", encoding="utf-8") as file:
                names, *rows = csv.reader(file)
            single = [row for row in rows if _is_single(names, row)]
            by_column = list(zip(*single)) or [()] * len(names)
            values = []
            for name, cells in zip(names, by_column):
                values.append(_values(cells, kinds.get(name, Kind.NUMBER)))
        except (OSError, ValueError, csv.Error) as problem:
            raise BadInput(
                f"cannot be read ({problem}); evaluate the session again into this folder",
                file=path,
            ) from None
        dtypes = [(name, value.dtype) for name, value in zip(names, values)]
        table = np.empty(len(single), dtypes)
        for name, value in zip(names, values):
            table[name] = value
        return table


def _is_single(names: Sequence[str], row: Sequence[str]) -> bool:
    """Return whether a row is of one whisk, not of all. Raise ValueError where it is cut short."""
    cells = dict(zip(names, row, strict=True))
    return cells.get("whisk") != ""


def _values(cells: Sequence[str], kind: Kind) -> np.ndarray:
    """Return the cells of a column as an array (rows,). Raise ValueError for another kind."""
    if kind is Kind.NUMBER:
        return np.array([float(cell) if cell else math.nan for cell in cells], dtype=float)
    if kind is Kind.WHOLE:
        return np.array([int(cell) for cell in cells], dtype=int)
    return np.array(cells, dtype=str)


def _cell(value: object, kind: Kind) -> str:
    """Return the text of a cell. Nine digits: a time of hours keeps its 0.1 ms."""
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.9g}" if math.isfinite(value) else ""
    return _in_ascii(str(value)) if kind is Kind.SENTENCE else str(value)


_ASCII = str.maketrans(
    {
        "°": " deg",
        "±": "+-",
        "·": "*",
        "×": "x",
        "≥": ">=",
        "≤": "<=",
        "²": "2",
        "−": "-",
        "–": "-",
        "…": "...",
        "→": "->",
        "α": "alpha",
        "β": "beta",
        "θ": "theta",
        "μ": "mu",
        "σ": "sigma",
        "φ": "phi",
        "χ": "chi",
        "ψ": "psi",
    }
)


def _in_ascii(text: str) -> str:
    """Return a sentence with its symbols spelled out."""
    return text.translate(_ASCII)
