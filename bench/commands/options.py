"""What the verbs share: how each is added, and options that several of them have."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

Run = Callable[[argparse.Namespace], int]
Verbs: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"


def add_verb(
    verbs: Verbs,
    name: str,
    run: Run,
    summary: str,
    example: str,
    *,
    needs_sound_environment: bool = True,
) -> argparse.ArgumentParser:
    """Add a verb with its summary, a worked example and `-v`; return its parser.

    run: is called with the parsed options and returns the exit code. needs_sound_environment: the
    versions of all libraries are checked before.
    """
    verb = verbs.add_parser(
        name,
        help=summary,
        description=summary[0].upper() + summary[1:] + ".",
        epilog=f"example:\n  {example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    verb.add_argument("-v", "--verbose", action="store_true", help="say what is being done")
    verb.set_defaults(run=run, needs_sound_environment=needs_sound_environment)
    return verb


def add_session(verb: argparse.ArgumentParser) -> None:
    """Add SESSION."""
    verb.add_argument(
        "session", type=Path, metavar="SESSION", help="folder of the recorded session"
    )


def add_recorded(verb: argparse.ArgumentParser) -> None:
    """Add SESSION and --follow-links, by which its pictures may lie elsewhere."""
    add_session(verb)
    add_follow_links(verb)


def add_follow_links(verb: argparse.ArgumentParser) -> None:
    """Add --follow-links."""
    verb.add_argument(
        "--follow-links",
        action="store_true",
        help="cameras' folders, pictures and videos may be links that lead out of the session, to another disk; only "
        "where you know who made them",
    )


def add_run(verb: argparse.ArgumentParser) -> None:
    """Add OUT, the folder of an evaluated run."""
    verb.add_argument(
        "run_folder", type=Path, metavar="OUT", help="folder that `evaluate --out` wrote"
    )


def add_out(verb: argparse.ArgumentParser, metavar: str, what: str) -> None:
    """Add --out, which must be given."""
    verb.add_argument("--out", type=Path, required=True, metavar=metavar, help=what)


def add_workers(verb: argparse._ActionsContainer) -> None:
    """Add --workers."""
    verb.add_argument(
        "--workers", type=parse_count, default=1, metavar="N", help="processes to use (default 1)"
    )


def add_trials(verb: argparse.ArgumentParser, example: str = "") -> None:
    """Add --trials, a pattern of names."""
    verb.add_argument(
        "--trials",
        default="*",
        metavar="PATTERN",
        help=f"only trials of such names{example} (default: all)",
    )


def add_alpha_est(verb: argparse.ArgumentParser) -> None:
    """Add --alpha-est-deg."""
    verb.add_argument(
        "--alpha-est-deg",
        type=float,
        default=10.0,
        metavar="X",
        help="friction angle that (10) assumes (default 10)",
    )


def add_figure_format(verb: argparse.ArgumentParser) -> None:
    """Add --figure-format, which may be given any number of times."""
    verb.add_argument(
        "--figure-format",
        action="append",
        default=[],
        choices=("png", "pdf", "svg"),
        help="figures for a paper too, as wide as a journal's column, in OUT/figures; may be given several times",
    )


def parse_count(text: str) -> int:
    """Return a whole number from 1. Raise ArgumentTypeError for any other text."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 1")
    return int(text)


def parse_squares(text: str) -> tuple[int, int]:
    """Return a board's counts of squares along x and y. Raise ArgumentTypeError for other text."""
    counts = text.lower().split("x")
    if len(counts) != 2 or not all(one.isdecimal() and int(one) > 1 for one in counts):
        raise argparse.ArgumentTypeError(f"{text!r} is not two counts of squares, such as 8x6")
    return int(counts[0]), int(counts[1])
