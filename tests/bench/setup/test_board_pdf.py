"""The printed board: found by the program's own detector, at the scale that the PDF states."""

import re
import shutil
import subprocess
import tomllib
import zlib

import cv2
import numpy as np
import pytest

from bench.commands.cli import main
from bench.setup.board_pdf import (
    MM_PER_INCH,
    dark_shapes,
    page,
    paper_for,
    toml_block,
    write_board,
)
from tests.scenes.board_prints import KINDS, NAMES
from vision.boards.charuco import CharucoBoard
from vision.boards.corners import find_corners

DPI = 300
LENS_PX = 1.0
EDGE_MM = 12.0
BOARD = CharucoBoard((8, 6), 15.0, 11.0, "DICT_5X5_100")
BOARDS = [
    BOARD,
    CharucoBoard((5, 9), 20.0, 15.0, "DICT_4X4_50", legacy=True),
    CharucoBoard((11, 8), 12.5, 9.0, "DICT_6X6_250", inverted=True),
]


def check_found(picture: np.ndarray, board: CharucoBoard, most_px: float) -> None:
    """Every corner is found, as through a lens (its blur: edges sharper than a pixel are no photograph), and neighbours
    are a square apart."""
    corners = find_corners(cv2.GaussianBlur(picture, (0, 0), LENS_PX), board)
    across, down = (n - 1 for n in board.squares)
    assert len(corners.ids) == across * down
    px = np.full((across * down, 2), np.nan)
    px[corners.ids] = corners.px
    grid = px.reshape(down, across, 2)
    pitch = board.square_mm / MM_PER_INCH * DPI
    assert grid[0, -1, 0] - grid[0, 0, 0] == pytest.approx((across - 1) * pitch, abs=most_px)
    assert grid[-1, 0, 1] - grid[0, 0, 1] == pytest.approx((down - 1) * pitch, abs=most_px)


@pytest.mark.parametrize("board", BOARDS, ids=lambda b: b.dictionary)
def test_the_drawing_is_found_again(board):
    """Each pixel as dark as the share of it that is printed: corners lie where they should to a tenth of a pixel."""
    width, height = (n * board.square_mm + 2 * EDGE_MM for n in board.squares)
    printed = np.zeros([round(DPI / MM_PER_INCH * n) for n in (height, width)])
    for box in dark_shapes(board):
        (left, top), (right, bottom) = (box[[0, 2]] + EDGE_MM) * DPI / MM_PER_INCH
        rows, columns = (slice(int(a), int(np.ceil(b))) for a, b in ((top, bottom), (left, right)))
        share = np.outer(covered(rows, top, bottom), covered(columns, left, right))
        printed[rows, columns] = np.maximum(printed[rows, columns], share)
    check_found(np.round(255 * (1 - printed)).astype(np.uint8), board, most_px=0.1)


@pytest.mark.parametrize("board", KINDS[1:], ids=NAMES[1:])
def test_boards_of_other_kinds_are_found_again(board):
    """Polygons drawn four times as fine, with their rims: points lie as they should to such a fine pixel."""
    shapes = list(dark_shapes(board))
    low = np.concatenate(shapes).min(axis=0) - EDGE_MM
    width, height = np.ptp(np.concatenate(shapes), axis=0) + 2 * EDGE_MM
    fine = 4 * DPI / MM_PER_INCH
    rows, columns = (4 * round(DPI / MM_PER_INCH * n) for n in (height, width))
    drawn = np.full((rows, columns), 255, dtype=np.uint8)
    for shape in shapes:
        cv2.fillConvexPoly(drawn, np.round((shape - low) * fine).astype(np.int32), 0)
    coarse = drawn.reshape(rows // 4, 4, columns // 4, 4).mean(axis=(1, 3))
    picture = np.round(cv2.GaussianBlur(coarse, (0, 0), LENS_PX)).astype(np.uint8)
    corners = find_corners(picture, board)
    assert len(corners) == len(board.corners_mm)
    places = board.corners_mm[corners.ids, :2] * DPI / MM_PER_INCH
    M, _ = cv2.estimateAffine2D(places, corners.px)
    np.testing.assert_allclose(np.linalg.norm(M[:, :2], axis=0), 1.0, atol=1e-3)
    assert np.abs(places @ M[:, :2].T + M[:, 2] - corners.px).max() < 0.25


def covered(pixels: slice, low: float, high: float) -> np.ndarray:
    """What share of each of these pixels lies between low and high."""
    edges = np.arange(pixels.start, pixels.stop)
    return np.minimum(edges + 1, high) - np.maximum(edges, low)


@pytest.mark.skipif(
    shutil.which("pdftoppm") is None, reason="no pdftoppm (apt install poppler-utils)"
)
@pytest.mark.parametrize("board", BOARDS, ids=lambda b: b.dictionary)
def test_the_pdf_is_found_again(board, tmp_path):
    """pdftoppm moves each edge to a whole pixel, half a pixel at most."""
    write_board(tmp_path / "board.pdf", board)
    command = [
        "pdftoppm",
        "-r",
        str(DPI),
        "-gray",
        "-singlefile",
        tmp_path / "board.pdf",
        tmp_path / "board",
    ]
    subprocess.run(command, check=True)
    check_found(cv2.imread(str(tmp_path / "board.pgm"), cv2.IMREAD_GRAYSCALE), board, most_px=1.0)


def test_the_pdf_states_its_scale(tmp_path):
    """Page and rectangles in points, read from the file itself."""
    paper = write_board(tmp_path / "board.pdf", BOARD)
    written = (tmp_path / "board.pdf").read_bytes()
    box = [float(n) for n in re.search(rb"/MediaBox \[([^]]+)\]", written)[1].split()]
    assert box[2:] == pytest.approx(
        [72 / MM_PER_INCH * n for n in (paper.width_mm, paper.height_mm)], abs=1e-3
    )
    streams = re.findall(rb"stream\r?\n(.*?)endstream", written, flags=re.DOTALL)
    text = b"".join(_inflated(stream) for stream in streams).decode("latin-1")
    across = [float(x) for x in re.findall(r"^(-?[\d.]+) -?[\d.]+ [ml]$", text, flags=re.MULTILINE)]
    width = 72 / MM_PER_INCH * 8 * 15.0
    assert any(abs(b - a - width) < 1e-3 for a in set(across) for b in set(across))


def _inflated(stream: bytes) -> bytes:
    try:
        return zlib.decompress(stream)
    except zlib.error:
        return b""


def test_the_same_board_gives_the_same_bytes(tmp_path):
    for name in ("a.pdf", "b.pdf"):
        write_board(tmp_path / name, BOARD)
    assert (tmp_path / "a.pdf").read_bytes() == (tmp_path / "b.pdf").read_bytes()


def test_nothing_stands_over_the_board_or_off_the_page():
    for board in BOARDS:
        paper = paper_for(board)
        figure = page(board, paper)
        figure.draw_without_rendering()
        width, height = figure.bbox.width, figure.bbox.height
        for text in figure.axes[0].texts:
            box = text.get_window_extent()
            assert box.x0 >= 0 and box.x1 <= width and box.y0 >= 0 and box.y1 <= height


def test_lines_for_the_manifest():

    assert CharucoBoard(**tomllib.loads("\n".join(toml_block(BOARDS[1])))["board"]) == BOARDS[1]


@pytest.mark.parametrize(
    "bad",
    [
        ["--out", "board.txt"],
        ["--out", "b.pdf", "--square-mm", "400"],
        ["--out", "b.pdf", "--square-mm", "nan"],
        ["--out", "b.pdf", "--marker-mm", "15"],
        ["--out", "b.pdf", "--dictionary", "DICT_X"],
        ["--out", "b.pdf", "--squares", "40x40", "--square-mm", "5"],
    ],
)
def test_what_is_no_board_is_one_line(bad, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["board", *bad]) == 2
    said = capsys.readouterr().err
    assert said.startswith("whisker-bench: ") and said.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("kind", ["checkerboard", "circles", "asymmetric_circles", "aprilgrid"])
def test_a_board_of_another_kind_is_printed_with_its_lines(kind, tmp_path, capsys):
    path = tmp_path / "board.pdf"
    assert main(["board", "--out", str(path), "--kind", kind, "--squares", "5x4"]) == 0
    assert path.is_file() and f'kind = "{kind}"' in capsys.readouterr().out


def test_a_face_of_a_body_is_printed_with_its_own_markers(tmp_path, capsys):
    out = ["board", "--out", str(tmp_path / "face.pdf"), "--first-id"]
    assert main([*out, "30"]) == 0
    assert "first_id = 30" in capsys.readouterr().out
    assert main([*out, "80"]) == 2
    assert "needs 24 markers from 80 on, DICT_5X5_100 has 100" in capsys.readouterr().err


def test_squares_are_two_counts(capsys):
    with pytest.raises(SystemExit) as done:
        main(["board", "--out", "b.pdf", "--squares", "8"])
    assert done.value.code == 2 and "8x6" in capsys.readouterr().err
