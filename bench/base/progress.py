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


class PartCount:
    """Counts the parts of a step that are done, where no iterable of them can be passed on."""

    def __init__(self, name: str, total: int, least_gap_s: float = _LEAST_GAP_S) -> None:
        """Log that a step of so many parts begins. least_gap_s: least time between two lines of it."""
        begin_step(f"{name}: {total}")
        self._name = name
        self._total = total
        self._least_gap_s = least_gap_s
        self._done = 0
        self._start_s = time.monotonic()
        self._shown_s = self._start_s

    def add(self) -> None:
        """Count one part; log how many of the total are done, and in how many seconds."""
        self._done += 1
        now_s = time.monotonic()
        if self._done == self._total or now_s - self._shown_s >= self._least_gap_s:
            elapsed_s = now_s - self._start_s
            _log.info("%s: %d of %d, %.0f s", self._name, self._done, self._total, elapsed_s)
            self._shown_s = now_s


def count_parts(parts: Iterable[_Part], name: str, total: int) -> Iterator[_Part]:
    """Yield the parts of a step; log how many of the total are done, and in how many seconds.

    Parts that follow each other within _LEAST_GAP_S share a line; the last has one of its own.
    """
    if not total:
        return
    count = PartCount(name, total)
    for part in parts:
        yield part
        count.add()
