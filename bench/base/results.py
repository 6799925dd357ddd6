"""One file a trial, written whole, with the hash of everything it was made from."""

import hashlib
import json
import math
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from bench.base.atomic import write_whole
from bench.base.threads import in_threads

_TRUTH_FILES = re.compile(r"truth(@.+)?\.(csv|toml|json)")  # of one whisker, or of each of an array
# What a result is made from, as folders and files of our sources: a line changed in one of them makes it anew.
SEEING = (
    *("vision", "bench/session", "bench/cameras", "bench/gauges/felt.py", "bench/trials/seen.py"),
    *("bench/trials/trial_frames.py", "bench/trials/other_wires.py", "bench/trials/whose_wire.py"),
    *(
        "bench/trials/consistency.py",
        "bench/trials/differences.py",
        "bench/trials/placing.py",
        "bench/trials/still_scene.py",
        "bench/trials/seeing.py",
    ),
    *(
        "bench/records",
        "bench/base/doubts.py",
        "bench/base/statuses.py",
        "bench/base/results.py",
        "bench/base/settings.py",
    ),
    *(
        "bench/trials/one_camera.py",
        "estimator/seen_shape.py",
        "estimator/beam.py",
        "estimator/load_cell.py",
    ),
)
ESTIMATING = (*SEEING, "estimator", "bench/gauges", "bench/trials")
DRAWING = ("bench/report", "bench/base/drawing.py")
_ROOT = Path(__file__).resolve().parents[2]
_FILES_AT_ONCE = 32  # of a thread: to hand over each would take as long as to look it up
_MANY = 1000  # values; larger arrays are hashed by their bytes


def hash_of(*parts: object) -> str:
    """Hash of plain values, in their order. Pictures count by their pixels, paths by their names: a session that was
    moved is the same session."""
    return hashlib.blake2b(
        json.dumps(_hashable(parts), sort_keys=True).encode(), digest_size=16
    ).hexdigest()


def _hashable(value):
    if isinstance(value, Path):
        return value.name
    if isinstance(value, np.ndarray) and value.size > _MANY:
        return [
            value.shape,
            str(value.dtype),
            hashlib.blake2b(np.ascontiguousarray(value).tobytes()).hexdigest(),
        ]
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: _hashable(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): _hashable(item) for key, item in value.items()}
    return [_hashable(item) for item in value] if isinstance(value, (list, tuple)) else plain(value)


def content_hash(file: Path) -> bytes:
    """Hash of a file's content."""
    with file.open("rb") as content:  # a video may be larger than the memory
        return hashlib.file_digest(content, hashlib.blake2b).digest()


def hash_of_files(paths: Iterable[Path], digest_of: Callable[[Path], bytes] = content_hash) -> str:
    """Hash of names and contents of files and of all files below folders; truth files do not count. digest_of: gives
    the hash of a content."""
    digest = hashlib.blake2b(digest_size=16)
    places = ([path] if path.is_file() else sorted(_below(path)) for path in sorted(set(paths)))
    files = [file for place in places for file in place if _counts(file.name)]
    some = [files[k : k + _FILES_AT_ONCE] for k in range(0, len(files), _FILES_AT_ONCE)]
    contents = chain.from_iterable(
        in_threads(lambda batch: [digest_of(file) for file in batch], some)
    )
    for file, content in zip(files, contents):
        digest.update(f"{file.name}\0{file.stat().st_size}\0".encode())
        digest.update(content)
    return digest.hexdigest()


def _counts(name: str) -> bool:
    return not _TRUTH_FILES.fullmatch(name) and not name.startswith(".")


def _below(folder: Path) -> Iterator[Path]:
    """All files, those in linked folders too."""
    for place, _, names in os.walk(folder, followlinks=True):
        yield from (file for file in (Path(place) / name for name in names) if file.is_file())


@lru_cache
def hash_of_code(places: tuple[str, ...], root: Path = _ROOT) -> str:
    """Hash of the sources in these folders, with all below them, and files: a new version never takes an old version's
    results for its own. Raises FileNotFoundError where a place is none."""
    digest = hashlib.blake2b(digest_size=16)
    for place in places:
        path = root / place
        sources = [path] if path.suffix == ".py" else sorted(path.rglob("*.py"))
        if not sources:
            raise FileNotFoundError(f"no sources in {place}")
        for file in sources:
            digest.update(f"{file.relative_to(root).as_posix()}\0".encode())
            digest.update(hashlib.blake2b(file.read_bytes()).digest())
    return digest.hexdigest()


def plain(value: object) -> Any:
    """The value as JSON has it: arrays as lists, NaN as null, dataclasses as tables."""
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (np.bool_, np.integer)):
        return value.item()
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return str(value) if isinstance(value, Path) else value


def write_result(path: Path, result: dict) -> None:
    """One trial's result, whole."""
    write_whole(path, json.dumps(plain(result), sort_keys=True) + "\n")


def read_result(path: Path) -> dict | None:
    """A result, or None where there is none that can be read."""
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None
