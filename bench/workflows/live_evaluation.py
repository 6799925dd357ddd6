"""`evaluate --watch`: a session is evaluated while it is recorded, each trial as soon as it is complete.

A trial is complete when no file in its folder has changed from one listing to the next, and it
passes all that `evaluate` asks of a trial: signals, every camera's frames, as many as the times file
has rows, on one clock. The session so far is then evaluated with it; results that are there already
are not made again. A trial that changes after all has another hash, and is evaluated again. Whenever
it stops, `evaluate` goes on from there.
"""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from bench.base.errors import BadInput
from bench.base.exit_codes import DONE
from bench.base.settings import Settings
from bench.session.footage import visible
from bench.session.inside import check_outside
from bench.session.session_check import checked_views
from bench.trials.estimates import own_estimators
from bench.workflows.session_evaluation import evaluate
from vision.geometry import Refused

_HINT = (
    "cameras.toml is not brought along, so that each new trial calibrates the cameras anew and all are seen again: "
    "`calibrate cameras` and `calibrate gauges` write what a session keeps"
)
Listing = dict[str, tuple[int, int]]  # by its path, each file's size and time of change (ns)


@dataclass(frozen=True)
class _Recording:
    """The files of a session at one time.

    shared: those that all trials share. trials: those of each trial, by its name.
    """

    shared: Listing = field(default_factory=dict)
    trials: dict[str, Listing] = field(default_factory=dict)


@dataclass(frozen=True)
class _Check:
    """What a trial was checked with, and why it cannot be evaluated; '' where it can."""

    shared: Listing
    files: Listing
    refusal: str


class _CompleteTrials:
    """The complete trials of a session that is being recorded, found by listing it repeatedly.

    recording: at the last listing. complete: files of each complete trial at that time, by name.
    """

    def __init__(self, path: Path, announce: Callable[[str], object], follow_links: bool):
        """List nothing yet. follow_links: see `Settings`."""
        self.path = path
        self.announce = announce
        self.follow_links = follow_links
        self.recording = _Recording()
        self.complete: dict[str, Listing] = {}
        self._checks: dict[str, _Check] = {}

    def update(self) -> None:
        """List the session anew; check each trial that has not changed since the last listing.

        The first refusal of a trial is announced, and each other one that follows.
        """
        before = self.recording.trials
        self.recording = _list_session(self.path)
        self.complete = {}
        for name, files in self.recording.trials.items():
            if not files or files != before.get(name):
                continue
            if not self._check(name, files).refusal:
                self.complete[name] = files

    def _check(self, name: str, files: Listing) -> _Check:
        """Return whether a trial can be evaluated; what was checked before is not checked again."""
        shared = self.recording.shared
        before = self._checks.get(name)
        if before is not None and before.shared == shared and before.files == files:
            return before
        refusal = ""
        try:
            checked_views(self.path, trials={name}, follow_links=self.follow_links)
        except BadInput as problem:
            refusal = str(problem)
            if before is None or refusal != before.refusal:
                self.announce(f"waiting for {name}: {refusal}")
        self._checks[name] = _Check(shared, files, refusal)
        return self._checks[name]

    def are_changing(self, names: Iterable[str]) -> bool:
        """Return whether one of these trials, which were complete, is there and has changed."""
        for name in names:
            files = self.recording.trials.get(name)
            if files is not None and files != self._checks[name].files:
                return True
        return False


def _list_session(path: Path) -> _Recording:
    """Return the files of a session as they are now."""
    shared = {}
    for entry in visible(path):
        if entry.name != "trials":
            shared |= _list_files(entry)
    trials = {}
    for entry in visible(path / "trials"):
        if entry.is_dir():
            trials[entry.name] = _list_files(entry)
    return _Recording(shared, trials)


def _list_files(place: Path) -> Listing:
    """Return every file at or below a place."""
    listing = {}
    for file in [place] if place.is_file() else sorted(place.rglob("*")):
        try:
            facts = file.stat()
        except FileNotFoundError:  # a temporary file that has got its name
            continue
        if file.is_file():
            listing[str(file)] = (facts.st_size, facts.st_mtime_ns)
    return listing


def watch(
    session_path: Path,
    out: Path,
    settings: Settings,
    *,
    every_s: float,
    workers: int = 1,
    dask: str | None = None,
    figure_formats: Sequence[str] = (),
    announce: Callable[[str], object] = print,
    pause: Callable[[float], object] = time.sleep,
) -> int:
    """Evaluate a session as it grows, until interrupted.

    Return the exit code of the last evaluation, as `evaluate` has it. every_s: how often the
    session is listed. pause: waits for so many seconds. An interruption within an evaluation is
    raised, for that one is not whole. announce: is given the verdict each time, and why a trial is
    not complete. Raise BadInput where there is no session.
    """
    own_estimators(settings.estimators)
    check_outside(out, session_path)
    if not session_path.is_dir():
        raise BadInput("there is no such folder; give the session's folder", file=str(session_path))
    evaluate_trials = partial(
        evaluate,
        session_path,
        out,
        settings,
        workers=workers,
        dask=dask,
        figure_formats=figure_formats,
        announce=announce,
        verdict_alone=True,
    )
    trials = _CompleteTrials(session_path, announce, settings.follow_links)
    code = DONE
    for ready in _recordings(trials, partial(pause, every_s)):
        announce(f"{len(ready.trials)} complete: {', '.join(ready.trials)}")
        try:
            code = evaluate_trials(trials=set(ready.trials))
        except (BadInput, Refused) as problem:
            announce(f"not yet: {problem}")
    return code


def _recordings(trials: _CompleteTrials, wait: Callable[[], object]) -> Iterator[_Recording]:
    """Yield the session so far, complete trials alone, whenever it is to be evaluated (anew).

    Ends where the waiting is interrupted. The user is informed whenever the waiting begins, and once if every
    evaluation calibrates.
    """
    evaluated = _Recording()
    has_hinted = False
    is_waiting = False
    while True:
        trials.update()
        ready = _Recording(trials.recording.shared, trials.complete)
        if not ready.trials or ready == evaluated or trials.are_changing(evaluated.trials):
            if not is_waiting:
                trials.announce(f"waiting for trials in {trials.path}; Ctrl-C ends")
            is_waiting = True
            try:
                wait()
            except KeyboardInterrupt:
                return
            continue
        is_waiting = False
        # the first evaluation calibrates in any case
        if evaluated.trials and not has_hinted and _calibrates_cameras(trials.path):
            trials.announce(_HINT)
            has_hinted = True
        evaluated = ready
        yield ready


def _calibrates_cameras(session: Path) -> bool:
    """Return whether every evaluation calibrates the cameras from the boards of the session."""
    return (session / "boards").is_dir() and not (session / "cameras.toml").is_file()
