"""The verb `new`: the folders of a session and its manifest (bench/setup/new_session.py)."""

import argparse
import sys

from bench.commands.options import DONE, KIND_NAMES, Verbs, add_session, add_verb, parse_squares

_NUMBERS = {
    "--whisker-length-mm": "from base to tip",
    "--whisker-diameter-mm": "at the base",
    "--youngs-modulus-GPa": "of the whisker",
    "--bar-diameter-mm": "of the round bar that is touched",
    "--square-mm": "side of a square of the board, as measured",
    "--marker-mm": "side of one of its markers",
    "--origin-sigma-mm": "of the stage's origin against the whisker's base",
}


def add(verbs: Verbs) -> None:
    """Add the verb."""
    verb = add_verb(
        verbs,
        "new",
        run,
        "the folders of a session and an annotated session.toml; asks in a terminal for what no option gives",
        "whisker-bench new my-session --whisker-length-mm 100 --whisker-diameter-mm 1 --bar-diameter-mm 6",
    )
    add_session(verb)
    verb.add_argument("--name", default="", help="shown in reports (default: the folder's name)")
    verb.add_argument(
        "--truth",
        choices=("pictures", "stage"),
        default="pictures",
        help="where the truth comes from: cameras (default), or a stage or ruler",
    )
    verb.add_argument(
        "--no-motor-log",
        action="store_true",
        help="the signals have no motor_deg: the angle is by the motor's stated speed",
    )
    for option, what in _NUMBERS.items():
        verb.add_argument(option, type=float, metavar="X", help=what)
    verb.add_argument(
        "--squares",
        type=parse_squares,
        default=(8, 6),
        metavar="NxM",
        help="of the board (default 8x6)",
    )
    verb.add_argument(
        "--board-kind", default="charuco", choices=KIND_NAMES, help="of the board (default charuco)"
    )
    verb.add_argument(
        "--dictionary",
        default="DICT_5X5_100",
        metavar="NAME",
        help="of its markers, as OpenCV names it",
    )


def run(options: argparse.Namespace) -> int:
    """Write the session's folders, print what is left to do; return the exit code."""
    from bench.setup.new_session import BoardLines, new_session

    given = {}
    for option in _NUMBERS:
        name = option.removeprefix("--").replace("-", "_")
        if getattr(options, name) is not None:
            given[name] = getattr(options, name)
    ask = input if sys.stdin.isatty() else None
    board = BoardLines(options.board_kind, options.squares, options.dictionary)
    lines = new_session(
        options.session,
        options.name,
        given,
        board,
        ask,
        options.truth,
        motor_log=not options.no_motor_log,
    )
    print(*lines, sep="\n")
    return DONE
