"""Files that are written whole or not at all, and one run at a time on one output folder."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from bench.base.errors import BadInput

try:
    import fcntl
except ImportError:  # not on Windows; there two runs on one folder are the user's to avoid
    fcntl = None

LOCK = ".lock"
_UNFINISHED = ".unfinished-"  # begins the name of a file that is being written


def write_whole(path: Path, data: str | bytes) -> None:
    """Write a file so that it is the old one or the new one, never half of either.

    Makes folders as needed.
    """
    with whole_file(path) as temporary:
        temporary.write_bytes(data.encode() if isinstance(data, str) else data)


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a temporary path in the folder of `path`, of the same suffix, for writers that want one.

    It becomes `path` on leaving; where the block raises, nothing is left of it. Raises OSError, with
    `path`, where it cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=_UNFINISHED, suffix=path.suffix)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o666 & ~_umask())
        os.replace(temporary, path)
    except BaseException as problem:
        temporary.unlink(missing_ok=True)
        # a full disk names no file
        if isinstance(problem, OSError) and problem.filename in (None, name):
            problem.filename = str(path)
            problem.filename2 = None
        raise


def _umask() -> int:
    """Return the process's mask of a new file's permissions."""
    mask = os.umask(0)
    os.umask(mask)
    return mask


@contextmanager
def lock_output(folder: Path) -> Iterator[None]:
    """Lock `folder` (made as needed) for one run. Raises BadInput where another run holds it.

    The lock ends with the process, however that ends. What a killed run left unfinished is removed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / LOCK).open("a+") as lock:
        _hold(lock, folder)
        lock.truncate(0)
        lock.write(f"{os.getpid()}\n")
        lock.flush()
        for left in folder.rglob(f"{_UNFINISHED}*"):
            left.unlink(missing_ok=True)
        yield


def _hold(lock: TextIO, folder: Path) -> None:
    """Lock a folder by its lock file. Raise BadInput where another run holds it."""
    if fcntl is None:
        return
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        lock.seek(0)
        pid = lock.read().strip() or "unknown"
        found = f"another run (process {pid}) writes to this folder; wait for it"
        raise BadInput(found, file=folder) from None
