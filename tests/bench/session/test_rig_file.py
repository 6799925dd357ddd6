"""rig.toml: written and read alike, refused where it is damaged or another session's."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.commands.cli import main
from bench.session.rig_file import (
    RigFileKeys,
    covariance_as_written,
    hash_of_rig,
    write_rig,
)
from bench.session.session import load_session

COVARIANCE = np.diag([2e-3, 3e-3, 1e-3, 0.04, 0.05, 0.09]) ** 2
COVARIANCE[0, 4] = COVARIANCE[4, 0] = 0.3 * 2e-3 * 0.05


def rig_file(session, T_rig_board, covariance=COVARIANCE) -> Path:
    """Write rig.toml into a session's folder."""
    keys = RigFileKeys(
        T_rig_board=np.asarray(T_rig_board).tolist(),
        covariance_deg_mm=covariance_as_written(covariance),
        rig_pictures=hash_of_rig(session.rig_pictures.values()),
        measured_from=["marker 40 on the hub in 106 pictures", "3 free strokes of 1.5 degrees"],
        trials=["b30_3"],
        trial_files="0" * 32,
    )
    write_rig(session.path / "rig.toml", keys, ["measured"])
    return session.path / "rig.toml"


def without_stated(path: Path) -> None:
    """Take T_rig_board out of session.toml."""
    text = (path / "session.toml").read_text()
    (path / "session.toml").write_text(re.sub(r"T_rig_board = .*\n", "", text))


def shifted(T_rig_board, along_mm):
    """A pose whose board stands elsewhere along rig x."""
    return T_rig_board + np.column_stack([np.zeros((3, 3)), [along_mm, 0.0, 0.0]])


def test_what_is_written_is_read(small_copy):
    session = load_session(small_copy)
    rig_file(session, session.T_rig_board)
    without_stated(small_copy)
    read = load_session(small_copy)
    assert read.T_rig_board is None
    np.testing.assert_allclose(read.measured_rig.T_rig_board, session.T_rig_board, atol=1e-12)
    np.testing.assert_allclose(read.measured_rig.covariance, COVARIANCE, rtol=1e-12, atol=1e-30)
    assert "marker 40" in read.measured_rig.source and "3 free strokes" in read.measured_rig.source


def test_a_copy_of_it_in_session_toml_is_no_second_measurement(small_copy):
    session = load_session(small_copy)
    rig_file(session, session.T_rig_board + 1e-6)
    copied = load_session(small_copy)
    assert copied.T_rig_board is None
    assert not any("T_rig_board" in given.key for given in copied.givens)
    rig_file(session, shifted(session.T_rig_board, 0.01))
    assert load_session(small_copy).T_rig_board is not None


def test_beside_cameras_toml_it_is_not_read(small_copy):
    session = load_session(small_copy)
    rig_file(session, session.T_rig_board).write_text("no TOML")
    (small_copy / "cameras.toml").write_text("")
    assert load_session(small_copy).measured_rig is None


FIRST_ROW = re.compile(r"T_rig_board = \[\n.*?\],\n", flags=re.DOTALL)
FAULTS = {
    "cut": (lambda text: text[: len(text) // 2], "is not TOML"),
    "empty": (lambda text: "", "is missing"),
    "an extra key": (lambda text: text + "square_mm = 15.0\n", "square_mm is not a key"),
    "other pictures": (
        lambda text: re.sub(r'rig_pictures = ".*"', 'rig_pictures = "0"', text),
        "was measured by other pictures than those in boards/rig; remove it",
    ),
    "no rotation": (lambda text: re.sub(r"0\.99756\d*", "1.7", text, count=1), "no.* rotation"),
    "rows missing": (lambda text: FIRST_ROW.sub("T_rig_board = [\n", text, count=1), "T_rig_board"),
    "not a number": (lambda text: re.sub(r"\d+\.\d+e-?\d+|0\.0\d+", "nan", text, count=1), "rig.toml"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_a_damaged_file_is_one_line_and_exit_2(small_copy, fault, capsys):
    session = load_session(small_copy)
    path = rig_file(session, session.T_rig_board)
    change, found = FAULTS[fault]
    text = path.read_text()
    path.write_text(change(text))
    assert path.read_text() != text
    out = small_copy.parent / "out"
    assert main(["evaluate", str(small_copy), "--out", str(out)]) == 2
    last = capsys.readouterr().err.strip().splitlines()[-1]
    assert "rig.toml" in last and re.search(found, last)
    assert not (out / "run.json").exists()


@pytest.mark.parametrize("spoilt", ["variance 0", "asymmetric", "correlation 2"])
def test_what_is_no_covariance_is_refused(small_copy, spoilt):
    session = load_session(small_copy)
    covariance = COVARIANCE.copy()
    if spoilt == "variance 0":
        covariance[2, 2] = 0.0
    if spoilt == "asymmetric":
        covariance[0, 1] = 1e-6
    if spoilt == "correlation 2":
        covariance[0, 1] = covariance[1, 0] = 2 * 2e-3 * 3e-3
    rig_file(session, session.T_rig_board, covariance)
    with pytest.raises(BadInput, match=r"rig\.toml: covariance_deg_mm is no covariance"):
        load_session(small_copy)


def test_a_folder_of_that_name_is_refused(small_copy):
    (small_copy / "rig.toml").mkdir()
    with pytest.raises(BadInput, match=r"rig\.toml: is a folder"):
        load_session(small_copy)


def test_check_lists_it_with_all_else_that_is_wrong(small_copy):
    session = load_session(small_copy)
    rig_file(session, session.T_rig_board).write_text("T_rig_board = 3")
    problems = InputProblems(stop_at_first=False)
    load_session(small_copy, problems)
    assert any(line.startswith("rig.toml") for line in problems.refusals)


def test_the_hash_is_of_the_pictures_alone(small_copy):
    session = load_session(small_copy)
    before = hash_of_rig(session.rig_pictures.values())
    moved = {
        name: path.rename(path.with_name(path.name)) for name, path in session.rig_pictures.items()
    }
    assert hash_of_rig(moved.values()) == before
    assert hash_of_rig(list(replace(session).rig_pictures.values())[:1]) != before
