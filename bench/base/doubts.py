"""What is wrong or doubtful in the input: `evaluate` stops at the first refusal, `check` collects all."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from bench.base.errors import BadInput
from vision.geometry.reasons import Reason, joined


def in_one_status(*said: str | None) -> Reason:
    """Return several statuses as one with the codes of all, each once, and none that is empty."""
    return joined(*dict.fromkeys(filter(None, said)))


@dataclass
class Doubts:
    """Refusals (bad input) and notes (usable, but look at it), in the order in which they were found."""

    stop_at_first: bool = True
    refusals: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @contextmanager
    def guard(self) -> Iterator[None]:
        """Run one loader: its BadInput goes up at once, or is kept so that the next file is read too."""
        try:
            yield
        except BadInput as bad:
            if self.stop_at_first:
                raise
            self.refusals.append(str(bad))

    def each(self, loaders: Iterable[Callable[[], Any]]) -> list:
        """What each loader gives. Raises the first one's BadInput when all have been run, and what they refuse is kept."""
        before, given = len(self.refusals), []
        for load in loaders:
            with self.guard():
                given.append(load())
        if len(self.refusals) > before:
            raise BadInput(self.refusals[before])
        return given

    def note(self, line: str) -> None:
        """Keep a line that the user should read (with a code: a `Reason`); the run goes on."""
        self.notes.append(line)
