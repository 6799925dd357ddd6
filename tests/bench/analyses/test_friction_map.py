"""Measured cells beside the prediction; and the bar chart's numbers."""

import csv

import numpy as np
import pytest

from bench.analyses.error_map import ERROR_MAP, ErrorMap
from bench.analyses.explained import SHARES, TOTAL, Explained, mean_row
from tests.scenes.friction_results import result, run_of


def test_cells_hold_what_was_measured_and_agree_with_theory(tmp_path):
    """Whisks made by (13), (14) are wrong by just what (13), (14) predict, at the same α (14°) and α_est."""
    results = [result(b, name=f"{b} {k}") for b in (30, 45, 60, -60) for k in range(2)]
    run = run_of(*results)
    found = ErrorMap().compute(run)
    cells = found.cells
    assert [(c.beta_deg, len(c.errors)) for c in cells] == [(27.5, 2), (42.5, 2), (57.5, 4)]
    assert all(c.errors == pytest.approx(c.predicted, abs=0.02) for c in cells)
    ErrorMap().write(tmp_path, found)
    assert ErrorMap().draw(tmp_path, run) == ["error_map.png"]
    with (tmp_path / "error_map.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["whisks"] for row in rows] == ["2", "2", "4"]


def test_cells_without_a_whisk_stay_empty():
    found = ErrorMap().compute(run_of(result(30), result(45), result(60)))
    drawn = ErrorMap().figure(found).axes[0].collections[0].get_array()
    assert np.isfinite(np.ma.filled(drawn, np.nan)).sum() == 3


def test_a_map_that_would_be_nearly_blank_is_not_drawn():
    found = ErrorMap().compute(run_of(result(30), result(60)))
    assert len(ErrorMap().rows(found)[ERROR_MAP]) == 2
    assert ErrorMap().figure(found) is None


def test_nothing_measured_no_picture(tmp_path):
    run = run_of()
    found = ErrorMap().compute(run)
    ErrorMap().write(tmp_path, found)
    assert ErrorMap().draw(tmp_path, run) == []
    assert (tmp_path / "error_map.csv").read_text().count("\n") == 1


def test_where_every_whisk_has_a_warning_there_is_no_mean():
    assert mean_row([]) == {"trial": TOTAL}


def test_mean_shares_add_up_and_leave_out_what_is_not_known():
    rows = [
        dict(zip(("d_x_mm", *SHARES), (60.0, *parts)))
        for parts in ((1, 2, 3, 4.0), (2, -1, 0, 1), (np.nan,) * 4)
    ]
    rows = [
        row | {"trial": "t", "whisk": 0, "error_mm": sum(row[name] for name in SHARES)}
        for row in rows
    ]
    mean = mean_row(rows)
    assert (
        mean["error_mm"] == pytest.approx(sum(mean[name] for name in SHARES)) == pytest.approx(6.0)
    )
    heights = [p.get_height() for p in Explained().figure([*rows, mean]).axes[0].patches]
    assert sum(heights[3::4]) == pytest.approx(
        10.0
    )  # shares of 60 mm in per cent: the mean's bar is the fourth
