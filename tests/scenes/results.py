"""What a run wrote, read as a person's own script would."""

import csv
from pathlib import Path


def table(path: Path) -> list[dict[str, str]]:
    """Rows of a CSV file, each by the names of its columns."""
    with path.open(newline="") as file:
        return list(csv.DictReader(file))
