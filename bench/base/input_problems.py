"""Refusals and warnings on the input: `evaluate` stops at the first refusal, `check` collects all."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from bench.base.errors import BadInput
from vision.geometry import Cameras, Reason, Refused, joined


@contextmanager
def refused_as_bad_input(file: str) -> Iterator[None]:
    """Raise BadInput, naming the file, in place of what vision refuses within the context."""
    try:
        yield
    except Refused as problem:
        raise BadInput(str(problem), file=file) from None


def require_cameras(cameras: Cameras, wanted: Iterable[str], file: str, cure: str = "") -> None:
    """Raise BadInput, naming the file that they are from, where cameras lack one that is wanted."""
    missing = [name for name in wanted if name not in cameras.names]
    if missing:
        found = f"has no camera {missing[0]}; it has {', '.join(cameras.names)}"
        raise BadInput(found + cure, file=file)


def in_one_status(*said: str | None) -> Reason:
    """Return several statuses as one with the codes of all, each once, and none that is empty."""
    return joined(*dict.fromkeys(filter(None, said)))


@dataclass
class InputProblems:
    """Refusals (bad input) and warnings (usable, but to be checked), in the order in which they were found.

    notes: what was found and does no harm. trials_of: names of the trials that a warning is about, where it is not
    about the whole session.
    """

    stop_at_first: bool = True
    refusals: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    trials_of: dict[str, tuple[str, ...]] = field(default_factory=dict)

    @contextmanager
    def guard(self) -> Iterator[None]:
        """Run one loader: its BadInput goes up at once, or is kept so that the next file is read too."""
        try:
            yield
        except BadInput as bad:
            if self.stop_at_first:
                raise
            if str(bad) not in self.refusals:
                self.refusals.append(str(bad))

    def each(self, loaders: Iterable[Callable[[], Any]]) -> list:
        """Run all loaders and return what they give; what they refuse is kept.

        Raises the first one's BadInput when all have been run.
        """
        refused = []  # also what was refused before, elsewhere, in the same words
        given = []
        for load in loaders:
            with self.guard():
                try:
                    given.append(load())
                except BadInput as bad:
                    refused.append(str(bad))
                    raise
        if refused:
            raise BadInput(refused[0])
        return given

    def warn(self, line: str, trials: Iterable[str] = ()) -> None:
        """Keep a line that the user should read (with a code: a `Reason`); the run goes on.

        trials: names of those that it is about; none: it is about the session.
        """
        self.warnings.append(line)
        if trials:
            self.trials_of[line] = tuple(trials)

    def about(self, trial: str) -> Reason:
        """Return all warnings about the session and about a trial as one status."""
        found = []
        for line in self.warnings:
            if trial in self.trials_of.get(line, (trial,)):
                found.append(line)
        return in_one_status(*found)
