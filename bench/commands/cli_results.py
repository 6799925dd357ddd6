"""Verbs of the command line that look at evaluated runs: `report`, `compare`, `view`. Parsing only."""

import argparse
from pathlib import Path

from bench.commands.options import DONE, Verbs, add_figure_format, add_run, add_verb


def add_report(verbs: Verbs) -> None:
    """`report`."""
    verb = add_verb(
        verbs,
        "report",
        _report,
        "report.html, methods.md and results.bib of an evaluated run again, from its results alone",
        "whisker-bench report demo-out --figure-format pdf",
    )
    add_run(verb)
    add_figure_format(verb)


def add_compare(verbs: Verbs) -> None:
    """`compare`."""
    verb = add_verb(
        verbs,
        "compare",
        _compare,
        "evaluated runs side by side: which whisks changed, and by how many sigmas (exit code 1 where any did)",
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


def _compare(options: argparse.Namespace) -> int:
    from bench.array.array_results import is_array
    from bench.array.compare_arrays import compare_arrays
    from bench.report.compare_runs import compare_runs

    compare = compare_arrays if is_array(options.runs[0]) else compare_runs
    lines, code = compare(options.runs, options.out)
    print(*lines, sep="\n")
    return code


def add_view(verbs: Verbs) -> None:
    """`view`."""
    verb = add_verb(
        verbs,
        "view",
        _view,
        "a trial of an evaluated run as an annotated film: frames with wire, bar and contact, and the curves",
        "whisker-bench view demo-out b60_4",
    )
    add_run(verb)
    verb.add_argument("trial", metavar="TRIAL", help="name of the trial")
    verb.add_argument(
        "--session", type=Path, metavar="SESSION", help="its session, where that was moved"
    )
    verb.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help=".webm (VP9) or .avi (default OUT/video/TRIAL.webm)",
    )
    verb.add_argument(
        "--rate-Hz",
        type=float,
        default=10.0,
        metavar="X",
        help="frames a second of the film (default 10)",
    )


def _view(options: argparse.Namespace) -> int:
    from bench.report.video import write_video

    print(
        write_video(
            options.run_folder, options.trial, options.out, options.session, options.rate_Hz
        )
    )
    return DONE


def _report(options: argparse.Namespace) -> int:
    from bench.api import report

    print(*report(options.run_folder, options.figure_format), sep="\n")
    return DONE
