"""A session holds folders and regular files, and links that stay within it: nothing else is opened.

Large recordings often lie on another disk: where the user says so, a camera's folder, a picture or
a video may be a link that leads out. Nothing else may: manifests and tables stay in the session.
"""

import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePath

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.session.file_names import SESSION_TOML, TRIAL_TOML
from vision.pictures import FILM_SUFFIXES, PICTURE_SUFFIXES

_MOST_NAMED = 3  # names in one line
_FOOTAGE = PICTURE_SUFFIXES | FILM_SUFFIXES
# Depth of a camera's folder within the session: boards/<camera>, trials/<trial>/<camera>.
_CAMERA_DEPTH = {"boards": 2, "trials": 3}
# Names that a session gives to files, and to no folder.
_FILES = {
    *(SESSION_TOML, TRIAL_TOML, "signals.csv", "frames.csv", "stage.csv"),
    *("gauges.toml", "cameras.toml", "rig.toml"),
}
_NOT_REGULAR = "is no regular file (a pipe, socket or device)"


def check_inside(session: Path, problems: InputProblems, follow_links: bool = False) -> None:
    """Refuse entries that would hang a reader, and links that lead out of the session or nowhere.

    Pipes, sockets and devices hang a reader. follow_links: links of cameras may lead out. Hidden
    entries are not read, and not checked. Raises BadInput, naming the first ones.
    """
    _check_names(session)
    found = list(_Inspection(session.resolve(), follow_links).refused(session, PurePath()))
    with problems.guard():
        if found:
            more = f", and {len(found) - _MOST_NAMED} more" if len(found) > _MOST_NAMED else ""
            raise BadInput("; ".join(found[:_MOST_NAMED]) + more)


@dataclass(frozen=True)
class _Inspection:
    """An inspection of a session's folder. follow_links: links of cameras may lead out."""

    session: Path
    follow_links: bool

    def refused(self, folder: Path, label: PurePath) -> Iterator[str]:
        """Yield a line on each entry that is not opened. label: the folder's path in the session."""
        for path in sorted(folder.iterdir()):
            name = label / path.name
            if path.name.startswith("."):
                continue
            if path.name in _FILES and path.is_dir():
                yield f"{name.as_posix()}: is a folder; a file is expected there"
            elif path.is_symlink():
                yield from self._refused_link(path, name)
            elif path.is_dir():
                yield from self.refused(path, name)
            elif not path.is_file():
                yield f"{name.as_posix()}: {_NOT_REGULAR}"

    def _refused_link(self, path: Path, name: PurePath) -> Iterator[str]:
        """Yield a line on a link that is not followed, or on each such entry below it."""
        try:
            target = path.resolve(strict=True)
        except (OSError, RuntimeError):  # RuntimeError: links in a circle, before Python 3.13
            yield f"{name.as_posix()}: is a link that leads nowhere"
            return
        if self.session.is_relative_to(target) or path.parent.resolve().is_relative_to(target):
            yield f"{name.as_posix()}: is a link to a folder that holds it"
        elif not (target.is_dir() or target.is_file()):
            yield f"{name.as_posix()}: {_NOT_REGULAR}"
        elif not target.is_relative_to(self.session):
            yield from self._refused_link_out(target, name)

    def _refused_link_out(self, target: Path, name: PurePath) -> Iterator[str]:
        """Yield a line on a link out of the session, or on each refused entry below it."""
        found = f"{name.as_posix()}: is a link that leads out of the session"
        cure = "put the files themselves there"
        if not _is_footage(target, name):
            yield f"{found}; {cure}"
        elif not self.follow_links:
            yield f"{found}; {cure}, or give --follow-links where you know who made it"
        elif target.is_dir():
            yield from self.refused(target, name)


def _check_names(session: Path) -> None:
    """Raise BadInput for a name that no table or message could hold."""
    for path in sorted(session.rglob("*")):
        name = path.relative_to(session)
        fault = _fault_of_name(path.name)
        if fault and not any(part.startswith(".") for part in name.parts):
            raise BadInput(f"{name.as_posix()!a}: {fault}")


def _fault_of_name(name: str) -> str:
    """Return what keeps a name from tables and messages; '' where nothing does."""
    try:
        name.encode()
    except UnicodeEncodeError:
        return "the name is not UTF-8; rename it"
    if any(unicodedata.category(letter) == "Cc" for letter in name):
        return "the name holds a line break or another control character; rename it"
    return ""


def _is_footage(target: Path, name: PurePath) -> bool:
    """Return whether the target of a link is read as pictures alone."""
    if target.is_dir():
        return len(name.parts) == _CAMERA_DEPTH.get(name.parts[0])
    return {name.suffix.lower(), target.suffix.lower()} <= _FOOTAGE


def check_outside(out: Path, session: Path, option: str = "--out") -> None:
    """Raise BadInput where results would be written into the session, which stays as recorded."""
    if out.resolve().is_relative_to(session.resolve()):
        found = f"{option} {out} lies in the session, which is never written to"
        raise BadInput(f"{found}; give a folder outside of it")
