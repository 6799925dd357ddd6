"""Pictures in, verdict out: the real thing on the small session, and in full (slow) on the sample session."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from bench.base.settings import Settings
from bench.commands.cli import main
from bench.workflows.session_evaluation import evaluate
from tests.scenes.formats import documented, keys
from tests.scenes.results import table

ROOT = Path(__file__).resolve().parents[2]
NUMBER = re.compile(r"\d+(?:\.\d+)?")


def check(session, out, trials) -> None:
    """The limits of truth and estimate that the sample session was recorded for."""
    truth = {row["trial"]: row for row in table(out / "whisks.csv")}
    estimates = {(row["trial"], row["estimator"]): row for row in table(out / "estimates.csv")}
    for trial, d_x, beta in trials:
        row = truth[trial]
        for column, true, most in (("d_x", d_x, 0.10), ("beta", beta, 0.6)):
            unit = "mm" if column == "d_x" else "deg"
            error, sigma = (
                float(row[f"{column}_{unit}"]) - true,
                float(row[f"{column}_sigma_{unit}"]),
            )
            assert abs(error) <= min(most, 3 * sigma), (trial, column)
        assert float(row["d_x_sigma_mm"]) <= 0.08 and float(row["slip_sigma_mm"]) <= 0.08
        error = float(estimates[trial, "with_friction"]["error_percent"])
        assert abs(error) <= (1.5 if beta < 45 else 4.0), trial
    slips = [(a, b) for trial, *_ in trials for a, b in _touching(session, out, trial)]
    assert (sum((a - b) ** 2 for a, b in slips) / len(slips)) ** 0.5 <= 0.10


def _touching(session, out, trial):
    true = {row["frame"]: row for row in table(session / "trials" / trial / "truth.csv")}
    for row in table(out / "track" / f"{trial}.csv"):
        if row["touching"] == "1":
            yield float(row["slip_mm"]), float(true[row["frame"]]["slip_mm"])


def check_keys(out) -> None:
    """docs/formats.md has every key of the JSON files and of cameras.npz, and no other."""
    for heading, files in (
        ("trials/<trial>.json", "trials/b*.json"),
        ("calibration/cameras.json",) * 2,
    ):
        found = {key for file in out.glob(files) for key in keys(json.loads(file.read_text()))}
        plain = {
            re.sub(r"\.(cameras|bar_looks|lines)\.(high|low)\b", r".\1.<camera>", key)
            for key in found
        }
        plain = {re.sub(r"\.refinements\.[^.]+", ".refinements.<refinement>", key) for key in plain}
        assert plain == {
            key for key in documented(heading) if ".gave." not in key
        }  # no key where the object stands
    with np.load(out / "calibration" / "cameras.npz") as arrays:
        assert sorted(arrays) == sorted(documented("cameras.npz"))


def check_readme(verdict: str) -> None:
    """The README shows lines of this verdict; last digits differ from one processor to another."""
    text = (ROOT / "README.md").read_text()
    (block,) = re.findall(r"## What the verdict says\n\n```\n(.*?)```", text, flags=re.DOTALL)
    made = {NUMBER.sub("#", line): line for line in verdict.splitlines()}
    shown = [line for line in block.splitlines() if line != "…"]
    assert len(shown) > 4
    for line in shown:
        assert NUMBER.sub("#", line) in made, line
        again = made[NUMBER.sub("#", line)]
        numbers = [[float(number) for number in NUMBER.findall(text)] for text in (line, again)]
        assert numbers[0] == pytest.approx(numbers[1], rel=0.02, abs=0.03), line


def test_small_session(small_session, tmp_path, capsys):
    """`make demo` with two workers, then again: nothing is redone, the same verdict is printed."""
    command = ["evaluate", str(small_session), "--out", str(tmp_path), "--workers", "2"]
    assert main(command) in (0, 1)
    first = capsys.readouterr().out
    check(
        small_session, tmp_path, [("b30_3", 55.257944, 30.009428), ("b60_4", 64.949086, 60.219624)]
    )
    whole = (tmp_path / "summary.txt").read_text()
    assert "camera high:" in whole and "camera low:" in whole
    verdict = whole.split("\n\n")[0]
    check_readme(verdict)
    assert (
        first == f"{verdict}\n\nAll of it: {tmp_path / 'report.html'}, {tmp_path / 'summary.txt'}\n"
    )
    assert (tmp_path / "overlays" / "b60_4_0.png").is_file()
    check_keys(tmp_path)
    kept = [*tmp_path.glob("trials/*"), *tmp_path.glob("calibration/*"), *tmp_path.rglob("*.png")]
    written = {path: path.stat().st_mtime_ns for path in kept if path.is_file()}
    assert main(command) in (0, 1)
    assert capsys.readouterr().out == first
    assert {path: path.stat().st_mtime_ns for path in written} == written


@pytest.mark.slow
def test_sample_session(steel_sample, tmp_path):
    evaluate(steel_sample, tmp_path, Settings(alpha_est_deg=10.5), workers=2)
    check(
        steel_sample,
        tmp_path,
        [
            ("b00_2", 60.122331, -0.552223),
            ("b30_3", 55.257944, 30.009428),
            ("b60_4", 64.949086, 60.219624),
        ],
    )
    rows = {(row["trial"], row["estimator"]): row for row in table(tmp_path / "estimates.csv")}
    for trial, ratio in (("b30_3", 1.204), ("b60_4", 3.03)):
        assert 1 + float(rows[trial, "no_slip"]["error_percent"]) / 100 == pytest.approx(
            ratio, rel=0.04
        )
