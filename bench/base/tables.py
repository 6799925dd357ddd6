"""Tables of results: CSV files that are written whole. Missing is an empty cell."""

import csv
import io
import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from bench.base.atomic import write_whole
from bench.base.errors import BadInput

# Of an evaluated session, beside a track a trial; one that has nothing to say has its head alone.
TABLES = (
    *(
        "whisks",
        "estimates",
        "budget",
        "beam",
        "friction",
        "phases",
        "surfaces",
        "explained",
        "error_map",
    ),
    *("against_theta", "compliance", "curvature", "tilts", "sensors", "ledger"),
)


def sigma_name(name: str) -> str:
    """Column or key of one standard deviation: the sigma stands before the unit."""
    stem, _, unit = name.rpartition("_")
    return f"{stem}_sigma_{unit}"


def write_table(path: Path, columns: Iterable[str], rows: Iterable[dict]) -> None:
    """A CSV file, whole; None and NaN are empty cells. What we say is ASCII there: spreadsheets take a file without a
    byte-order mark for another encoding, and other readers take the mark for a part of the first column's name."""
    text, columns = io.StringIO(), list(columns)
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        cells = {name: _cell(row.get(name)) for name in columns}
        writer.writerow(_in_ascii(cell) if name in SAID else cell for name, cell in cells.items())
    write_whole(path, text.getvalue())


# Columns that hold text, and whole numbers that are never missing; all others are numbers.
TEXT = (
    "whisker",
    "trial",
    "surface",
    "looked",
    "estimator",
    "beta_from",
    "record",
    "kind",
    "shape",
    "notes",
    "status",
)
TEXT += ("refinement", "verdict", "surface_from", "camera")
SAID = ("status", "notes")  # sentences of ours
_ASCII = {
    **{
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
    },
    **{
        "→": "->",
        "α": "alpha",
        "β": "beta",
        "θ": "theta",
        "μ": "mu",
        "σ": "sigma",
        "φ": "phi",
        "χ": "chi",
        "ψ": "psi",
    },
}
WHOLE = ("whisk", "whisks", "frame", "touching", "cameras", "frames_used")
WHOLE += ("rests_seen", "jumps_seen", "rests_felt", "jumps_felt")


def read_table(path: Path) -> np.ndarray:
    """A CSV file of ours as a structured array (rows,): NaN where a number is missing. Rows that sum up others, without
    a whisk, are left out. Raises BadInput where it is damaged."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            columns, *rows = csv.reader(file)
        kinds = [
            (name, str if name in TEXT else int if name in WHOLE else float) for name in columns
        ]
        whole = [row for row in rows if dict(zip(columns, row, strict=True)).get("whisk", "one")]
        cells = {
            name: [kind(cell) if cell or kind is str else math.nan for cell in column]
            for (name, kind), column in zip(kinds, zip(*whole))
        }
    except (OSError, ValueError, csv.Error) as problem:
        raise BadInput(
            f"cannot be read ({problem}); evaluate the session again into this folder", file=path
        ) from None
    longest = {
        name: max((len(c) for c in cells.get(name, ())), default=1) or 1
        for name, kind in kinds
        if kind is str
    }
    table = np.zeros(
        len(whole), [(name, f"U{longest[name]}" if kind is str else kind) for name, kind in kinds]
    )
    for name, values in cells.items():
        table[name] = values
    return table


def _in_ascii(text: str) -> str:
    return "".join(_ASCII.get(letter, letter) for letter in text)


def _cell(value) -> str:
    """Nine digits: a time of hours keeps its 0.1 ms."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    return f"{value:.9g}" if isinstance(value, float) else str(value)
