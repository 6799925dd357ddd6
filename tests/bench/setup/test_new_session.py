"""A new session's manifest: what is filled in is read as it was given, what is not is asked for by `check`."""

import tomllib

import pytest

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.commands.cli import main
from bench.session.manifest import SessionKeys
from bench.session.strict_toml import as_keys
from bench.setup.new_session import FOLDERS, QUESTIONS, BoardLines, new_session

NUMBERS = {
    "whisker_length_mm": 100.0,
    "whisker_diameter_mm": 1.02,
    "youngs_modulus_GPa": 60.0,
    "bar_diameter_mm": 6.0,
    "square_mm": 15.03,
    "marker_mm": 11.0,
}


def options(numbers) -> list[str]:
    return [
        text
        for name, value in numbers.items()
        for text in (f"--{name.replace('_', '-')}", str(value))
    ]


def read(path):
    return as_keys(
        tomllib.loads((path / "session.toml").read_text()),
        SessionKeys,
        "session.toml",
        InputProblems(),
    )


def test_all_given_is_a_sound_manifest(tmp_path, capsys):
    path = tmp_path / "session"
    assert (
        main(["new", str(path), "--name", 'a "b"\nc', "--squares", "10x7", *options(NUMBERS)]) == 0
    )
    keys = read(path)
    assert (
        keys.name == 'a "b"\nc' and keys.board.squares == [10, 7] and keys.board.square_mm == 15.03
    )
    assert (keys.whisker.length_mm, keys.whisker.diameter_mm, keys.bar.diameter_mm) == (
        100.0,
        1.02,
        6.0,
    )
    assert all((path / folder).is_dir() for folder in FOLDERS)
    assert "FILL IN" not in capsys.readouterr().out


def test_what_is_not_given_is_missed_by_check(tmp_path, capsys):
    path = tmp_path / "session"
    assert main(["new", str(path), "--whisker-length-mm", "100"]) == 0
    assert "5 lines are to be filled in" in capsys.readouterr().out
    assert (path / "session.toml").read_text().count("FILL IN") == 5
    assert main(["check", str(path)]) == 2
    assert "[whisker] diameter_mm is missing" in capsys.readouterr().out


def test_a_terminal_is_asked_until_the_answer_makes_sense(tmp_path, capsys):
    answers = iter(["0.1", "one hundred", "100", "", "60", "6", "15", "11"])
    asked = []

    def ask(question: str) -> str:
        asked.append(question)
        return next(answers)

    new_session(tmp_path / "s", "s", {}, BoardLines("charuco", (8, 6), "DICT_5X5_100"), ask)
    text = (tmp_path / "s" / "session.toml").read_text()
    assert len(asked) == len(QUESTIONS) + 2
    assert (
        "length_mm = 100 " in text
        and "# diameter_mm = " in text
        and "youngs_modulus_GPa = 60 " in text
    )
    said = capsys.readouterr().out
    assert "Is it in metres? Then write 100." in said and "'one hundred' is no number" in said


def test_a_session_is_never_written_over(tmp_path, small_copy, capsys):
    before = (small_copy / "session.toml").read_bytes()
    assert main(["new", str(small_copy)]) == 2
    assert (small_copy / "session.toml").read_bytes() == before
    assert "already" in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--whisker-length-mm", "--square-mm", "--youngs-modulus-GPa"])
def test_what_is_implausible_is_one_line(option, tmp_path, capsys):
    assert main(["new", str(tmp_path / "s"), option, "nan"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "s").exists()


def test_the_board_s_place_is_measured_and_not_filled_in(tmp_path):
    assert main(["new", str(tmp_path / "s"), *options(NUMBERS)]) == 0
    text = (tmp_path / "s" / "session.toml").read_text()
    assert "whisker-bench calibrate rig" in text
    assert "[[1, 0, 0, 0]" not in text and read(tmp_path / "s").rig.T_rig_board is None


def test_another_kind_of_board_is_asked_for_what_it_has(tmp_path, capsys):
    numbers = {name: value for name, value in NUMBERS.items() if name != "marker_mm"}
    kind = ["--board-kind", "checkerboard"]
    assert main(["new", str(tmp_path / "s"), *kind, *options(numbers)]) == 0
    board = read(tmp_path / "s").board
    assert board.kind == "checkerboard" and board.marker_mm is None and board.dictionary is None
    assert "FILL IN" not in capsys.readouterr().out


def test_every_question_has_its_range():
    for question in QUESTIONS:
        with pytest.raises(BadInput):
            question.plausible_range.check(-1.0, question.key, "session.toml")


def test_check_counts_as_many_missing_lines_as_new(tmp_path, capsys):
    assert main(["new", str(tmp_path / "s")]) == 0
    assert "6 lines are to be filled in" in capsys.readouterr().out
    assert main(["check", str(tmp_path / "s")]) == 2
    missing = [line for line in capsys.readouterr().out.splitlines() if "is missing" in line]
    assert len(missing) == len(QUESTIONS) == 6


def test_without_a_motor_log_the_speed_is_to_be_filled_in(tmp_path):
    path = tmp_path / "session"
    assert main(["new", str(path), "--no-motor-log", *options(NUMBERS)]) == 0
    text = (path / "session.toml").read_text()
    assert read(path).trial.angle_from == "speed"
    assert text.count("speed") > 2 and "motor_deg" not in text
    assert "# speed_deg_s =        # FILL IN" in text
