"""The verb `robot`. Parsing only."""

import argparse
import sys

from bench.commands.options import DONE, Verbs, add_out, add_recorded, add_verb, add_workers


def add_robot(verbs: Verbs) -> None:
    """`robot`."""
    verb = add_verb(
        verbs,
        "robot",
        _robot,
        "error of each estimator against milliseconds since touch, cut-off, sample rate and bits: table and figure",
        "whisker-bench robot fixtures/small-session --out demo-out",
    )
    add_recorded(verb)
    add_out(
        verb,
        "OUT",
        "folder for table and figure; an evaluation that stands there is taken as it is",
    )
    verb.add_argument(
        "--alpha-est-deg",
        type=float,
        metavar="X",
        help="friction angle that (10) assumes (default 10)",
    )
    verb.add_argument(
        "--trials", default="*", metavar="PATTERN", help="only trials of such names (default: all)"
    )
    add_workers(verb)


def _robot(options: argparse.Namespace) -> int:
    from bench.base.workers import single_thread

    single_thread()
    from bench.base.settings import Settings
    from bench.commands.robot_trade import robot_trade, trade_lines

    given = {} if options.alpha_est_deg is None else {"alpha_est_deg": options.alpha_est_deg}
    settings = Settings(trials=options.trials, follow_links=options.follow_links, **given)
    shown = {"progress": sys.stderr.isatty()}
    points = robot_trade(options.session, options.out, settings, workers=options.workers, **shown)
    print(*trade_lines(points), sep="\n")
    return DONE
