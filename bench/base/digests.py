"""Hashes of files' contents, kept from run to run: of a file that is as it was none is read again."""

import os
import time
from pathlib import Path

from bench.base.results import content_hash, read_result, write_result

# s: a file that was changed so shortly before it was read may be changed again within one tick of the file system's
# clock (2 s on FAT, the coarsest), and look as it did.
_SETTLED_S = 3.0
KEPT = ".hashes"


class Digests:
    """Hashes of files by their paths. What a file is known by: size, place on the disk, and the times of its last
    change and of the last change of what the disk says of it, which no program sets back."""

    def __init__(self, out: Path):
        """Those kept in a folder of results."""
        self._path = out / KEPT
        kept = read_result(self._path)
        self._kept: dict[str, list] = kept if isinstance(kept, dict) else {}
        self._changed = False

    def of(self, file: Path) -> bytes:
        """Hash of the content. Raises OSError where it cannot be read."""
        known, name = _known_by(file), str(file.absolute())
        *before, digest = self._kept.get(name, [None])
        if before == known:
            return bytes.fromhex(digest)
        digest = content_hash(file)
        if time.time_ns() - max(known[2:]) > 1e9 * _SETTLED_S:
            self._kept[name], self._changed = [*known, digest.hex()], True
        return digest

    def keep(self) -> None:
        """Write down what is new."""
        if self._changed:
            write_result(self._path, self._kept)
            self._changed = False


def _known_by(file: Path) -> list[int]:
    found = os.stat(file)
    return [found.st_size, found.st_ino, found.st_mtime_ns, found.st_ctime_ns]
