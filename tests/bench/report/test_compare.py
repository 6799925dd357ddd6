"""Runs side by side: what moved is told in sigmas, what did not is not."""

import csv
import json
import shutil

import numpy as np
import pytest

from bench.base.exit_codes import DONE
from bench.commands.cli import main
from bench.report.compare_runs import CHANGED, compare_runs

KEY = "b60_4"


def changed(run, where, change, *, another_recording: bool = False):
    """A copy of a run in which one trial's result is changed."""
    out = shutil.copytree(run, where)
    path = out / "trials" / f"{KEY}.json"
    result = json.loads(path.read_text())
    change(result["seen"]["whisks"][0])
    path.write_text(json.dumps(result))
    if another_recording:
        record = json.loads((out / "run.json").read_text())
        record["recordings"][KEY] = "another"
        (out / "run.json").write_text(json.dumps(record))
    return out


def moved(sigmas: float):
    """d_x is moved by so many of its stated sigmas."""

    def change(seen: dict) -> None:
        truth = seen["truth"]
        truth["d_x_mm"] += sigmas * truth["d_x_sigma_mm"]

    return change


def no_truth(seen: dict) -> None:
    seen["truth"] |= {"d_x_mm": None, "d_x_sigma_mm": None}
    seen["status"] = "the whisker never touches"
    seen["status_codes"] = [["never_touches", "the whisker never touches"]]


def test_a_run_and_its_copy_are_alike(exact_run, tmp_path):
    lines, code = compare_runs([exact_run, shutil.copytree(exact_run, tmp_path / "b")])
    assert code == DONE
    assert lines[0].endswith("5 whisks in both, 5 of them from the same recording")
    assert any("values moved by 0.00 sigma at most" in line for line in lines)


@pytest.mark.parametrize(
    ("sigmas", "another", "told"), [(2.5, False, "+2.5"), (-6.0, True, "-4.2"), (2.5, True, "")]
)
def test_a_distance_that_moved_is_told_in_sigmas(exact_run, tmp_path, sigmas, another, told):
    """Of one recording the larger stated sigma counts, of two both: 6 sigma of one are 6/√2 = 4.2 of their difference,
    which stands out, and 2.5 are 1.8, which do not."""
    other = changed(exact_run, tmp_path / "b", moved(sigmas), another_recording=another)
    lines, code = compare_runs([exact_run, other], tmp_path / "c.csv")
    found = [line for line in lines if f"{KEY}, whisk 0: d_x " in line]
    assert (code == CHANGED) == bool(told) == bool(found)
    assert not told or found[0].endswith(f"{told} sigma")
    with (tmp_path / "c.csv").open(newline="") as file:
        rows = {(row["trial"], row["quantity"]): row for row in csv.DictReader(file)}
    of_sigma = sigmas / np.sqrt(2) if another else sigmas
    assert float(rows[KEY, "d_x_mm"]["sigmas"]) == pytest.approx(of_sigma, rel=1e-6)
    assert float(rows["b00_2", "d_x_mm"]["difference"]) == 0.0


def test_a_truth_that_is_lost_or_won_is_told(exact_run, tmp_path):
    other = changed(exact_run, tmp_path / "b", no_truth)
    lines, code = compare_runs([exact_run, other])
    assert code == CHANGED and any("d_x is no longer known" in line for line in lines)
    lines, code = compare_runs([other, exact_run])
    assert code == CHANGED and any("d_x has become known" in line for line in lines)


def test_every_run_after_the_first_is_compared_with_it(exact_run, tmp_path):
    outs = [shutil.copytree(exact_run, tmp_path / name) for name in "bc"]
    lines, _ = compare_runs([exact_run, *outs])
    assert sum(f"against {exact_run}" in line for line in lines) == 2
    assert next(line for line in lines if "(10) with friction" in line).count("(3)") == 3


def test_what_cannot_be_compared_is_one_line(exact_run, tmp_path, capsys):
    for arguments in ([exact_run], [exact_run, exact_run], [exact_run, tmp_path]):
        assert main(["compare", *map(str, arguments)]) == 2
        said = capsys.readouterr().err
        assert said.startswith("whisker-bench: ") and said.count("\n") == 1
