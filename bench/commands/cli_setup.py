"""Verbs of the command line before the first recording: `new`, `board`. Parsing only."""

import argparse
import sys

from bench.commands.options import DONE, Verbs, add_out, add_session, add_verb


def _squares(text: str) -> tuple[int, int]:
    counts = text.lower().split("x")
    if len(counts) != 2 or not all(count.isdecimal() and int(count) > 1 for count in counts):
        raise argparse.ArgumentTypeError(f"{text!r} is not two counts of squares, such as 8x6")
    return int(counts[0]), int(counts[1])


def add_new(verbs: Verbs) -> None:
    """`new`."""
    verb = add_verb(
        verbs,
        "new",
        _new,
        "the folders of a session and an annotated session.toml; asks in a terminal for what no option gives",
        "whisker-bench new my-session --whisker-length-mm 100 --whisker-diameter-mm 1 --bar-diameter-mm 6",
    )
    add_session(verb)
    verb.add_argument("--name", default="", help="shown in reports (default: the folder's name)")
    for option, what in _NUMBERS_OF_A_SESSION.items():
        verb.add_argument(option, type=float, metavar="X", help=what)
    verb.add_argument(
        "--squares", type=_squares, default=(8, 6), metavar="NxM", help="of the board (default 8x6)"
    )
    verb.add_argument(
        "--dictionary",
        default="DICT_5X5_100",
        metavar="NAME",
        help="of its markers, as OpenCV names it",
    )


_NUMBERS_OF_A_SESSION = {
    "--whisker-length-mm": "from base to tip",
    "--whisker-diameter-mm": "at the base",
    "--youngs-modulus-GPa": "of the whisker",
    "--bar-diameter-mm": "of the round bar that is touched",
    "--square-mm": "side of a square of the board, as measured",
    "--marker-mm": "side of one of its markers",
}


def _new(options: argparse.Namespace) -> int:
    from bench.setup.new_session import new_session

    names = [option.removeprefix("--").replace("-", "_") for option in _NUMBERS_OF_A_SESSION]
    given = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    ask = input if sys.stdin.isatty() else None
    print(
        *new_session(
            options.session, options.name, given, options.squares, options.dictionary, ask
        ),
        sep="\n",
    )
    return DONE


def add_board(verbs: Verbs) -> None:
    """`board`."""
    verb = add_verb(
        verbs,
        "board",
        _board,
        "a ChArUco board as a PDF at exact scale with rulers, and its lines for session.toml",
        "whisker-bench board --out board.pdf --squares 8x6 --square-mm 15",
    )
    add_out(verb, "FILE", "PDF to write")
    verb.add_argument(
        "--squares",
        type=_squares,
        default=(8, 6),
        metavar="NxM",
        help="along x and y (default 8x6)",
    )
    verb.add_argument(
        "--square-mm", type=float, default=15.0, metavar="X", help="side of a square (default 15)"
    )
    verb.add_argument(
        "--marker-mm", type=float, metavar="X", help="side of a marker (default 11/15 of a square)"
    )
    verb.add_argument(
        "--dictionary", default="DICT_5X5_100", metavar="NAME", help="as OpenCV names it"
    )
    verb.add_argument("--legacy", action="store_true", help="OpenCV's pattern from before 4.6")
    verb.add_argument("--inverted", action="store_true", help="white on black")


def _board(options: argparse.Namespace) -> int:
    from bench.setup.board_pdf import MARKER_SHARE, toml_block, write_board
    from vision.geometry.board import Board

    marker_mm = options.marker_mm or round(MARKER_SHARE * options.square_mm, 2)
    kind = options.dictionary, options.legacy, options.inverted
    board = Board(options.squares, options.square_mm, marker_mm, *kind)
    paper = write_board(options.out, board)
    print(
        *toml_block(board),
        "",
        f"written: {options.out}, {paper.name}; print it at 100 %, then measure it",
        sep="\n",
    )
    return DONE
