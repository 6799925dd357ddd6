"""How hard pictures are looked at: the options of `evaluate` for it, and the verb `tradeoff`."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from bench.commands.options import Verbs, add_out, add_recorded, add_verb, count

if TYPE_CHECKING:
    from bench.base.settings import Seeing, Settings


def add_seeing(verb: argparse.ArgumentParser) -> None:
    """Options by which pictures are looked at less hard, or harder."""
    how = verb.add_mutually_exclusive_group()
    how.add_argument(
        "--preset",
        metavar="NAME",
        help="how hard pictures are looked at: draft, standard (default) or fine; what each costs, tradeoff measures",
    )
    how.add_argument(
        "--accuracy-mm",
        type=float,
        metavar="X",
        help="look at each whisk by draft, standard and fine in turn until d_x's stated sigma is X or less",
    )
    how.add_argument(
        "--settings",
        type=Path,
        metavar="FILE",
        help="the same from a TOML file, as tradeoff writes it",
    )


def add_watch(verb: argparse.ArgumentParser) -> None:
    """`--watch` of `evaluate`."""
    verb.add_argument(
        "--watch",
        type=float,
        nargs="?",
        const=2.0,
        metavar="S",
        help="while the session is recorded: evaluate each trial that is complete, looking every S seconds (2), until "
        "Ctrl-C",
    )


def watch(options: argparse.Namespace, settings: "Settings") -> int:
    """`evaluate --watch`. Raises BadInput for a time that is none."""
    from bench.base.errors import BadInput
    from bench.commands.watch import watch as watched

    if not 0 < options.watch <= 3600:
        raise BadInput(f"--watch {options.watch:g}: must be above 0 and at most 3600 s")
    told = {
        "progress": sys.stderr.isatty(),
        "figure_formats": options.figure_format,
        "announce": _at_once,
    }
    by = {"workers": options.workers, "dask": options.dask}
    return watched(options.session, options.out, settings, every_s=options.watch, **by, **told)


def _at_once(line: str) -> None:
    print(line, flush=True)


def seeing_of(options: argparse.Namespace) -> "Seeing":
    """The settings of `--preset` or `--settings`."""
    from bench.trials.seeing import STANDARD, by_preset, from_file

    return (
        from_file(options.settings) if options.settings else by_preset(options.preset or STANDARD)
    )


def add_tradeoff(verbs: Verbs) -> None:
    """The verb `tradeoff`."""
    verb = add_verb(
        verbs,
        "tradeoff",
        _tradeoff,
        "time against error of the truth, over how hard pictures are looked at: table, plot, settings files",
        "whisker-bench tradeoff fixtures/small-session --out tradeoff-out",
    )
    add_recorded(verb)
    add_out(verb, "OUT", "folder for the table, the plot and the settings files")
    verb.add_argument(
        "--trials", default="*", metavar="PATTERN", help="only trials of such names (default: all)"
    )
    verb.add_argument(
        "--repeats", type=count, default=2, metavar="N", help="how often each is timed (default 2)"
    )


def _tradeoff(options: argparse.Namespace) -> int:
    from bench.base.workers import single_thread

    single_thread()
    from bench.commands.tradeoff import tradeoff

    how = {"progress": sys.stderr.isatty(), "follow_links": options.follow_links}
    return tradeoff(
        options.session, options.out, trials=options.trials, repeats=options.repeats, **how
    )
