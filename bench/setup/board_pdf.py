"""`whisker-bench board`: a board as a PDF at exact scale, with rulers to check the print by."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import singledispatch
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from bench.base.drawing import paper_style, publish
from bench.base.errors import BadInput
from bench.rig.other_boards import PrintedAprilGrid, PrintedCheckerboard
from bench.rig.plate import Print
from bench.rig.printed_board import Ink, PrintedBoard
from bench.session.plausible import WIDTH
from vision.boards import AprilGrid, CharucoBoard, Checkerboard, CircleGrid
from vision.geometry import Board

MM_PER_INCH = 25.4
# Margins around the board: rulers on the left and below, with the words below them.
_LEFT_MM = 22.0
_RIGHT_MM = 10.0
_TOP_MM = 10.0
_BELOW_MM = 34.0
_RULER_MM = 8.0  # from the board's edge: the white around a board helps to find it
_A4_MM = (210.0, 297.0)  # mm: ISO 216
_LARGEST = 4  # formats beyond A4: A3, A2, A1, A0
_INK = Ink(white=1.0, black=0.0)
_CIRCLE_SIDES = 180  # of a printed circle: it errs by 0.02 % of its radius
_NO_MARKERS = ""  # dictionary of markers beside the board: a page has none
MARKER_SHARE = 11.0 / 15.0  # of the square: the marker's white frame is then as wide as its modules


@dataclass(frozen=True)
class Paper:
    """A page: its name, and width and height, mm."""

    name: str
    width_mm: float
    height_mm: float


def write_board(path: Path, board: Board) -> Paper:
    """Write the PDF whole and return its page.

    Raises BadInput where no page holds the board, or the path is no .pdf.
    """
    if path.suffix.lower() != ".pdf":
        raise BadInput("must end in .pdf", file=path)
    WIDTH.check(board.square_mm, "--square-mm", str(path))
    paper = paper_for(board)
    with paper_style():
        publish(page(board, paper), path.with_suffix(""), ["pdf"])
    return paper


def paper_for(board: Board) -> Paper:
    """Return the smallest of A4 to A0, either way round, that holds the board.

    Raises BadInput where none does.
    """
    width, height = _size_mm(board)
    short, long = _A4_MM
    for number in range(4, 4 - _LARGEST - 1, -1):
        landscape = Paper(f"A{number} landscape", long, short)
        for paper in (landscape, Paper(f"A{number} portrait", short, long)):
            has_width = width + _LEFT_MM + _RIGHT_MM <= paper.width_mm
            if has_width and height + _TOP_MM + _BELOW_MM <= paper.height_mm:
                return paper
        short, long = long, 2.0 * short
    found = f"a board of {width:g} x {height:g} mm fits no page up to A0"
    raise BadInput(f"{found}; take fewer or smaller squares")


def _size_mm(board: Board) -> tuple[float, float]:
    """Return width and height of what is printed, mm."""
    shapes = np.concatenate(list(dark_shapes(board)))
    width, height = np.ptp(shapes, axis=0)
    return float(width), float(height)


def toml_block(board: Board) -> list[str]:
    """Return the lines of the board in session.toml."""
    lines = ["[board]"]
    if board.kind != CharucoBoard.kind:
        lines.append(f'kind = "{board.kind}"')
    lines.append(f"squares = [{board.squares[0]}, {board.squares[1]}]")
    for name in ("square_mm", "marker_mm"):
        if hasattr(board, name):
            lines.append(f"{name} = {getattr(board, name):g}")
    if hasattr(board, "dictionary"):
        lines.append(f'dictionary = "{board.dictionary}"')
    if getattr(board, "first_id", 0):
        lines.append(f"first_id = {board.first_id}")
    flags = [name for name in ("legacy", "inverted") if getattr(board, name, False)]
    return [*lines, *(f"{name} = true" for name in flags)]


def page(board: Board, paper: Paper) -> Figure:
    """Draw the page, in mm from its upper left corner."""
    figure, axes = _blank_page(paper)
    width, height = _size_mm(board)
    left = 0.5 * (paper.width_mm + _LEFT_MM - _RIGHT_MM - width)
    top = 0.5 * (paper.height_mm + _TOP_MM - _BELOW_MM - height)
    shapes = list(dark_shapes(board))
    upper_left = np.concatenate(shapes).min(axis=0)
    dark = [shape - upper_left + [left, top] for shape in shapes]
    axes.add_collection(PolyCollection(dark, fc="black", ec="none", lw=0))
    _ruler(axes, (left, top + height + _RULER_MM), width, down=False)
    _ruler(axes, (left - _RULER_MM, top), height, down=True)
    _words(axes, board, left, top + height + _RULER_MM + 11.0)
    return figure


def _blank_page(paper: Paper) -> tuple[Figure, Axes]:
    """Make a page, and axes over all of it that are in mm from its upper left corner."""
    figure = Figure(figsize=(paper.width_mm / MM_PER_INCH, paper.height_mm / MM_PER_INCH))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, paper.width_mm), ylim=(paper.height_mm, 0))
    axes.set_axis_off()
    return figure, axes


@singledispatch
def dark_shapes(board: Board) -> Iterator[np.ndarray]:
    """Yield what is printed as polygons (n, 2), mm from anywhere, y downward.

    They overlap, so that there is no seam between them. Raises TypeError for a kind that has no
    print.
    """
    raise TypeError(f"no print of a board of kind {board.kind}")


@dark_shapes.register
def _of_charuco(board: CharucoBoard) -> Iterator[np.ndarray]:
    """Yield the dark rectangles of a ChArUco board, with its margin where it is white on black."""
    made = PrintedBoard(
        board.squares,
        board.square_mm,
        board.marker_mm,
        board.dictionary,
        board.legacy,
        board.inverted,
    )
    margin_mm = board.square_mm / 2 if board.inverted else 0.0
    return _dark_rectangles(made.to_print(_INK, margin_mm))


@dark_shapes.register
def _of_checkerboard(board: Checkerboard) -> Iterator[np.ndarray]:
    """Yield the dark squares of a checkerboard."""
    made = PrintedCheckerboard(board.squares, board.square_mm, _NO_MARKERS)
    return _dark_rectangles(made.to_print(_INK, 0.0))


@dark_shapes.register
def _of_circles(board: CircleGrid) -> Iterator[np.ndarray]:
    """Yield the circles of a grid."""
    angle = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_SIDES, endpoint=False)
    circle = 0.5 * board.marker_mm * np.column_stack([np.cos(angle), np.sin(angle)])
    for centre_mm in board.corners_mm[:, :2]:
        yield centre_mm + circle


@dark_shapes.register
def _of_april_grid(board: AprilGrid) -> Iterator[np.ndarray]:
    """Yield the tags of an AprilGrid as Kalibr prints them, and the dark squares between them."""
    made = PrintedAprilGrid(board.squares, board.square_mm, board.marker_mm, _NO_MARKERS)
    return _dark_rectangles(made.to_print(_INK, 0.0))


def _dark_rectangles(printed: Print) -> Iterator[np.ndarray]:
    """Yield rectangles (4, 2) that cover the dark cells of a print.

    They overlap, so that there is no seam between them: runs along rows, runs along columns, and squares
    of four cells.
    """
    dark = printed.reflectance < 0.5
    x = printed.x_mm
    y = printed.y_mm
    for row, cells in enumerate(dark):
        for left, right in _runs(cells):
            yield _box(x[left], x[right], y[row], y[row + 1])
    for column, cells in enumerate(dark.T):
        for top, bottom in _runs(cells):
            yield _box(x[column], x[column + 1], y[top], y[bottom])
    for row, column in _corners_of_four(dark):
        yield _box(x[column], x[column + 2], y[row], y[row + 2])


def _corners_of_four(dark: np.ndarray) -> np.ndarray:
    """Return row and column (n, 2) of the first of every four dark cells about one corner."""
    upper = dark[:-1, 1:] & dark[:-1, :-1]
    lower = dark[1:, 1:] & dark[1:, :-1]
    return np.argwhere(upper & lower)


def _runs(cells: np.ndarray) -> np.ndarray:
    """Return the first cell of each run of true cells, and the one after its last, (n, 2)."""
    steps = np.diff(np.concatenate([[0], cells.astype(int), [0]]))
    return np.stack([np.flatnonzero(steps == 1), np.flatnonzero(steps == -1)], axis=1)


def _box(x0: float, x1: float, y0: float, y1: float) -> np.ndarray:
    """Return the corners (4, 2) of a rectangle."""
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


def _ruler(axes: Axes, origin: tuple[float, float], length: float, *, down: bool) -> None:
    """Draw a ruler from the board's corner outwards: a tick each millimetre, a number each ten."""
    along = np.array([1.0, 0.0])
    outwards = np.array([0.0, 1.0])
    alignment = {"ha": "center", "va": "top"}
    if down:
        along = np.array([0.0, 1.0])
        outwards = np.array([-1.0, 0.0])
        alignment = {"ha": "right", "va": "center"}
    for mm in range(int(length + 1e-6) + 1):
        at = origin + mm * along
        tick_mm = 2.0
        if mm % 5 == 0:
            tick_mm = 3.0
        if mm % 10 == 0:
            tick_mm = 4.5
            x, y = at + 5.2 * outwards
            axes.text(x, y, str(mm), fontsize=6, **alignment)
        _draw_line(axes, at, at + tick_mm * outwards)
    _draw_line(axes, np.array(origin), origin + length * along)


def _draw_line(axes: Axes, start: np.ndarray, end: np.ndarray) -> None:
    """Draw a thin line between two points (2,)."""
    axes.plot([start[0], end[0]], [start[1], end[1]], color="black", lw=0.3)


def _words(axes: Axes, board: Board, left: float, top: float) -> None:
    """Write how to print the board and check the print, and its lines of session.toml."""
    lines = (
        "Print at 100 % (not fitted to the page), glue to something flat, hold both rulers, in mm, against steel.",
        "If they are wrong, write what you measure into square_mm and marker_mm, and how well into square_sigma_mm.",
        "   ".join(toml_block(board)),
    )
    axes.text(left, top, "\n".join(lines), va="top", fontsize=5.5, linespacing=1.5)
