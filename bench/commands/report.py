"""The verb `report`: the report of an evaluated run, written again (bench/report/page)."""

import argparse

from bench.base.exit_codes import DONE
from bench.base.progress import begin_step
from bench.commands.options import Verbs, add_figure_format, add_run, add_verb


def add(verbs: Verbs) -> None:
    """Add the verb."""
    verb = add_verb(
        verbs,
        "report",
        run,
        "report.html, methods.md and results.bib of an evaluated run again, from its results alone",
        "whisker-bench report demo-out --figure-format pdf",
    )
    add_run(verb)
    add_figure_format(verb)


def run(options: argparse.Namespace) -> int:
    """Write the report, print the paths; return the exit code."""
    begin_step(f"reading {options.run_folder}")
    from bench.api import report

    print(*report(options.run_folder, options.figure_format), sep="\n")
    return DONE
