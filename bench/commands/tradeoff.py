"""The verb `tradeoff`: time against error of the truth (bench/workflows/seeing_trade.py)."""

import argparse

from bench.base.exit_codes import DONE
from bench.base.progress import begin_step
from bench.commands.options import (
    Verbs,
    add_out,
    add_recorded,
    add_trials,
    add_verb,
    add_workers,
    parse_count,
)


def add(verbs: Verbs) -> None:
    """Add the verb."""
    verb = add_verb(
        verbs,
        "tradeoff",
        run,
        "time against error of the truth, over how thoroughly pictures are evaluated: table, plot, settings files",
        "whisker-bench tradeoff fixtures/small-session --out tradeoff-out",
    )
    add_recorded(verb)
    add_out(verb, "OUT", "folder for the table, the plot and the settings files")
    add_trials(verb)
    verb.add_argument(
        "--repeats",
        type=parse_count,
        default=2,
        metavar="N",
        help="how often each is timed (default 2)",
    )
    verb.add_argument(
        "--accuracy-mm",
        type=float,
        metavar="X",
        help="say which setting is the fastest whose d_x is expected to err by X or less (RMS)",
    )
    add_workers(verb)


def run(options: argparse.Namespace) -> int:
    """Time all settings and print the table; return the exit code."""
    begin_step(f"reading {options.session}")
    from bench.base.settings import Settings
    from bench.workflows.seeing_trade import pick_line, tradeoff, tradeoff_lines

    accuracy_mm = options.accuracy_mm
    Settings(accuracy_mm=accuracy_mm)  # refused before anything is timed
    settings = Settings(trials=options.trials, follow_links=options.follow_links)
    rows = tradeoff(
        options.session,
        options.out,
        settings,
        repeats=options.repeats,
        workers=options.workers,
    )
    print(*tradeoff_lines(rows), sep="\n")
    if accuracy_mm is not None:
        print(pick_line(rows, accuracy_mm, options.out))
    return DONE
