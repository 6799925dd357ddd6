"""[board] of every kind: what it needs, what it may not have, and Kalibr's file in place of it."""

import pytest

from bench.base.errors import BadInput
from bench.session.session import load_session

APRIL = "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 5\ntagSize: 0.03\ntagSpacing: 0.3\n"
SIZES = "squares = [8, 7]\nsquare_mm = 13.0\n"
MARKERS = 'marker_mm = 9.0\ndictionary = "DICT_5X5_100"\n'
BODY = f'kind = "body"\n{SIZES}{MARKERS}first_ids = [0, 28, 60]\n'


def session_with(board: str, folder):
    (folder / "session.toml").write_text(f"format = 1\n[board]\n{board}")
    return load_session(folder)


def test_each_kind_is_read_with_its_sigmas(tmp_path):
    board = session_with(f'kind = "checkerboard"\n{SIZES}', tmp_path).board
    assert board.kind == "checkerboard" and board.squares == (8, 7)
    # a print's square is off by 0.1 %, as everywhere
    assert board.square_sigma_mm == pytest.approx(0.013) and board.stretch_sigma == 1e-3
    for kind in ("circles", "asymmetric_circles", "aprilgrid"):
        text = f'kind = "{kind}"\n{SIZES}marker_mm = 9.0\n'
        assert session_with(text, tmp_path).board.kind == kind


def test_kalibr_s_file_states_the_board(tmp_path):
    (tmp_path / "april.yaml").write_text(APRIL)
    board = session_with('kalibr_target = "april.yaml"\n', tmp_path).board
    assert board.kind == "aprilgrid" and board.squares == (6, 5)
    assert board.square_sigma_mm == pytest.approx(0.039)


def test_a_body_is_read_with_its_faces(tmp_path):
    body = session_with(BODY, tmp_path).board
    assert body.kind == "body" and body.first_ids == (0, 28, 60)
    assert [face.first_id for face in body.faces] == [0, 28, 60]
    assert body.square_sigma_mm == pytest.approx(0.013)
    single = session_with(f"{SIZES}{MARKERS}first_id = 28\n", tmp_path).board
    assert single.first_id == 28 and single.spare_markers == ("DICT_5X5_100", 56)


@pytest.mark.parametrize(
    "board, words",
    [
        (f'kind = "chessboard"\n{SIZES}', "kind: 'chessboard' is none of its values"),
        (f'kind = "circles"\n{SIZES}', r"\[board\] marker_mm is missing"),
        (SIZES, r"\[board\] marker_mm is missing"),
        (f'kind = "checkerboard"\n{SIZES}marker_mm = 9.0\n', "marker_mm is none of kind"),
        (f'kind = "checkerboard"\n{SIZES}legacy = true\n', "legacy is none of kind"),
        (f'kind = "circles"\n{SIZES}marker_mm = 14.0\n', "touch each other"),
        ('kind = "checkerboard"\nsquare_mm = 9.0\n', r"\[board\] squares is missing"),
        (BODY.replace("first_ids = [0, 28, 60]", ""), r"\[board\] first_ids is missing"),
        (BODY.replace("28", "20"), "faces from 0 and 20 on share markers, each has 28"),
        (BODY.replace("60", "80"), "needs 28 markers from 80 on, DICT_5X5_100 has 100"),
        (BODY.replace("[0, 28, 60]", "[0]"), "a body has two faces or more"),
        (f"{SIZES}{MARKERS}first_ids = [0, 28]\n", "first_ids is none of kind"),
        ('kalibr_target = "april.yaml"\nsquare_mm = 9.0\n', "state the same: keep one"),
        ('kalibr_target = "other.yaml"\n', "there is no such file"),
        ('kalibr_target = "bad.yaml"\n', "no target file of Kalibr"),
    ],
)
def test_what_is_no_board_is_one_line(board, words, tmp_path):
    (tmp_path / "april.yaml").write_text(APRIL)
    (tmp_path / "bad.yaml").write_text("cam0: 1\n")
    with pytest.raises(BadInput, match=words) as refused:
        session_with(board, tmp_path)
    assert "\n" not in str(refused.value)
