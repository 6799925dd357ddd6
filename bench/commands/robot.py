"""The verb `robot`: error against milliseconds since touch (bench/workflows/robot_trade.py)."""

import argparse

from bench.base.exit_codes import DONE
from bench.base.progress import begin_step
from bench.commands.options import (
    Verbs,
    add_alpha_est,
    add_out,
    add_recorded,
    add_trials,
    add_verb,
    add_workers,
)


def add(verbs: Verbs) -> None:
    """Add the verb."""
    verb = add_verb(
        verbs,
        "robot",
        run,
        "error of each estimator against milliseconds since touch, cut-off, sample rate and bits: table and figure",
        "whisker-bench robot fixtures/small-session --out demo-out",
    )
    add_recorded(verb)
    add_out(
        verb,
        "OUT",
        "folder for table and figure; an evaluation that stands there is taken as it is",
    )
    add_alpha_est(verb)
    add_trials(verb)
    add_workers(verb)


def run(options: argparse.Namespace) -> int:
    """Write table and figure, print the front; return the exit code."""
    begin_step(f"reading {options.session}")
    from bench.base.settings import Settings
    from bench.workflows.robot_points import trade_lines
    from bench.workflows.robot_trade import robot_trade

    settings = Settings(
        alpha_est_deg=options.alpha_est_deg,
        trials=options.trials,
        follow_links=options.follow_links,
    )
    points = robot_trade(
        options.session,
        options.out,
        settings,
        workers=options.workers,
    )
    print(*trade_lines(points), sep="\n")
    return DONE
