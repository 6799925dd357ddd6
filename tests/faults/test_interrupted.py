"""Killed runs and full disks all over an evaluation (some minutes; the small ones are in tests/bench/base)."""

import sys

import pytest

from tests.faults.interrupted import full, kill

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform != "linux", reason="looks up processes in /proc"),
]


def test_a_killed_run_goes_on_to_the_same_bytes():
    assert kill(10) == 0


def test_a_full_disk_tears_nothing():
    assert full(10) == 0
