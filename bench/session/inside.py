"""A session holds folders and regular files, and links that stay within it: nothing else is opened."""

import os
from collections.abc import Iterator
from pathlib import Path

from bench.base.doubts import Doubts
from bench.base.errors import BadInput

_MOST_NAMED = 3  # names in one line


def check_inside(session: Path, doubts: Doubts) -> None:
    """Refuses what would hang a reader (pipes, sockets, devices) and links that lead out of the session or nowhere.

    Hidden entries are not read, so they are not looked at. Raises BadInput, naming the first ones.
    """
    found = list(_strange(session, session.resolve()))
    with doubts.guard():
        if found:
            more = f", and {len(found) - _MOST_NAMED} more" if len(found) > _MOST_NAMED else ""
            raise BadInput("; ".join(found[:_MOST_NAMED]) + more)


def _strange(folder: Path, session: Path) -> Iterator[str]:
    with os.scandir(folder) as entries:
        for entry in sorted(entries, key=lambda e: e.name):
            if entry.name.startswith("."):
                continue
            if entry.is_symlink():
                yield from _of_link(Path(entry.path), session)
            elif entry.is_dir():
                yield from _strange(Path(entry.path), session)
            elif not entry.is_file():
                yield f"{_shown(entry.path, session)}: is no regular file (a pipe, socket or device)"


def _of_link(path: Path, session: Path) -> Iterator[str]:
    try:
        target = path.resolve(strict=True)
    except (OSError, RuntimeError):  # RuntimeError: links in a circle, before Python 3.13
        yield f"{_shown(path, session)}: is a link that leads nowhere"
        return
    if not target.is_relative_to(session):
        yield f"{_shown(path, session)}: is a link that leads out of the session; put the files themselves there"
    elif session.is_relative_to(target) or path.parent.resolve().is_relative_to(target):
        yield f"{_shown(path, session)}: is a link to a folder that holds it"
    elif not (target.is_dir() or target.is_file()):
        yield f"{_shown(path, session)}: is no regular file (a pipe, socket or device)"


def _shown(path: str | Path, session: Path) -> str:
    """By the path inside the session."""
    absolute = Path(os.path.abspath(path))
    parent = absolute.parent.resolve()
    return (parent / absolute.name).relative_to(session).as_posix()


def check_outside(out: Path, session: Path) -> None:
    """Raises BadInput where results would be written into the session: it is what was recorded, and stays so."""
    if out.resolve().is_relative_to(session.resolve()):
        raise BadInput(f"--out {out} lies in the session, which is never written to; give a folder outside of it")
