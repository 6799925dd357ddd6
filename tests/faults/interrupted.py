"""Runs that are killed, and disks that are full, at random moments: what is resumed is what was never disturbed.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/faults/interrupted.py kill|felt|seen|full COUNT [SESSION]

`kill`: an evaluation with two workers, or one of its workers, is killed (SIGKILL) at a random moment of the time that
it takes, then started again: each file of the output must be the same to the byte as without. COUNT is of those that
found it alive; the time is measured before the first, and again where a run had ended.
`felt`: the same of a session's signals alone, in forks of a process that has loaded all there is to load: a tenth of
the time, and the same files, locks, workers and tables, without pictures. `seen`: of two trials with their pictures and
known cameras, in forks as well.
`full`: no byte can be written from a random file on, by a limit on the size of files, which anyone may set. One line
and exit code 2, each file that stood before stands, and what is resumed is the same to the byte.
Prints a line each; the exit code is 1 where one of them fails. 10 of the small session take some ten minutes, 100 of
`felt` about as long.
"""

import io
import itertools
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from bench.base import atomic, workers
from bench.base.digests import KEPT
from bench.commands import cli
from tests.faults.fuzz import GAUGES

ROOT = Path(__file__).resolve().parents[2]
SESSION = ROOT / "fixtures" / "small-session"
_LOOK_S = 0.02
_OF_WORKERS = 0.25  # of the kills
_MOST_ENDED = 3  # times as many runs may have ended before they were to be killed
ENDED_S = 2.0  # a worker notices within a second that its run was killed
_OWN = (".lock", KEPT)  # the run's process id; which files of the session were as they were when


def command(session: Path, out: Path) -> list[str]:
    """An evaluation with two workers."""
    return [
        sys.executable,
        "-m",
        "bench.commands.cli",
        "evaluate",
        str(session),
        "--out",
        str(out),
        "--workers",
        "2",
    ]


def started(session: Path, out: Path) -> subprocess.Popen:
    where = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        command(session, out), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=where
    )


class Fork:
    """An evaluation in a fork of this process; so are its two workers, which are spawned elsewhere."""

    def __init__(self, session: Path, out: Path):
        self._said, self.returncode = out.with_name("said.txt"), None
        self.pid = os.fork()
        if self.pid == 0:
            self._run(session, out)

    def _run(self, session: Path, out: Path) -> None:
        code = 99
        try:
            with (
                self._said.open("w") as file,
                redirect_stdout(io.StringIO()),
                redirect_stderr(file),
            ):
                code = cli.main(command(session, out)[3:])
        finally:
            os._exit(code)

    def poll(self) -> int | None:
        """The exit code, None while it runs."""
        if self.returncode is None:
            ended, status = os.waitpid(self.pid, os.WNOHANG)
            self.returncode = os.waitstatus_to_exitcode(status) if ended else None
        return self.returncode

    def wait(self) -> int:
        """The exit code, once it has ended."""
        while self.poll() is None:
            time.sleep(_LOOK_S)
        return self.returncode

    def communicate(self) -> tuple[None, bytes]:
        """Nothing, and what was said of a fault, once it has ended."""
        self.wait()
        return None, self._said.read_bytes()


def felt_session(folder: Path) -> Path:
    """The small session's signals, with gauges brought along."""
    session = folder / "felt"
    shutil.copytree(
        SESSION, session, ignore=shutil.ignore_patterns("boards", "low", "high", "frames.csv")
    )
    (session / "gauges.toml").write_text(GAUGES)
    return session


def seen_session(folder: Path) -> Path:
    """The small session's measured trials, with cameras and gauges brought along."""
    session = folder / "seen"
    shutil.copytree(SESSION, session, ignore=shutil.ignore_patterns("gauge_*"))
    (session / "gauges.toml").write_text(GAUGES)
    with redirect_stdout(io.StringIO()):
        cli.main(["calibrate", "cameras", str(SESSION), "--out", str(session / "cameras.toml")])
    return session


def in_forks(make: Callable[[Path], Path], count: int) -> int:
    """How many of so many killed runs did not come to the same bytes, in forks. make(folder): their session."""
    loaded = get_context
    workers.multiprocessing.get_context = lambda _: loaded("fork")
    with tempfile.TemporaryDirectory() as folder:
        session = make(Path(folder))
        with redirect_stdout(io.StringIO()):  # loads all that is loaded at first use
            cli.main(["evaluate", str(session), "--out", str(Path(folder) / "first")])
        return kill(count, session, Fork)


def contents(out: Path) -> dict[str, bytes]:
    """Every file of an output, by name."""
    files = (path for path in out.rglob("*") if path.is_file() and path.name not in _OWN)
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in files}


def differences(found: dict[str, bytes], wanted: dict[str, bytes]) -> list[str]:
    """Names of files that are missing, too many or others."""
    return sorted(
        name for name in found.keys() | wanted.keys() if found.get(name) != wanted.get(name)
    )


def _workers(pid: int) -> list[int]:
    """Processes that a run works by (Linux)."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [
        int(child)
        for child in children
        if b"resource_tracker" not in Path(f"/proc/{child}/cmdline").read_bytes()
    ]


def killed(
    start: Callable, session: Path, out: Path, after_s: float, rng: np.random.Generator
) -> str:
    """What was killed so long after the start, the run or one of its workers; nothing where the run had ended."""
    begin, run = time.monotonic(), start(session, out)
    while run.poll() is None and time.monotonic() < begin + after_s:
        time.sleep(min(_LOOK_S, max(begin + after_s - time.monotonic(), 0.0)))
    if run.poll() is not None:
        run.communicate()
        return ""
    others = _workers(run.pid) if rng.random() < _OF_WORKERS else []
    victim = int(rng.choice(others or [run.pid]))
    with suppress(ProcessLookupError):
        os.kill(victim, signal.SIGKILL)
    said = run.communicate()[1].decode()
    time.sleep(ENDED_S)
    if run.returncode == -signal.SIGKILL:
        return "the run"
    if victim == run.pid:
        return ""  # it ended as it was looked up
    assert run.returncode in (0, 1), said  # its trial was given to another
    return "a worker"


def kill(count: int, session: Path = SESSION, start: Callable = started) -> int:
    """How many of so many killed runs did not come to the same bytes. start(session, out): a run."""
    rng, bad, ended, alive = np.random.default_rng(9), 0, 0, Counter()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"  # one name: .session and messages hold none
        takes_s = _takes_s(start, session, out)
        wanted = contents(out)
        while alive.total() < count:
            shutil.rmtree(out)
            after_s = rng.uniform(0.0, takes_s)
            what = killed(start, session, out, after_s, rng)
            if not what:
                ended += 1
                assert ended < _MOST_ENDED * count, "hardly a run was still there to be killed"
                shutil.rmtree(out)
                takes_s = min(takes_s, _takes_s(start, session, out))
                continue
            alive[what] += 1
            stood = len(contents(out))
            assert start(session, out).wait() in (0, 1)
            wrong = differences(contents(out), wanted)
            bad += bool(wrong)
            told = f"differ: {wrong}" if wrong else "resumed to the same bytes"
            when = f"after {after_s:.2f} of {takes_s:.2f} s, {stood} of {len(wanted)} files stood"
            print(f"{alive.total()}: killed {what} {when}; {told}", flush=True)
    print(
        f"killed alive: {dict(alive)}, {bad} not resumed to the same bytes; {ended} had ended before",
        flush=True,
    )
    return bad


def _takes_s(start: Callable, session: Path, out: Path) -> float:
    """How long an undisturbed run takes."""
    begin = time.monotonic()
    assert start(session, out).wait() in (0, 1)
    return time.monotonic() - begin


@contextmanager
def full_disk(first: int, files: int = sys.maxsize):
    """From the so-many-th file on, for so many files, no byte can be written. Of this process alone."""
    number, made = itertools.count(), atomic.tempfile.mkstemp
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)

    def mkstemp(**how):
        full = first <= next(number) < first + files
        resource.setrlimit(resource.RLIMIT_FSIZE, (0 if full else limits[0], limits[1]))
        return made(**how)

    atomic.tempfile.mkstemp = mkstemp
    try:
        yield number
    finally:
        atomic.tempfile.mkstemp = made
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def full(count: int, session: Path = SESSION) -> int:
    """How many of so many runs onto a full disk lost something that stood, or did not go on from there."""
    rng, bad = np.random.default_rng(9), 0

    def run(out: Path) -> tuple[int, str]:
        """Exit code, and what was said of a fault."""
        said = io.StringIO()
        with redirect_stdout(io.StringIO()), redirect_stderr(said):
            return cli.main(["evaluate", str(session), "--out", str(out)]), said.getvalue().strip()

    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        with full_disk(sys.maxsize) as number:
            run(out)
        wanted, files = contents(out), next(number)
        for k in range(count):
            shutil.rmtree(out)
            first = int(rng.integers(files))
            with full_disk(first):
                code, said = run(out)
            stood = contents(out)
            torn = [name for name in stood if stood[name] != wanted.get(name)]
            run(out)
            wrong = [*torn, *differences(contents(out), wanted)]
            bad += bool(wrong) or code != 2 or "\n" in said
            told = f"differ: {wrong}" if wrong else "resumed to the same bytes"
            shown = f"exit {code} ({said.replace(folder, '')}), {len(stood)} stood; {told}"
            print(f"{k}: full from file {first} of {files} on: {shown}", flush=True)
    return bad


if __name__ == "__main__":
    forks = {"felt": partial(in_forks, felt_session), "seen": partial(in_forks, seen_session)}
    ways = {"kill": kill, "full": full, **forks}
    sys.exit(bool(ways[sys.argv[1]](int(sys.argv[2]), *map(Path, sys.argv[3:]))))
