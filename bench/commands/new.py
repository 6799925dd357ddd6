"""The verb `new`: the folders of a session and its manifest (bench/setup/new_session.py)."""

import argparse
import sys
from collections.abc import Iterable
from typing import Any

from bench.base.exit_codes import DONE
from bench.commands.options import Verbs, add_session, add_verb, parse_squares
from bench.setup.lab import CHOICES, Lab

_NUMBERS = {
    "--whisker-length-mm": "from base to tip",
    "--whisker-diameter-mm": "at the base",
    "--youngs-modulus-GPa": "of the whisker",
    "--bar-diameter-mm": "of the round bar that is touched",
    "--square-mm": "side of a square of the board, as measured",
    "--marker-mm": "side of one of its markers",
    "--origin-sigma-mm": "of the stage's origin against the whisker's base",
    "--speed-deg-s": "of the motor, where its angle is not recorded",
    "--speed-sigma-deg-s": "one standard deviation of it",
    "--hub-marker": "number of the marker on the motor's hub",
}
# Short for an answer: the option, the question, the answer.
_SHORT = (
    ("--mirror", "cameras", "mirror"),
    ("--traces", "truth", "traces"),
    ("--traces-only", "truth", "traces-only"),
)


def add(verbs: Verbs) -> None:
    """Add the verb."""
    verb = add_verb(
        verbs,
        "new",
        run,
        "the folders of a session and an annotated session.toml; without options it asks in a terminal what there is",
        "whisker-bench new my-session --whisker-length-mm 100 --whisker-diameter-mm 1 --bar-diameter-mm 6",
    )
    add_session(verb)
    verb.add_argument("--name", default="", help="shown in reports (default: the folder's name)")
    for choice in CHOICES:
        verb.add_argument(
            f"--{choice.option.replace('_', '-')}", choices=choice.answers, help=choice.wanted
        )
    for option, name, answer in _SHORT:
        verb.add_argument(
            option,
            dest=name,
            action="store_const",
            const=answer,
            help=f"the same as --{name.replace('_', '-')} {answer}",
        )
    for option, what in _NUMBERS.items():
        verb.add_argument(option, type=float, metavar="X", help=what)
    verb.add_argument(
        "--squares", type=parse_squares, metavar="NxM", help="of the board (default 8x6)"
    )
    verb.add_argument(
        "--dictionary",
        metavar="NAME",
        help="of its markers, as OpenCV names it (default DICT_5X5_100)",
    )


def run(options: argparse.Namespace) -> int:
    """Write the session's folders, print what is left to do; return the exit code."""
    from bench.setup.new_session import new_session, require_no_session

    require_no_session(options.session)
    answers = _given(options, (choice.option for choice in CHOICES))
    numbers = _given(options, (option.removeprefix("--").replace("-", "_") for option in _NUMBERS))
    board = _given(options, ("squares", "dictionary"))
    asks = not (answers or numbers or board) and sys.stdin.isatty() and sys.stdout.isatty()
    ask = _answer if asks else None
    lab = Lab.of(answers, ask)
    print(*new_session(options.session, options.name, lab, numbers, ask=ask, **board), sep="\n")
    return DONE


def _given(options: argparse.Namespace, names: Iterable[str]) -> dict[str, Any]:
    """Return the options of these names that were given."""
    found = {}
    for name in names:
        value = getattr(options, name)
        if value is not None:
            found[name] = value
    return found


def _answer(question: str) -> str:
    """Return what a terminal answers; '' where its input ends."""
    try:
        return input(question)
    except EOFError:
        print()
        return ""
