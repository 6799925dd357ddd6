"""The verb `compare`: evaluated runs side by side (bench/report/compare_runs.py, bench/array)."""

import argparse
from pathlib import Path

from bench.base.progress import begin_step
from bench.commands.options import Verbs, add_verb


def add(verbs: Verbs) -> None:
    """Add the verb."""
    verb = add_verb(
        verbs,
        "compare",
        run,
        "compare evaluated runs: which whisks changed, and by how many sigmas (exit code 1 where any did)",
        "whisker-bench compare monday-out tuesday-out --out changes.csv",
    )
    verb.add_argument(
        "runs",
        type=Path,
        nargs="+",
        metavar="OUT",
        help="folders that `evaluate --out` wrote, two or more",
    )
    verb.add_argument(
        "--out", type=Path, metavar="FILE", help="CSV file to write, a row a whisk and quantity"
    )


def run(options: argparse.Namespace) -> int:
    """Print what changed from run to run; return the exit code."""
    begin_step(f"reading {options.runs[0]}")
    from bench.array.array_results import is_array
    from bench.array.compare_arrays import compare_arrays
    from bench.report.compare_runs import compare_runs

    compare = compare_arrays if is_array(options.runs[0]) else compare_runs
    lines, code = compare(options.runs, options.out)
    print(*lines, sep="\n")
    return code
