"""Mutated files end in one line and an exit code of ours: no traceback, no hang, no memory without end."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "tests" / "faults" / "fuzz.py"
STATED = ROOT / "tests" / "faults" / "fuzz_stated.py"
BROUGHT = ROOT / "tests" / "faults" / "fuzz_brought.py"
pytestmark = pytest.mark.skipif(
    not hasattr(os, "fork"), reason="each mutation runs in a forked process"
)


def fuzzed(first: int, count: int, verb: str = "check") -> subprocess.CompletedProcess:
    """In a process of its own: forks of one with many threads may hang."""
    return run(SCRIPT, str(first), str(count), verb)


def stated(first: int, count: int) -> subprocess.CompletedProcess:
    """In a process of its own, which has its own alarm and raises every warning."""
    return run(STATED, str(first), str(count))


def run(*arguments) -> subprocess.CompletedProcess:
    """Run a script by one thread, with this checkout's packages."""
    one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1") | {
        "PYTHONPATH": str(ROOT)
    }
    command = [sys.executable, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env=os.environ | one)


def test_a_few_mutations():
    done = fuzzed(0, 20)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "'exit 2'" in done.stdout and "'exit 1'" in done.stdout


def test_a_few_mutations_of_what_is_stated():
    done = stated(0, 60)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "'refused'" in done.stdout and "'accepted'" in done.stdout


@pytest.mark.slow
def test_many_mutations_of_what_is_brought():
    done = run(BROUGHT, "100000", "5000")
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_many_mutations_of_what_is_stated():
    done = stated(100000, 20000)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_many_mutations():
    done = fuzzed(1000, 20000)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_mutations_that_are_evaluated():
    done = fuzzed(200000, 500, "evaluate")
    assert done.returncode == 0, done.stdout + done.stderr
