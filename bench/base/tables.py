"""Tables of results: CSV files that are written whole. Missing is an empty cell."""

import csv
import io
import math
from collections.abc import Iterable
from pathlib import Path

from bench.base.atomic import write_whole


def sigma_name(name: str) -> str:
    """Column or key of one standard deviation: the sigma stands before the unit."""
    stem, _, unit = name.rpartition("_")
    return f"{stem}_sigma_{unit}"


def write_table(path: Path, columns: Iterable[str], rows: Iterable[dict]) -> None:
    """A CSV file, whole; None and NaN are empty cells."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_cell(row.get(name)) for name in columns] for row in rows)
    write_whole(path, text.getvalue())


def _cell(value) -> str:
    """Nine digits: a time of hours keeps its 0.1 ms."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    return f"{value:.9g}" if isinstance(value, float) else str(value)
