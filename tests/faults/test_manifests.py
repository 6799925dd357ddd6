"""Faults in session.toml, trial.toml and the folders: each one clear line that names place and cure."""

import re
import shutil

import pytest

from bench.base.input_problems import InputProblems
from bench.session.session import load_session
from bench.session.session_check import checked_session
from tests.scenes.refusals import refusal


def edit(file, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text, f"the fixture no longer holds {old!r}"
    file.write_text(text.replace(old, new, 1))


def test_the_unspoilt_session_is_taken(session):
    problems = InputProblems()
    checked_session(session, problems)
    assert problems.warnings == []


def test_no_such_folder(tmp_path):
    assert "there is no such folder" in refusal(tmp_path / "nowhere")


def test_no_manifest(session):
    (session / "session.toml").unlink()
    assert "there is no session.toml in this folder" in refusal(session)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            "square_mm",
            "sqare_mm",
            r"session.toml: \[board\] sqare_mm is not a key.*did you mean 'square_mm'",
        ),
        ("[whisker]", "[wisker]", r"session.toml: wisker is not a key.*did you mean 'whisker'"),
        (
            'name = "high"',
            'nmae = "high"',
            r"\[\[cameras\]\] nmae is not a key.*did you mean 'name'",
        ),
        (
            "[bar]",
            "[[bar]]",
            r"\[\[bar\]\] are several tables where one is expected: write \[bar\]",
        ),
        (
            '[[cameras]]\nname = "high"\n\n[[cameras]]\nname = "low"',
            '[cameras]\nname = "high"',
            r"\[cameras\] is one table where there may be several: write \[\[cameras\]\]",
        ),
        ('name = "low"', 'name = "high"', r"\[\[cameras\]\] \"high\": the name is used twice"),
        (
            "[bar]",
            "[bar]\nshape = 'cylinder'",
            r"\[bar\] shape is not a key.*it belongs in \[whisker\]",
        ),
        ("diameter_mm = 6.0", "", r"\[bar\] diameter_mm is missing"),
        (
            "length_mm = 100.0",
            "length_mm = '100'",
            r"\[whisker\] length_mm: expected a number, found text",
        ),
        (
            "length_mm = 100.0",
            "length_mm = 0.1",
            r"\[whisker\] length_mm is 0.1;.*metres.*write 100\b",
        ),
        ("length_mm = 100.0", "length_mm = nan", r"\[whisker\] length_mm is nan"),
        ("length_mm = 100.0", "length_mm = 100,0", r"session.toml, row \d+: found .*decimal comma"),
        ("length_mm = 100.0", "length_mm = -100.0", r"\[whisker\] length_mm is -100;"),
        (
            "length_mm = 100.0",
            "length_mm = 100\nlength_sigma_mm = -1",
            r"length_sigma_mm is -1; 0 or more is allowed",
        ),
        (
            "[whisker]",
            "[trial]\nbeta_sigma_deg = 1e9\n[whisker]",
            r"beta_sigma_deg is 1e\+09; from 0 to 90 is allowed",
        ),
        (
            "diameter_mm = 6.0",
            "diameter_mm = 0.006",
            r"\[bar\] diameter_mm is 0.006;.*metres.*write 6\b",
        ),
        (
            "youngs_modulus_GPa = 60.0",
            "youngs_modulus_GPa = 60e9",
            r"youngs_modulus_GPa.*pascals.*write 60\b",
        ),
        (
            "youngs_modulus_GPa = 60.0",
            "",
            r"\[whisker\] youngs_modulus_GPa or flexural_rigidity_Nmm2 is missing",
        ),
        (
            "youngs_modulus_GPa = 60.0",
            "flexural_rigidity_Nmm2 = 0.0029452",
            r"amount to a Young's modulus of 6e-05 GPa;.*N m2.*write 2945.2",
        ),
        ("square_mm = 15.0", "square_mm = 0.015", r"\[board\] square_mm is 0.015;.*write 15\b"),
        ("marker_mm = 11.0", "marker_mm = 16.0", r"board marker_mm = 16.0 is not smaller"),
        ("DICT_5X5_100", "DICT_5X5", r"board dictionary 'DICT_5X5' is not"),
        ("squares = [8, 6]", "squares = [8]", r"\[board\] squares"),
        ("[[0.997563342,", "[[1.997563342,", r"\[rig\] T_rig_board: .*not a right-handed rotation"),
        ("4.24180287", "4241.80287e9", r"\[rig\] T_rig_board"),
        ("-44.3509729]]", "-44.3509729], [0, 0, 0, 2]]", r"T_rig_board: the fourth row is \[0.0,"),
        ("-44.3509729]]", "-44.3509729, 1.0]]", r"T_rig_board\[2\]: .* at most 4 values"),
        ("format = 1", "format = 2", r"format is 2; this version reads format 1"),
        ("[bar]", "[signals]\nfile = 'daq.mat'\n[bar]", r"daq.mat: is not there"),
        (
            "[bar]",
            "[signals]\nfile = '../daq.mat'\nmotor_deg = { channel = 'enc' }\n[bar]",
            r"\[signals\] file '../daq.mat' must be the name of a file in each trial's folder",
        ),
        (
            "[bar]",
            "[signals]\nfile = 'daq.xlsx'\nmotor_deg = { channel = 'enc' }\n[bar]",
            r"\[signals\] file 'daq.xlsx' is of no kind that is read; these are: .csv, .mat",
        ),
        ("format = 1", "format = = 1", r"session.toml, row 1: is not TOML"),
        ('shape = "cylinder"', 'shape = "prism"', r"\[whisker\] shape: .*prism"),
    ],
)
def test_fault_in_session_toml(session, old, new, expected):
    edit(session / "session.toml", old, new)
    assert re.search(expected, refusal(session))


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            "beta_deg",
            "betta_deg",
            r"trials/b30_3/trial.toml: betta_deg is not a key.*did you mean 'beta_deg'",
        ),
        (
            "beta_deg = 30.0",
            "beta_deg = 0.5236",
            r"beta_deg is 0.5236. Is it in radians\? Then write 30",
        ),
        ("beta_deg = 30.0", "beta_deg = 130.0", r"beta_deg is 130; from -90 to 90"),
        ("beta_deg = 30.0", "d_x_mm = 0.055", r"d_x_mm is 0.055;.*metres.*write 55"),
        (
            '"measure"',
            '"mesure"',
            r"'mesure' is none of its values; allowed are 'measure', 'gauge', 'weight'",
        ),
        ('"measure"', '"weight"', r'purpose = "weight" needs force_N and at_mm'),
        (
            "speed_deg_s = 10.0",
            "speed_deg_s = 0.174533",
            r"speed_deg_s is 0.174533.*rad/s.*write 10",
        ),
        (
            "speed_deg_s = 10.0",
            "speed_deg_s = true",
            r"speed_deg_s: expected a number, found true or false",
        ),
        ("beta_deg = 30.0", "frame_rate_Hz = 30.0", r"frames.csv: frames come at 20 Hz, .* 30;"),
    ],
)
def test_fault_in_trial_toml(session, old, new, expected):
    edit(session / "trials" / "b30_3" / "trial.toml", old, new)
    assert re.search(expected, refusal(session))


def test_bom_and_crlf_in_a_manifest_are_taken(session):
    file = session / "session.toml"
    file.write_bytes(b"\xef\xbb\xbf" + file.read_bytes().replace(b"\n", b"\r\n"))
    assert load_session(session).whisker.length_mm == 100.0


def test_camera_without_frames_where_another_has_them(session):
    shutil.rmtree(session / "trials" / "b30_3" / "low")
    assert re.search(r"trials/b30_3: camera low has no frames here, high has", refusal(session))


def test_camera_with_an_empty_folder_where_another_has_frames(session):
    for picture in (session / "trials" / "b30_3" / "low").iterdir():
        picture.unlink()
    assert "camera low has no frames here" in refusal(session)


def test_camera_without_board_views(session):
    shutil.rmtree(session / "boards" / "low")
    assert "boards/low: there are no board views of camera low" in refusal(session)


def test_camera_without_rig_view(session):
    (session / "boards" / "rig" / "low.png").unlink()
    assert "boards/rig/low: there is no picture of the board on the rig" in refusal(session)


def test_camera_twice_in_one_trial(session):
    (session / "trials" / "b30_3" / "low.avi").write_bytes(b"RIFF")
    assert re.search(r"trials/b30_3: camera low has low and low.avi; keep one", refusal(session))


def test_session_without_any_picture_is_taken(session):
    for folder in [
        session / "boards",
        *session.glob("trials/*/high"),
        *session.glob("trials/*/low"),
    ]:
        shutil.rmtree(folder)
    loaded = checked_session(session)
    assert loaded.camera_names == ()
    assert len(loaded.trials) == 4


def test_trial_without_signals(session):
    (session / "trials" / "b30_3" / "signals.csv").unlink()
    assert "trials/b30_3/signals.csv: is not there" in refusal(session)


def test_check_collects_what_evaluate_would_stop_at(session):
    edit(session / "trials" / "b30_3" / "trial.toml", "beta_deg", "betta_deg")
    shutil.rmtree(session / "trials" / "b60_4" / "low")
    edit(session / "trials" / "gauge_roll0" / "signals.csv", "0.0010", "text")
    problems = InputProblems(stop_at_first=False)
    checked_session(session, problems)
    assert [line.split(":")[0].split(",")[0] for line in problems.refusals] == [
        "trials/b30_3/trial.toml",
        "trials/b60_4",
        "trials/gauge_roll0/signals.csv",
    ]


def test_check_collects_every_unknown_key(session):
    edit(session / "session.toml", "legacy", "legasy")
    edit(session / "session.toml", 'name = "high"', 'nmae = "x"\nname = "high"')
    edit(session / "trials" / "b30_3" / "trial.toml", "beta_deg", "betta_deg")
    edit(session / "trials" / "b30_3" / "trial.toml", "surface", "suface")
    problems = InputProblems(stop_at_first=False)
    checked_session(session, problems)
    assert [line.split(" is not")[0] for line in problems.refusals] == [
        "session.toml: [board] legasy",
        "session.toml: [[cameras]] nmae",
        "trials/b30_3/trial.toml: suface",
        "trials/b30_3/trial.toml: betta_deg",
    ]


def refusals(session) -> list[str]:
    """All that `check` would refuse, where a manifest cannot be used."""
    problems = InputProblems(stop_at_first=False)
    with problems.guard():
        checked_session(session, problems)
    return list(dict.fromkeys(problems.refusals))


def test_check_names_every_missing_key(session):
    for text in (
        "format = 1",
        "length_mm = 100.0",
        "[bar]\ndiameter_mm = 6.0",
        "squares = [8, 6]",
        'name = "high"',
    ):
        edit(session / "session.toml", text, "")
    assert refusals(session) == [
        "session.toml: [board] squares is missing",
        "session.toml: [bar] is missing",
        "session.toml: format is missing",
        "session.toml: [whisker] length_mm is missing",
        "session.toml: [[cameras]] name is missing",
    ]


def test_check_names_every_implausible_value(session):
    edit(session / "session.toml", "length_mm = 100.0", "length_mm = 0.1")
    edit(session / "session.toml", "diameter_mm = 6.0", "diameter_mm = -6.0")
    found = [line.split(" is ")[0] for line in refusals(session)]
    assert found == ["session.toml: [whisker] length_mm", "session.toml: [bar] diameter_mm"]


def test_check_names_what_does_not_go_together(session):
    both = "youngs_modulus_GPa = 60.0\nflexural_rigidity_Nmm2 = 2945.2"
    edit(session / "session.toml", "youngs_modulus_GPa = 60.0", both)
    edit(session / "session.toml", "marker_mm = 11.0", "marker_mm = 16.0")
    assert [
        "[whisker] give either" in refusals(session)[0],
        "marker_mm = 16.0" in refusals(session)[1],
    ] == [True, True]


def test_implausible_value_of_one_camera(session):
    edit(session / "session.toml", 'name = "high"', 'name = "high"\nexposure_s = 2.0')
    assert re.search(
        r"\[\[cameras\]\] exposure_s is 2;.*milliseconds\? Then write 0.002", refusal(session)
    )
