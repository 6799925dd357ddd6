"""Work on pictures in parallel: OpenCV and NumPy let other threads run while they work on one."""

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

# [items] Waiting for each thread: enough to keep it busy, few enough that pictures do not fill the memory.
_AHEAD = 2


def in_threads(job: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Yield job(item) of every item, in their order; items are taken only as they are needed."""
    count = os.cpu_count() or 1
    with ThreadPoolExecutor(count) as pool:
        waiting: deque = deque()
        for item in items:
            waiting.append(pool.submit(job, item))
            if len(waiting) >= _AHEAD * count:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
