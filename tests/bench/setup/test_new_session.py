"""A new session's manifest: what is filled in is read as it was given, what is not is asked for by `check`."""

import io
import sys
import tomllib
from itertools import product

import pytest

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.commands.cli import main
from bench.session.manifest import SessionKeys
from bench.session.session import load_session
from bench.session.strict_toml import as_keys
from bench.setup.lab import CHOICES, Lab
from bench.setup.new_session import new_session
from bench.setup.questions import QUESTIONS, questions_of

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
    assert all((path / folder).is_dir() for folder in ("boards", "boards/rig", "trials"))
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

    new_session(tmp_path / "s", "s", Lab.of({}), {}, ask)
    text = (tmp_path / "s" / "session.toml").read_text()
    assert len(asked) == len(NUMBERS) + 2
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


def test_a_file_where_a_folder_is_wanted_is_one_line(tmp_path, capsys):
    (tmp_path / "s").write_text("")
    assert main(["new", str(tmp_path / "s" / "session")]) == 2
    assert capsys.readouterr().err.endswith("a file stands where a folder is wanted\n")


@pytest.mark.parametrize(
    "board, expected",
    [
        (["--square-mm", "11", "--marker-mm", "15"], "is not smaller"),
        (["--square-mm", "15", "--marker-mm", "11", "--dictionary", "DICT_9X9"], "DICT_9X9"),
    ],
)
def test_a_board_that_cannot_be_is_one_line(board, expected, tmp_path, capsys):
    assert main(["new", str(tmp_path / "s"), *board]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and expected in said
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


def test_a_body_is_asked_for_its_faces(tmp_path, capsys):
    assert main(["new", str(tmp_path / "s"), "--board-kind", "body", *options(NUMBERS)]) == 0
    assert "1 line is to be filled in" in capsys.readouterr().out
    manifest = tmp_path / "s" / "session.toml"
    manifest.write_text(manifest.read_text().replace("# first_ids =", "first_ids = [0, 24]"))
    board = load_session(tmp_path / "s").board
    assert board.first_ids == (0, 24) and board.dictionary == "DICT_5X5_100"


def test_every_question_has_its_range():
    for question in QUESTIONS:
        with pytest.raises(BadInput):
            question.plausible_range.check(-1.0, question.key, "session.toml")


LABS = [
    dict(zip((choice.option for choice in CHOICES), answers))
    for answers in product(
        ("two", "mirror", "none"),
        ("pictures", "traces-only", "stage"),
        ("charuco", "checkerboard"),
        ("log", "marker", "whisker", "speed"),
        ("known", "moments"),
    )
    if answers[0] != "none"
]
LABS = [
    lab
    for lab in LABS
    if lab["angle_from"] == "log"
    or lab["truth"] == "stage"
    or (lab["truth"] == "pictures" and lab["angle_from"] != "speed")
]
LABS += [
    {"cameras": "none", "angle_from": source, "gauges": gauges}
    for source in ("log", "speed")
    for gauges in ("trials", "known", "moments")
]


@pytest.mark.parametrize("lab", LABS, ids=lambda lab: "-".join(lab.values()))
def test_check_counts_as_many_missing_lines_as_new(lab, tmp_path):
    """And as many as are marked in the file; once filled in, nothing is wrong."""
    path = tmp_path / "s"
    said = new_session(path, "", Lab.of(lab), {})
    text = (path / "session.toml").read_text()
    problems = InputProblems(stop_at_first=False)
    with problems.guard():
        load_session(path, problems)
    assert said[1].startswith(f"{len(problems.refusals)} lines are to be filled in")
    assert text.count("FILL IN") == len(problems.refusals) >= 4
    filled = text
    for key, value in FILLED.items():
        filled = filled.replace(f"# {key} =        # FILL IN", f"{key} = {value} #")
    assert "FILL IN" not in filled
    (path / "session.toml").write_text(filled)
    assert load_session(path).whisker.length_mm == 100.0


FILLED = {
    "length_mm": 100.0,
    "diameter_mm": 1.02,
    "youngs_modulus_GPa": 60.0,
    "square_mm": 15.0,
    "marker_mm": 11.0,
    "speed_deg_s": 10.0,
    "speed_sigma_deg_s": 0.1,
    "hub_marker": 98,
    "crop": [0, 0, 640, 490],
    "offset_V": [0.0, 0.0],
    "matrix_Nmm_per_V": [[11.0, 0.0], [0.0, 11.0]],
}


class Terminal(io.StringIO):
    """What a terminal answers, or shows."""

    def isatty(self) -> bool:
        return True


def new_at_a_terminal(path, answers, monkeypatch, arguments=()) -> tuple[str, str]:
    """What `new` shows, and the session.toml that it makes of a terminal's answers."""
    shown = Terminal()
    monkeypatch.setattr(sys, "stdin", Terminal(answers))
    monkeypatch.setattr(sys, "stdout", shown)
    assert main(["new", str(path), *arguments]) == 0
    return shown.getvalue(), (path / "session.toml").read_text()


def test_answers_make_the_same_session_as_options(tmp_path, monkeypatch, capsys):
    answers = "mirror\ntraces\ncheckerboard\nmarker\nknown\n100\n1.02\n60\n6\n15.03\n98\n"
    asked, by_answers = new_at_a_terminal(tmp_path / "a" / "s", answers, monkeypatch)
    monkeypatch.undo()
    given = ["--mirror", "--traces", "--board-kind", "checkerboard", "--angle-from", "marker"]
    numbers = {name: value for name, value in NUMBERS.items() if name != "marker_mm"}
    given += ["--gauges", "known", *options(numbers | {"hub_marker": 98})]
    assert main(["new", str(tmp_path / "b" / "s"), *given]) == 0
    assert (tmp_path / "b" / "s" / "session.toml").read_text() == by_answers
    assert "one and a mirror" in asked and "3 lines are to be filled in" in asked
    assert (tmp_path / "a" / "s" / "boards" / "camera").is_dir()
    assert "trace_<camera>.csv" in by_answers and "motor_deg" not in by_answers


def test_enter_takes_every_default(tmp_path, monkeypatch):
    _, by_enter = new_at_a_terminal(tmp_path / "a" / "s", "\n" * 11, monkeypatch)
    # a terminal that ends answers nothing more
    _, by_end = new_at_a_terminal(tmp_path / "b" / "s", "", monkeypatch)
    _, by_options = new_at_a_terminal(
        tmp_path / "c" / "s", "none\n", monkeypatch, ["--cameras", "two"]
    )
    assert by_enter == by_end == by_options


def test_an_answer_is_requested_until_it_is_one_of_those_allowed(capsys):
    answers = iter(["ring", "c", "ci"])
    lab = Lab.of({"cameras": "two", "truth": "pictures"}, lambda question: next(answers, ""))
    assert (lab.board_kind, lab.angle_from, lab.gauges) == ("circles", "log", "trials")
    said = capsys.readouterr().out
    assert "'ring' is none of" in said and "'c' is none of" in said


@pytest.mark.parametrize(
    "contradictory",
    [
        ["--cameras", "none", "--truth", "pictures"],
        ["--cameras", "none", "--board-kind", "circles"],
        ["--cameras", "none", "--angle-from", "marker"],
    ],
)
def test_answers_that_contradict_are_one_line(contradictory, tmp_path, capsys):
    assert main(["new", str(tmp_path / "s"), *contradictory]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "cameras none does not go with" in said
    assert not (tmp_path / "s").exists()


@pytest.mark.parametrize(
    "given",
    [{"angle_from": "marker"}, {"angle_from": "speed"}, {"truth": "stage"}, {"cameras": "none"}],
    ids=str,
)
def test_every_answer_that_is_offered_makes_a_lab(given):
    def offered(answers: list[str]) -> list[tuple[str, ...]]:
        """Return what each question offers to whom answers these, in order, and Enter from then on."""
        seen = []
        left = iter(answers)

        def ask(question: str) -> str:
            answers_text = question.partition(" (Enter")[0].rpartition(": ")[2]
            seen.append(tuple(answers_text.split(", ")))
            return next(left, "")

        Lab.of(given, ask)
        return seen

    def check_below(answers: list[str]) -> None:
        seen = offered(answers)
        if len(seen) > len(answers):
            for answer in seen[len(answers)]:
                check_below([*answers, answer])

    check_below([])


def test_no_question_is_asked_for_what_cannot_be():
    options = [question.option for question in questions_of(Lab.of({"cameras": "none"}))]
    assert options[-1] == "origin_sigma_mm" and not {"square_mm", "speed_deg_s"} & set(options)


def test_a_stated_speed_gives_no_truth_by_pictures(tmp_path):
    assert main(["new", str(tmp_path / "s"), "--truth", "pictures", "--angle-from", "speed"]) == 2


def test_without_a_motor_log_the_speed_is_to_be_filled_in(tmp_path):
    path = tmp_path / "session"
    of_whisker = {name: value for name, value in NUMBERS.items() if name[0] in "wyb"}
    assert main(["new", str(path), "--angle-from", "speed", *options(of_whisker)]) == 0
    text = (path / "session.toml").read_text()
    assert read(path).trial.angle_from == "speed" and read(path).truth.source == "stage"
    assert text.count("speed") > 2 and "motor_deg" not in text
    assert "# speed_deg_s =        # FILL IN" in text
