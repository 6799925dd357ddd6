"""`evaluate --watch`: a session is evaluated while it is recorded, each trial as soon as it is complete.

A trial is complete when nothing in its folder has changed from one look to the next, and it passes all that `evaluate`
asks of a trial: signals, every camera's frames, as many as the times file has rows, on one clock. The session so far is
then evaluated with it; results that stand are not made again. A trial that changes after all has another hash, and is
made anew. Whenever it stops, `evaluate` goes on from there.
"""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.session.footage import visible
from bench.session.inside import check_outside
from bench.session.session_check import checked_views
from bench.trials.estimates import estimators
from bench.workflows.session_evaluation import DONE, evaluate
from vision.geometry.refusals import Refused

_ANEW = (
    "cameras.toml is not brought along, so that each new trial calibrates the cameras anew and all are seen again: "
    "`calibrate cameras` and `calibrate gauges` write what a session keeps"
)
Look = dict[str, tuple[int, int]]  # size and time of change of each file, by its path


@dataclass
class _Watched:
    """A session that is being recorded. follow_links: see `Settings`; around: what all trials share; last: the trials
    at the last look; asked: what complete or refused trials were asked with; refused: why one is not complete, '' where
    it is; hints: what is still to be said."""

    path: Path
    announce: Callable[[str], object]
    follow_links: bool = False
    around: Look = field(default_factory=dict)
    last: dict[str, Look] = field(default_factory=dict)
    asked: dict[str, tuple[Look, Look]] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
    hints: list[str] = field(default_factory=lambda: [_ANEW])

    def hint(self) -> None:
        """Says, once, what makes every evaluation but the first longer than it need be."""
        calibrates = (self.path / "boards").is_dir() and not (self.path / "cameras.toml").is_file()
        while calibrates and self.hints:
            self.announce(self.hints.pop())

    def look(self) -> dict[str, Look]:
        """The trials that are complete, by name; a line on each that stands still and is not."""
        self.around = dict(
            item for entry in visible(self.path) if entry.name != "trials" for item in _files(entry)
        )
        now = {
            entry.name: dict(_files(entry))
            for entry in visible(self.path / "trials")
            if entry.is_dir()
        }
        still = [name for name, files in now.items() if files and files == self.last.get(name)]
        self.last = now
        for name in still:
            if self.asked.get(name) != (self.around, now[name]):
                self._ask(name)
        return {name: now[name] for name in still if not self.refused[name]}

    def _ask(self, name: str) -> None:
        """Whether the trial can be evaluated."""
        self.asked[name], before, self.refused[name] = (
            (self.around, self.last[name]),
            self.refused.get(name),
            "",
        )
        try:
            checked_views(self.path, trials={name}, follow_links=self.follow_links)
        except BadInput as problem:
            self.refused[name] = str(problem)
            if self.refused[name] != before:
                self.announce(f"waiting for {name}: {problem}")

    def is_writing(self, names: Iterable[str]) -> bool:
        """Whether one of these trials, which were complete, is being changed."""
        return any(name in self.last and not self._stands(name) for name in names)

    def _stands(self, name: str) -> bool:
        return self.asked.get(name, ({}, {}))[1] == self.last[name]


def _files(place: Path) -> Iterator[tuple[str, tuple[int, int]]]:
    """Every file at or below a place."""
    for file in [place] if place.is_file() else sorted(place.rglob("*")):
        try:
            facts = file.stat()
        except FileNotFoundError:  # a temporary file that has got its name
            continue
        if file.is_file():
            yield str(file), (facts.st_size, facts.st_mtime_ns)


def watch(
    session_path: Path,
    out: Path,
    settings: Settings,
    *,
    every_s: float,
    workers: int = 1,
    dask: str | None = None,
    progress: bool = False,
    figure_formats: Sequence[str] = (),
    announce: Callable[[str], object] = print,
    pause: Callable[[float], object] = time.sleep,
) -> int:
    """Evaluate a session as it grows, until interrupted; the code of the last evaluation, as `evaluate` has it.

    every_s: how often it is looked at; pause: waits so long. An interruption within an evaluation goes up, for that one
    is not whole. announce: is given the verdict each time, and what a trial waits for. Raises BadInput where there is
    no session.
    """
    estimators(settings.estimators)
    check_outside(out, session_path)
    if not session_path.is_dir():
        raise BadInput("there is no such folder; give the session's folder", file=str(session_path))
    watched, code = _Watched(session_path, announce, settings.follow_links), DONE
    done: tuple[Look, dict[str, Look]] = {}, {}
    told = {
        "workers": workers,
        "dask": dask,
        "progress": progress,
        "figure_formats": figure_formats,
    }
    while True:
        ready = watched.look()
        if not ready or (watched.around, ready) == done or watched.is_writing(done[1]):
            try:
                pause(every_s)
            except KeyboardInterrupt:
                return code
            continue
        if done[1]:
            watched.hint()
        done = watched.around, ready
        announce(f"{len(ready)} complete: {', '.join(ready)}")
        try:
            code = evaluate(
                session_path,
                out,
                settings,
                trials=set(ready),
                announce=announce,
                verdict_alone=True,
                **told,
            )
        except (BadInput, Refused) as problem:
            announce(f"not yet: {problem}")
