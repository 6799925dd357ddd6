"""The verb `board`: a ChArUco board to print (bench/setup/board_pdf.py)."""

import argparse

from bench.commands.options import DONE, Verbs, add_out, add_verb, parse_squares


def add(verbs: Verbs) -> None:
    """Add the verb."""
    verb = add_verb(
        verbs,
        "board",
        run,
        "a ChArUco board as a PDF at exact scale with rulers, and its lines for session.toml",
        "whisker-bench board --out board.pdf --squares 8x6 --square-mm 15",
    )
    add_out(verb, "FILE", "PDF to write")
    verb.add_argument(
        "--squares",
        type=parse_squares,
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


def run(options: argparse.Namespace) -> int:
    """Write the PDF, print the board's lines for session.toml; return the exit code."""
    from bench.setup.board_pdf import MARKER_SHARE, toml_block, write_board
    from vision.geometry import Board

    board = Board(
        options.squares,
        options.square_mm,
        options.marker_mm or round(MARKER_SHARE * options.square_mm, 2),
        options.dictionary,
        options.legacy,
        options.inverted,
    )
    paper = write_board(options.out, board)
    written = f"written: {options.out}, {paper.name}; print it at 100 %, then measure it"
    print(*toml_block(board), "", written, sep="\n")
    return DONE
