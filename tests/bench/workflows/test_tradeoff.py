"""`tradeoff`: the front, and the verb on a path-traced scene whose cameras are given."""

import csv
from pathlib import Path

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.base.settings import Seeing, Settings
from bench.trials.seeing import from_file
from bench.workflows import seeing_trade
from bench.workflows.seeing_trade import Trade, front, settings_to_try

RING = Path(__file__).resolve().parents[3] / "fixtures" / "scenes" / "ring"


def trade(cpu_s, sigma_mm, error_mm=0.01, missing=0):
    errors = np.array([error_mm, -error_mm, *[np.nan] * missing])
    return Trade(Seeing(), cpu_s, cpu_s, 50.0 + errors, np.full(len(errors), sigma_mm), errors)


def test_the_front_is_what_no_other_is_expected_to_beat():
    """However near the two whisks came: 0.0001 mm is luck."""
    trades = [
        trade(1.0, 0.02),
        trade(2.0, 0.01),
        trade(2.5, 0.015, error_mm=0.0001),
        trade(0.5, 0.001, missing=1),
        trade(1.0, 0.03),
    ]
    assert front(trades).tolist() == [True, True, False, True, False]


def test_an_error_beyond_chance_counts():
    """Two errors of 0.1 mm at a stated 0.005 mm: the setting is as wrong as it was measured."""
    trades = [trade(1.0, 0.02), trade(2.0, 0.005, error_mm=0.1)]
    assert front(trades).tolist() == [True, False]


def test_a_third_camera_is_left_out_in_turn():
    names = [seeing.name for seeing in settings_to_try(("a", "b", "c"))]
    assert [name for name in names if name.startswith("without")] == [
        "without-a",
        "without-b",
        "without-c",
    ]
    assert not any(seeing.cameras for seeing in settings_to_try(("a", "b")))


@pytest.mark.slow
def test_a_table_and_files_to_give_back(tmp_path, monkeypatch):
    """That of d_x is below the 0.1 mm of tests/bench/test_scenes.py."""
    monkeypatch.setattr(seeing_trade, "_CHANGES", {})
    rows = seeing_trade.tradeoff(RING, tmp_path, Settings(trials="w*"), repeats=1)
    assert "of standard" in next(seeing_trade.tradeoff_lines(rows))
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
    assert {from_file(path).vision for path in files} <= {
        seeing.vision for seeing in settings_to_try(())
    }


def test_no_trial_of_that_name(tmp_path):
    with pytest.raises(BadInput, match=r"--trials c\*: no trial with pictures has such a name"):
        seeing_trade.tradeoff(RING, tmp_path, Settings(trials="c*"))


def test_nothing_is_written_into_the_session():
    with pytest.raises(BadInput, match="lies in the session"):
        seeing_trade.tradeoff(RING, RING / "out", Settings())
