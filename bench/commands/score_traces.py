"""The verb `score-traces`: any tracker's lines against ours (bench/workflows/trace_scores.py)."""

import argparse
import sys
from pathlib import Path

from bench.base.exit_codes import DONE, WITH_WARNINGS
from bench.base.progress import begin_step
from bench.commands.options import Verbs, add_out, add_recorded, add_trials, add_verb, add_workers


def add(verbs: Verbs) -> None:
    """Add the verb."""
    verb = add_verb(
        verbs,
        "score-traces",
        run,
        "compare a tracker's lines of the wire with ours, frame by frame: bias, scatter, coverage",
        "whisker-bench score-traces fixtures/bring/traces --traces fixtures/bring/traces/trials --out scores",
    )
    add_recorded(verb)
    verb.add_argument(
        "--traces",
        type=Path,
        required=True,
        metavar="FOLDER",
        help="a folder a trial, of the trial's name, with trace_<camera>.csv or a tracker's own file",
    )
    add_out(
        verb, "OUT", "folder for tables and figure; a truth that stands there is taken as it is"
    )
    add_trials(verb)
    add_workers(verb)


def run(options: argparse.Namespace) -> int:
    """Write tables and figure, print a sentence a camera; return the exit code."""
    begin_step(f"reading {options.session}")
    from bench.base.settings import Settings
    from bench.workflows.trace_scores import score_traces

    settings = Settings(trials=options.trials, follow_links=options.follow_links)
    scores, warnings = score_traces(
        options.session, options.traces, options.out, settings, workers=options.workers
    )
    print(*scores, sep="\n")
    for warning in warnings:
        print(f"whisker-bench: {warning}", file=sys.stderr)
    return WITH_WARNINGS if warnings else DONE
