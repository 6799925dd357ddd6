"""Progress of what takes long: a line as a step begins, and one for each of its parts that is done.

The lines are log records of level INFO. The command line shows them on the error stream, piped or not, so
that the standard stream holds results alone; in Python they show where the caller asks for this log.
"""

import logging
import time
from collections.abc import Iterable, Iterator
from typing import TypeVar

_Part = TypeVar("_Part")

_log = logging.getLogger(__name__)
# [s] Least time between two lines of one step, so that many quick parts are few lines. A choice.
_LEAST_GAP_S = 0.5


def show_progress() -> None:
    """Show the lines of progress wherever log records go."""
    _log.setLevel(logging.INFO)


def begin_step(name: str) -> None:
    """Log that a step begins."""
    _log.info("%s ...", name)


def count_parts(parts: Iterable[_Part], name: str, total: int) -> Iterator[_Part]:
    """Yield the parts of a step; log how many of the total are done, and in how many seconds.

    Parts that follow each other within _LEAST_GAP_S share a line; the last has one of its own.
    """
    if not total:
        return
    begin_step(f"{name}: {total}")
    start_s = time.monotonic()
    shown_s = start_s
    for done, part in enumerate(parts, start=1):
        yield part
        now_s = time.monotonic()
        if done == total or now_s - shown_s >= _LEAST_GAP_S:
            _log.info("%s: %d of %d, %.0f s", name, done, total, now_s - start_s)
            shown_s = now_s
