"""Hashes of files' contents, kept from run to run: of a file that is as it was none is read again."""

import os
import time
from pathlib import Path

from bench.base.results import content_hash, read_result, write_result

# [s] A file that was changed so shortly before it was read may be changed again within one tick of the file system's
# clock (2 s on FAT, the coarsest), with the same times.
_CLOCK_TICKS_S = 3.0
KEPT = ".hashes"


class Digests:
    """Hashes of files by their paths.

    A file is identified by its size, its place on the disk, and the times of its last change and of
    its last change of status, which no program sets back.
    """

    def __init__(self, out: Path):
        """Load the hashes kept in a folder of results."""
        self._path = out / KEPT
        kept = read_result(self._path)
        self._kept: dict[str, list] = kept if isinstance(kept, dict) else {}
        self._changed = False

    def of(self, file: Path) -> bytes:
        """Return the hash of a file's content. Raise OSError where it cannot be read."""
        identity = _identity(file)
        name = str(file.absolute())
        *before, digest = self._kept.get(name, [None])
        if before == identity:
            return bytes.fromhex(digest)
        digest = content_hash(file)
        if time.time_ns() - max(identity[2:]) > 1e9 * _CLOCK_TICKS_S:
            self._kept[name] = [*identity, digest.hex()]
            self._changed = True
        return digest

    def keep(self) -> None:
        """Write the hashes where one is new."""
        if self._changed:
            write_result(self._path, self._kept)
            self._changed = False


def _identity(file: Path) -> list[int]:
    """Return size, place on the disk, and times of change, ns, of a file."""
    found = os.stat(file)
    return [found.st_size, found.st_ino, found.st_mtime_ns, found.st_ctime_ns]
