"""Progress: a line as a step begins, one for each part that is done, on the error stream alone."""

import subprocess
import sys
from pathlib import Path

import pytest

from bench.base import progress
from bench.base.progress import count_parts, show_progress

REPOSITORY = Path(__file__).resolve().parents[3]
VERBS_THAT_TAKE_LONG = (
    "evaluate",
    "check",
    "robot",
    "tradeoff",
    "plan",
    "design",
    "calibrate",
    "simulate",
)


def test_parts_are_passed_on_and_each_slow_one_has_a_line(caplog, monkeypatch):
    seconds = iter(range(10))  # one passes at each look at the clock
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(seconds))
    show_progress()
    assert list(count_parts("abc", "trials", 3)) == ["a", "b", "c"]
    expected = [
        "trials: 3 ...",
        "trials: 1 of 3, 1 s",
        "trials: 2 of 3, 2 s",
        "trials: 3 of 3, 3 s",
    ]
    assert caplog.messages == expected


def test_quick_parts_share_a_line(caplog, monkeypatch):
    monkeypatch.setattr(progress.time, "monotonic", lambda: 0.0)
    show_progress()
    assert len(list(count_parts(range(1000), "trials", 1000))) == 1000
    assert caplog.messages == ["trials: 1000 ...", "trials: 1000 of 1000, 0 s"]


def test_a_step_of_nothing_has_no_line(caplog):
    show_progress()
    assert list(count_parts([], "trials", 0)) == []
    assert caplog.messages == []


@pytest.mark.parametrize("verb", VERBS_THAT_TAKE_LONG)
def test_every_verb_that_takes_long_begins_with_a_line(verb):
    text = (REPOSITORY / "bench" / "commands" / f"{verb}.py").read_text(encoding="utf-8")
    assert "begin_step(" in text


def test_a_pipe_gets_results_alone_and_the_error_stream_the_progress(tmp_path):
    command = "import sys; from bench.commands.cli import main; sys.exit(main())"
    region = {"beta-deg": (20, 30), "alpha-deg": (5, 10), "d-x-mm": (40, 50)}
    fixed = {"theta-deg": (3,), "diameter-mm": (1,), "length-mm": (100,), "taper": (0,)}
    design = ["design", "--alpha-est-deg", "10", "--tilt-deg", "0", "--out", str(tmp_path / "out")]
    for name, values in (region | fixed).items():
        design += [f"--{name}", *map(str, values)]
    ran = subprocess.run(
        [sys.executable, "-c", command, *design],
        capture_output=True,
        text=True,
        cwd=REPOSITORY,
    )
    assert ran.returncode == 0, ran.stderr
    assert " ..." not in ran.stdout
    assert ran.stderr.startswith("the best design over the region ...\n")
