"""Evaluated arrays side by side: each whisker's runs."""

from collections.abc import Sequence
from pathlib import Path

from bench.array.array_results import folder_of, read_array_record
from bench.base.errors import BadInput
from bench.report.compare_runs import compare_runs


def compare_arrays(outs: Sequence[Path], file: Path | None) -> tuple[list[str], int]:
    """Compare arrays whisker by whisker with the first; return lines and the largest exit code.

    The table of each whisker goes to <file>@<whisker>. Raises BadInput where a folder is no array's,
    or of other whiskers than the first.
    """
    first = _whiskers(outs[0])
    for out in outs[1:]:
        others = _whiskers(out)
        if others != first:
            reason = f"has the whiskers {', '.join(others)}; {outs[0]} has {', '.join(first)}"
            raise BadInput(reason, file=out)
    lines = []
    largest_code = 0
    for name in first:
        table = file and file.with_stem(f"{file.stem}@{name}")
        more, code = compare_runs([folder_of(out, name) for out in outs], table)
        lines += more
        largest_code = max(largest_code, code)
    return lines, largest_code


def _whiskers(out: Path) -> list[str]:
    """Return the names of the whiskers of an array's run."""
    return [base.name for base in read_array_record(out).bases]
