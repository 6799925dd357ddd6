"""Seeded mutations of a session's files: each is checked in a process of its own, with limits of time and memory.

    python tests/faults/fuzz.py FIRST_SEED COUNT [evaluate]

Prints a line for each mutation that ends in a fault of ours (exit code 70, a traceback, a signal), takes more than
10 s of a processor, is found asleep after a minute, or asks for more than 2 GB; then how many were tried and how they
ended. 1000 take a minute or two; with `evaluate`, which evaluates each in place of a check, some ten times as long.
"""

import gc
import io
import os
import re
import resource
import select
import shutil
import signal
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from functools import cache
from pathlib import Path

import cv2
import numpy as np

SESSION = Path(__file__).resolve().parents[2] / "fixtures" / "small-session"
TRIAL, FRAMES, EVERY, SHRINK = "b60_4", 5, 4, 8  # of the frames, samples and pixels that there are
MOST_S, MOST_WAIT_S, MOST_BYTES = 10, 60.0, 2 << 30
TOO_LONG = "too long"
ODD = [
    "nan",
    "inf",
    "-1",
    "0",
    "1e308",
    "-1e-308",
    "99999999999999999999",
    "",
    "'",
    '"',
    "[",
    "]]",
    "=",
    ",",
    "\0",
]

CAMERA = """[cameras.{name}]
size_px = [160, 90]
matrix = [[250.0, 0.0, 80.0], [0.0, 250.0, 45.0], [0.0, 0.0, 1.0]]
distortion = [-0.1, 0.1, 0.0, 0.0, 0.0]
T_camera_rig = [[1.0, 0.0, 0.0, -60.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 350.0]]
rms_px = 0.05
"""
GAUGES = "offset_V = [0.0, 0.0]\nmatrix_Nmm_per_V = [[11.3, 0.3], [-0.2, 10.5]]\nC_Nmm2 = 8835.7\n"


def small_base(folder: Path) -> Path:
    """A session of one trial with five frames of 160 × 90 px, and its cameras and gauges."""
    base, source = folder / "base", SESSION / "trials" / TRIAL
    trial = base / "trials" / TRIAL
    for camera in ("high", "low"):
        (trial / camera).mkdir(parents=True)
        for k, picture in enumerate(sorted((source / camera).iterdir())[:FRAMES]):
            _shrunk(picture, trial / camera / f"{k}{('.png', '.jpg')[k % 2]}")
        (base / "boards" / "rig").mkdir(parents=True, exist_ok=True)
        _shrunk(
            SESSION / "boards" / "rig" / f"{camera}.png", base / "boards" / "rig" / f"{camera}.png"
        )
    for name, rows in (("frames.csv", slice(FRAMES)), ("signals.csv", slice(None, None, EVERY))):
        head, *lines = (source / name).read_text().splitlines()
        (trial / name).write_text("\n".join([head, *lines[rows]]) + "\n")
    shutil.copyfile(source / "trial.toml", trial / "trial.toml")
    shutil.copyfile(SESSION / "session.toml", base / "session.toml")
    (base / "cameras.toml").write_text(
        "".join(CAMERA.format(name=name) for name in ("high", "low"))
    )
    (base / "gauges.toml").write_text(GAUGES)
    return base


def _shrunk(source: Path, target: Path) -> None:
    grey = cv2.imread(str(source), cv2.IMREAD_GRAYSCALE)
    small = cv2.resize(
        grey, (grey.shape[1] // SHRINK, grey.shape[0] // SHRINK), interpolation=cv2.INTER_AREA
    )
    assert cv2.imwrite(str(target), small)


def with_films(base: Path) -> Path:
    """The same session, its trial's frames a video and a TIFF stack."""
    films = base.with_name("films")
    shutil.copytree(base, films)
    trial = films / "trials" / TRIAL
    for camera in ("high", "low"):
        greys = [
            cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
            for file in sorted((trial / camera).iterdir())
        ]
        shutil.rmtree(trial / camera)
        if camera == "low":
            assert cv2.imwritemulti(str(trial / "low.tif"), greys)
            continue
        fourcc = cv2.VideoWriter_fourcc(*"MJPG")
        writer = cv2.VideoWriter(
            str(trial / f"{camera}.avi"), fourcc, 20.0, greys[0].shape[::-1], False
        )
        for grey in greys:
            writer.write(grey)
        writer.release()
    return films


def mutate(session: Path, rng: np.random.Generator) -> str:
    """One to three changes to files of a session; returns what was done."""
    return "; ".join(_one_change(session, rng) for _ in range(int(rng.integers(1, 4))))


def _one_change(session: Path, rng: np.random.Generator) -> str:
    files = sorted(path for path in session.rglob("*") if path.is_file())
    kinds = sorted({path.suffix for path in files})
    kind = kinds[int(rng.integers(len(kinds)))]  # manifests as often as pictures
    of_kind = [path for path in files if path.suffix == kind]
    path = of_kind[int(rng.integers(len(of_kind)))]
    ways = BYTES if kind not in (".toml", ".csv") else BYTES + TEXT
    way = ways[int(rng.integers(len(ways)))]
    data = way(path.read_bytes(), rng)
    path.unlink()
    path.write_bytes(data)
    return f"{way.__name__} {path.relative_to(session).as_posix()}"


def _span(data: bytes, rng) -> slice:
    first = int(rng.integers(len(data) + 1))
    return slice(first, min(len(data), first + int(rng.integers(1, 64))))


def flipped(data: bytes, rng) -> bytes:
    """Some bytes are others, near the start as often as anywhere."""
    changed = bytearray(data)
    reach = len(data) if rng.random() < 0.5 else min(len(data), 64)
    for _ in range(int(rng.integers(1, 9)) if data else 0):
        changed[int(rng.integers(reach))] = int(rng.integers(256))
    return bytes(changed)


def cut(data: bytes, rng) -> bytes:
    """The end is missing."""
    return data[: int(rng.integers(len(data) + 1))]


def without(data: bytes, rng) -> bytes:
    """A piece is missing."""
    span = _span(data, rng)
    return data[: span.start] + data[span.stop :]


def doubled(data: bytes, rng) -> bytes:
    """A piece comes many times."""
    span = _span(data, rng)
    return data[: span.stop] + data[span] * int(rng.integers(1, 2000)) + data[span.stop :]


def emptied(data: bytes, rng) -> bytes:
    """Nothing is left."""
    return b""


def number(data: bytes, rng) -> bytes:
    """A number, or what is between two, is another."""
    text = data.decode("utf-8", "replace")
    places = list(re.finditer(r"-?\d+\.?\d*", text))
    if not places:
        return data
    found = places[int(rng.integers(len(places)))]
    odd = (
        ODD[int(rng.integers(len(ODD)))]
        if rng.random() < 0.6
        else f"{rng.normal() * 10.0 ** rng.integers(-9, 10)}"
    )
    return (text[: found.start()] + odd + text[found.end() :]).encode()


def lines_exchanged(data: bytes, rng) -> bytes:
    """Two lines stand in each other's place, or one comes twice."""
    lines = data.split(b"\n")
    a, b = (int(k) for k in rng.integers(len(lines), size=2))
    lines[a], lines[b] = (lines[b], lines[a]) if rng.random() < 0.5 else (lines[b], lines[b])
    return b"\n".join(lines)


def word(data: bytes, rng) -> bytes:
    """A word is another of the file's words."""
    words = list(re.finditer(rb"[A-Za-z_]+", data))
    if not words:
        return data
    old, new = (words[int(k)] for k in rng.integers(len(words), size=2))
    return data[: old.start()] + new.group() + data[old.end() :]


BYTES: tuple[Callable, ...] = (flipped, cut, without, doubled, emptied)
TEXT: tuple[Callable, ...] = (number, number, number, lines_exchanged, word)


def tried(base: Path, seed: int, work: Path, verb: str) -> tuple[str, str]:
    """How a mutation ended ('exit 0', 'signal 9', 'traceback', TOO_LONG), and what it was with what was said."""
    session, said, out = work / "session", work / "said.txt", work / "out"
    shutil.rmtree(session, ignore_errors=True)
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(base, session, copy_function=os.link)  # what is changed is unlinked before
    what = mutate(session, np.random.default_rng(seed))
    child = os.fork()
    if child == 0:
        _run(_arguments(verb, session, out), said)
    if not _ends(child):
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        return TOO_LONG, f"seed {seed}: {what}"
    _, status = os.waitpid(child, 0)
    text = said.read_text(errors="replace")
    how = (
        f"exit {os.WEXITSTATUS(status)}"
        if os.WIFEXITED(status)
        else f"signal {os.WTERMSIG(status)}"
    )
    return (
        "traceback" if "Traceback" in text else how
    ), f"seed {seed}: {what}: {text.strip()[-300:]}"


def _arguments(verb: str, session: Path, out: Path) -> list[str]:
    return [
        verb,
        str(session),
        *(["--out", str(out), "--no-figures"] if verb == "evaluate" else []),
    ]


def _ends(child: int) -> bool:
    """Whether a process ends in time; waits until it does. One that waits for a processor has its own limit."""
    handle = os.pidfd_open(child)
    try:
        while not select.select([handle], [], [], MOST_WAIT_S)[0]:
            threads = [
                one.read_text().rpartition(") ")[2]
                for one in Path(f"/proc/{child}/task").glob("*/stat")
            ]
            if not any(state.startswith("R") for state in threads):
                return False
        return True
    finally:
        os.close(handle)


def _run(arguments: list[str], said: Path) -> None:
    """In the child: run a verb within limits, and end."""
    code = 99
    try:
        with said.open("w") as file:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
        used = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
        resource.setrlimit(resource.RLIMIT_AS, (used + MOST_BYTES, used + MOST_BYTES))
        resource.setrlimit(resource.RLIMIT_CPU, (MOST_S, MOST_S))
        from bench.commands import cli

        code = cli.main(arguments)
        sys.stdout.flush()
        sys.stderr.flush()
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
    finally:
        os._exit(code)


def _sound() -> None:
    """In place of the look at all that is installed, a quarter of a mutation's time."""


def fuzz(first: int, count: int, verb: str = "check") -> tuple[Counter, list[str]]:
    """How many mutations ended how, and a line for each that should not have ended so."""
    from bench.base import environment
    from bench.commands import cli

    environment.check_environment()
    environment.check_environment, cli.make_parser = _sound, cache(cli.make_parser)
    cv2.setNumThreads(0)
    ways, bad = Counter(), []
    with tempfile.TemporaryDirectory() as folder:
        base = small_base(Path(folder))
        bases = base, with_films(base)
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            for one in bases:  # what is loaded at first use is loaded here, not in each child
                cli.main(_arguments(verb, one, Path(folder) / "out"))
        gc.freeze()
        for seed in range(first, first + count):
            how, what = tried(bases[seed % 2], seed, Path(folder), verb)
            ways[how] += 1
            if how not in ("exit 0", "exit 1", "exit 2"):
                bad.append(f"{how}: {what}")
                print(bad[-1], flush=True)
    return ways, bad


if __name__ == "__main__":
    ended, wrong = fuzz(int(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:4])
    print(dict(ended))
    sys.exit(bool(wrong))
