"""What verbs of the command line share: how they are added, and their common options."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

DONE, DOUBTFUL, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
FAULT_OF_OURS = 70  # EX_SOFTWARE: neither a result nor the user's input

Run = Callable[[argparse.Namespace], int]
Verbs: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"


def add_verb(
    verbs: Verbs, name: str, run: Run, summary: str, example: str
) -> argparse.ArgumentParser:
    """A verb with its summary, a worked example and `-v`; `run` is called with the parsed options."""
    verb = verbs.add_parser(
        name,
        help=summary,
        description=summary[0].upper() + summary[1:] + ".",
        epilog=f"example:\n  {example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    verb.add_argument("-v", "--verbose", action="store_true", help="say what is being done")
    verb.set_defaults(run=run)
    return verb


def add_session(verb: argparse.ArgumentParser) -> None:
    """SESSION."""
    verb.add_argument(
        "session", type=Path, metavar="SESSION", help="folder of the recorded session"
    )


def add_recorded(verb: argparse.ArgumentParser) -> None:
    """SESSION as it was recorded, and where its pictures may lie."""
    add_session(verb)
    add_follow_links(verb)


def add_follow_links(verb: argparse.ArgumentParser) -> None:
    """--follow-links."""
    verb.add_argument(
        "--follow-links",
        action="store_true",
        help="cameras' folders, pictures and videos may be links that lead out of the session, to another disk; only "
        "where you know who made them",
    )


def add_out(verb: argparse.ArgumentParser, metavar: str, what: str) -> None:
    """--out, which must be given."""
    verb.add_argument("--out", type=Path, required=True, metavar=metavar, help=what)


def add_workers(verb: argparse.ArgumentParser) -> None:
    """--workers."""
    verb.add_argument(
        "--workers", type=count, default=1, metavar="N", help="processes to use (default 1)"
    )


def count(text: str) -> int:
    """A whole number from 1. Raises ArgumentTypeError."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 1")
    return int(text)


def add_figure_format(verb: argparse.ArgumentParser) -> None:
    """--figure-format, any number of times."""
    verb.add_argument(
        "--figure-format",
        action="append",
        default=[],
        choices=("png", "pdf", "svg"),
        help="figures for a paper too, as wide as a journal's column, in OUT/figures; may be given several times",
    )


def add_run(verb: argparse.ArgumentParser) -> None:
    """OUT of an evaluated run."""
    verb.add_argument(
        "run_folder", type=Path, metavar="OUT", help="folder that `evaluate --out` wrote"
    )
