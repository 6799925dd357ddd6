"""`evaluate` on bad input: exit code 2, one line, and nothing written."""

import shutil

import cv2
import pytest

from bench.commands import cli


def no_manifest(session):
    (session / "session.toml").unlink()


def misspelt_key(session):
    manifest = session / "session.toml"
    manifest.write_text(manifest.read_text().replace("square_mm", "squares_mm"))


def camera_without_frames(session):
    shutil.rmtree(session / "trials" / "b30_3" / "low")


def row_of_signals(text):
    def spoil(session):
        file = session / "trials" / "b60_4" / "signals.csv"
        lines = file.read_text().splitlines()
        lines[41] = text
        file.write_text("\n".join(lines))

    return spoil


def radians(session):
    file = session / "trials" / "b60_4" / "signals.csv"
    header, *rows = [line.split(",") for line in file.read_text().splitlines()]
    rows = [[time, str(float(motor) / 57.29578), *volts] for time, motor, *volts in rows]
    file.write_text("\n".join(",".join(row) for row in [header, *rows]))


def no_trials(session):
    shutil.rmtree(session / "trials")


def other_size(session):
    file = session / "boards" / "rig" / "high.png"
    grey = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
    file.unlink()
    cv2.imwrite(str(file), cv2.resize(grey, (640, 360)))


FAULTS = {
    "no session.toml": (no_manifest, "there is no session.toml"),
    "a misspelt key": (misspelt_key, "did you mean 'square_mm'?"),
    "a camera without frames": (
        camera_without_frames,
        "trials/b30_3: camera low has no frames here",
    ),
    "text": (row_of_signals("0.02,0.87,abc,0.1"), "signals.csv, row 42, column y_V: 'abc'"),
    "NaN": (row_of_signals("0.02,0.87,nan,0.1"), "signals.csv, row 42, column y_V: 'nan'"),
    "decimal commas": (row_of_signals("0,02,0,87,0,1,0,1"), "signals.csv, row 42: has 8 values"),
    "time running backwards": (
        row_of_signals("0.001,0.87,0.1,0.1"),
        "signals.csv, row 42, column time_s: goes back",
    ),
    "radians for degrees": (radians, "Is it in radians?"),
    "no trials": (no_trials, "there is no trial to evaluate"),
    "another picture size": (other_size, "boards/rig/high.png: is 640 x 360 px"),
}


def refusal(capsys, *arguments) -> str:
    assert cli.main(["evaluate", *map(str, arguments)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("whisker-bench: ")
    assert captured.err.count("\n") == 1
    return captured.err


@pytest.mark.parametrize("fault", FAULTS)
def test_bad_session(small_copy, tmp_path, capsys, fault):
    spoil, expected = FAULTS[fault]
    spoil(small_copy)
    assert expected in refusal(capsys, small_copy, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("option", "value", "expected"),
    [
        ("--theta-deg", "0", "--theta-deg 0: must be above 0"),
        ("--theta-deg", "nan", "--theta-deg nan"),
        ("--alpha-est-deg", "95", "--alpha-est-deg 95: must be"),
        ("--cutoff-Hz", "-5", "--cutoff-Hz -5: must be above 0"),
        (
            "--estimator",
            "nowhere:nothing",
            "--estimator nowhere:nothing: No module named 'nowhere'",
        ),
    ],
)
def test_bad_option(small_session, tmp_path, capsys, option, value, expected):
    assert expected in refusal(capsys, small_session, "--out", tmp_path / "out", option, value)
    assert not (tmp_path / "out").exists()


def test_wrong_board(small_copy, tmp_path, capsys):
    manifest = small_copy / "session.toml"
    manifest.write_text(manifest.read_text().replace("DICT_5X5_100", "DICT_4X4_100"))
    line = refusal(capsys, small_copy, "--out", tmp_path / "out")
    assert "board" in line
    assert not list((tmp_path / "out").rglob("*.csv"))
