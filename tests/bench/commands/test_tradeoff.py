"""`tradeoff`: the front, and the verb on a path-traced scene whose cameras are given."""

import csv
from pathlib import Path

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.base.settings import Seeing
from bench.commands import tradeoff
from bench.commands.tradeoff import Trade, front, ladder
from bench.trials.seeing import from_file

RING = Path(__file__).resolve().parents[3] / "fixtures" / "scenes" / "ring"


def trade(cpu_s, error_mm, missing=0):
    errors = np.array([error_mm, -error_mm, *[np.nan] * missing])
    return Trade(Seeing(), cpu_s, cpu_s, 50.0 + errors, np.ones(len(errors)), errors)


def test_the_front_is_what_no_other_beats():
    trades = [
        trade(1.0, 0.02),
        trade(2.0, 0.01),
        trade(2.5, 0.015),
        trade(0.5, 0.001, missing=1),
        trade(1.0, 0.03),
    ]
    assert front(trades) == [True, True, False, True, False]


def test_a_third_camera_is_left_out_in_turn():
    names = [seeing.name for seeing in ladder(("a", "b", "c"))]
    assert [name for name in names if name.startswith("without")] == [
        "without-a",
        "without-b",
        "without-c",
    ]
    assert not any(seeing.cameras for seeing in ladder(("a", "b")))


@pytest.mark.slow
def test_a_table_and_files_to_give_back(tmp_path, monkeypatch, capsys):
    """That of d_x is below the 0.1 mm of tests/bench/test_scenes.py."""
    monkeypatch.setattr(tradeoff, "_CHANGES", {})
    monkeypatch.setattr(
        tradeoff, "PRESETS", {name: tradeoff.PRESETS[name] for name in ("draft", "standard")}
    )
    assert tradeoff.tradeoff(RING, tmp_path, trials="w*", repeats=1) == 0
    with (tmp_path / "tradeoff.csv").open(newline="") as file:
        rows = {row["setting"]: row for row in csv.DictReader(file)}
    assert set(rows) == {"draft", "standard", "with-figures"}
    assert all(float(row["d_x_error_rms_mm"]) < 0.1 for row in rows.values())
    assert (
        float(rows["draft"]["cpu_share_of_standard"])
        < 1.0
        < float(rows["with-figures"]["cpu_share_of_standard"])
    )
    assert rows["with-figures"]["d_x_error_rms_mm"] == rows["standard"]["d_x_error_rms_mm"]
    files = sorted((tmp_path / "settings").iterdir())
    assert files
    assert {from_file(path).vision for path in files} <= {seeing.vision for seeing in ladder(())}
    assert "of standard" in capsys.readouterr().out


def test_no_trial_of_that_name(tmp_path):
    with pytest.raises(BadInput, match=r"--trials c\*: no trial with pictures has such a name"):
        tradeoff.tradeoff(RING, tmp_path, trials="c*")


def test_nothing_is_written_into_the_session():
    with pytest.raises(BadInput, match="lies in the session"):
        tradeoff.tradeoff(RING, RING / "out")
