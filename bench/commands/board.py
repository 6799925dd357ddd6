"""The verb `board`: a board to print (bench/setup/board_pdf.py)."""

import argparse

from bench.base.exit_codes import DONE
from bench.base.progress import begin_step
from bench.commands.options import Verbs, add_out, add_verb, parse_squares
from bench.setup.lab import KIND_NAMES


def add(verbs: Verbs) -> None:
    """Add the verb."""
    verb = add_verb(
        verbs,
        "board",
        run,
        "a board as a PDF at exact scale with rulers, and its lines for session.toml",
        "whisker-bench board --out board.pdf --squares 8x6 --square-mm 15",
    )
    add_out(verb, "FILE", "PDF to write")
    verb.add_argument("--kind", default="charuco", choices=KIND_NAMES, help="default charuco")
    verb.add_argument(
        "--squares",
        type=parse_squares,
        default=(8, 6),
        metavar="NxM",
        help="along x and y, or circles or tags (default 8x6)",
    )
    verb.add_argument(
        "--square-mm",
        type=float,
        default=15.0,
        metavar="X",
        help="side of a square, or from circle to circle, tag to tag (default 15)",
    )
    verb.add_argument(
        "--marker-mm",
        type=float,
        metavar="X",
        help="side of a marker or tag, diameter of a circle (default 11/15 of a square)",
    )
    verb.add_argument(
        "--dictionary", default="DICT_5X5_100", metavar="NAME", help="as OpenCV names it"
    )
    verb.add_argument(
        "--first-id",
        type=int,
        metavar="N",
        help="its first marker, for a face of a body (default 0)",
    )
    verb.add_argument("--legacy", action="store_true", help="OpenCV's pattern from before 4.6")
    verb.add_argument("--inverted", action="store_true", help="white on black")


def run(options: argparse.Namespace) -> int:
    """Write the PDF, print the board's lines for session.toml; return the exit code."""
    begin_step(f"drawing {options.out}")
    from bench.session.manifest import BoardKeys
    from bench.session.stated_board import marker_is_part, stated_board
    from bench.setup.board_pdf import MARKER_SHARE, toml_block, write_board

    is_charuco = options.kind == KIND_NAMES[0]
    marker_mm = options.marker_mm
    if marker_mm is None and marker_is_part(options.kind):
        marker_mm = round(MARKER_SHARE * options.square_mm, 2)
    keys = BoardKeys(
        kind=options.kind,
        squares=list(options.squares),
        square_mm=options.square_mm,
        marker_mm=marker_mm,
        dictionary=options.dictionary if is_charuco else None,
        first_id=options.first_id,
        legacy=options.legacy,
        inverted=options.inverted,
    )
    board = stated_board(keys, str(options.out))
    paper = write_board(options.out, board)
    written = f"written: {options.out}, {paper.name}; print it at 100 %, then measure it"
    print(*toml_block(board), "", written, sep="\n")
    return DONE
