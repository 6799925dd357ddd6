"""A session holds folders and regular files, and links that stay within it: nothing else is opened.

Large recordings often lie on another disk: where the user says so, a camera's folder, a picture or a video may be a
link that leads out. Nothing else may: manifests and tables stay in the session.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePath

from bench.base.doubts import Doubts
from bench.base.errors import BadInput
from vision.pictures.files import FILM_SUFFIXES, PICTURE_SUFFIXES

_MOST_NAMED = 3  # names in one line
_FOOTAGE = PICTURE_SUFFIXES | FILM_SUFFIXES
# Where a camera's folder stands, in parts of the path within the session: boards/<camera>, trials/<trial>/<camera>.
_CAMERA_AT = {"boards": 2, "trials": 3}


def check_inside(session: Path, doubts: Doubts, follow_links: bool = False) -> None:
    """Refuses what would hang a reader (pipes, sockets, devices) and links that lead out of the session or nowhere.

    follow_links: those of cameras may lead out. Hidden entries are not read, so they are not looked at. Raises
    BadInput, naming the first ones.
    """
    found = list(_Looking(session.resolve(), follow_links).strange(session, PurePath()))
    with doubts.guard():
        if found:
            more = f", and {len(found) - _MOST_NAMED} more" if len(found) > _MOST_NAMED else ""
            raise BadInput("; ".join(found[:_MOST_NAMED]) + more)


@dataclass(frozen=True)
class _Looking:
    session: Path
    follow_links: bool

    def strange(self, folder: Path, shown: PurePath) -> Iterator[str]:
        """A line on each entry that is not opened. shown: the folder by its path within the session."""
        with os.scandir(folder) as entries:
            for entry in sorted(entries, key=lambda e: e.name):
                path, name = Path(entry.path), shown / entry.name
                if entry.name.startswith("."):
                    continue
                if entry.is_symlink():
                    yield from self._of_link(path, name)
                elif entry.is_dir():
                    yield from self.strange(path, name)
                elif not entry.is_file():
                    yield f"{name.as_posix()}: is no regular file (a pipe, socket or device)"

    def _of_link(self, path: Path, name: PurePath) -> Iterator[str]:
        try:
            target = path.resolve(strict=True)
        except (OSError, RuntimeError):  # RuntimeError: links in a circle, before Python 3.13
            yield f"{name.as_posix()}: is a link that leads nowhere"
            return
        if self.session.is_relative_to(target) or path.parent.resolve().is_relative_to(target):
            yield f"{name.as_posix()}: is a link to a folder that holds it"
        elif not (target.is_dir() or target.is_file()):
            yield f"{name.as_posix()}: is no regular file (a pipe, socket or device)"
        elif not target.is_relative_to(self.session):
            yield from self._of_link_out(target, name)

    def _of_link_out(self, target: Path, name: PurePath) -> Iterator[str]:
        out = f"{name.as_posix()}: is a link that leads out of the session"
        if not _is_footage(target, name):
            yield f"{out}; put the files themselves there"
        elif not self.follow_links:
            yield f"{out}; put the files themselves there, or give --follow-links where you know who made it"
        elif target.is_dir():
            yield from self.strange(target, name)


def _is_footage(target: Path, name: PurePath) -> bool:
    """Whether what a link leads to is read as pictures alone."""
    if target.is_dir():
        return len(name.parts) == _CAMERA_AT.get(name.parts[0])
    return {name.suffix.lower(), target.suffix.lower()} <= _FOOTAGE


def check_outside(out: Path, session: Path, option: str = "--out") -> None:
    """Raises BadInput where results would be written into the session: it is what was recorded, and stays so."""
    if out.resolve().is_relative_to(session.resolve()):
        raise BadInput(
            f"{option} {out} lies in the session, which is never written to; give a folder outside of it"
        )
