"""Work in threads: order kept, items taken as needed, faults passed on."""

import os
import time

import pytest

from bench.base.threads import in_threads


def test_results_come_in_the_items_order():
    def slow_first(item):
        time.sleep(0.02 if item == 0 else 0.0)
        return 10 * item

    assert list(in_threads(slow_first, range(20))) == [10 * k for k in range(20)]


def test_items_are_taken_as_they_are_needed():
    taken = []
    results = in_threads(lambda item: item, (taken.append(k) or k for k in range(1000)))
    assert next(results) == 0
    assert len(taken) <= 2 * os.cpu_count() + 1


def test_a_fault_comes_up_where_it_happened():
    results = in_threads(lambda item: 1 / item, [1, 0, 2])
    assert next(results) == 1
    with pytest.raises(ZeroDivisionError):
        next(results)
