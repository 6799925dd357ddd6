"""Evaluated arrays side by side: each whisker's runs."""

from collections.abc import Sequence
from pathlib import Path

from bench.array.array_results import folder_of, read_array_record
from bench.base.errors import BadInput
from bench.report.compare_runs import compare_runs


def compare_arrays(outs: Sequence[Path], file: Path | None) -> tuple[list[str], int]:
    """As `compare_runs`, whisker by whisker; the table of each goes to <file>@<whisker>. Raises BadInput where a folder
    is no array's, or of other whiskers than the first."""
    names = [[base.name for base in read_array_record(out).bases] for out in outs]
    lines, codes = [], []
    for out, those in zip(outs, names):
        if those != names[0]:
            raise BadInput(
                f"has the whiskers {', '.join(those)}; {outs[0]} has {', '.join(names[0])}",
                file=out,
            )
    for name in names[0]:
        table = file and file.with_stem(f"{file.stem}@{name}")
        said, code = compare_runs([folder_of(out, name) for out in outs], table)
        lines += said
        codes.append(code)
    return lines, max(codes)
