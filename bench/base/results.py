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
        "bench/trials/contradictions.py",
        "bench/trials/differences.py",
        "bench/trials/kept_fits.py",
        "bench/trials/placing.py",
        "bench/trials/still_scene.py",
        "bench/trials/trace_frames.py",
        "bench/trials/placed_by_board.py",
        "bench/trials/seeing.py",
        "bench/trials/truth_source.py",
        "bench/trials/stated_truth.py",
        "bench/trials/stated_stroke.py",
        "bench/trials/stage_contact.py",
        "bench/trials/stated_length.py",
        "bench/trials/seen_friction.py",
        "bench/gauges/whisker_rods.py",
        "bench/gauges/held_rod.py",
        "bench/gauges/clamped_rod.py",
        "bench/gauges/curved_rod.py",
    ),
    *(
        "bench/records",
        "bench/base/input_problems.py",
        "bench/base/statuses.py",
        "bench/base/results.py",
        "bench/base/settings.py",
        "bench/base/text_files.py",
        "bench/base/toml_text.py",
    ),
    *(
        "bench/trials/one_camera.py",
        "estimator/seen_shape.py",
        "estimator/shape_fit.py",
        "estimator/numerics.py",
        "estimator/vectors.py",
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
    """Return the hash of plain values, in their order.

    Pictures count by their pixels, paths by their names: a session in another folder is the same
    session.
    """
    text = json.dumps(_hashable(parts), sort_keys=True)
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def _hashable(value: object) -> Any:
    """Return a value as JSON has it, with paths by name and large arrays by the hash of their bytes."""
    if isinstance(value, Path):
        return value.name
    if isinstance(value, np.ndarray) and value.size > _MANY:
        content = hashlib.blake2b(np.ascontiguousarray(value).tobytes())
        return [value.shape, str(value.dtype), content.hexdigest()]
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: _hashable(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): _hashable(item) for key, item in value.items()}
    return [_hashable(item) for item in value] if isinstance(value, (list, tuple)) else plain(value)


def content_hash(file: Path) -> bytes:
    """Return the hash of a file's content."""
    with file.open("rb") as content:  # a video may be larger than the memory
        return hashlib.file_digest(content, hashlib.blake2b).digest()


def hash_of_files(paths: Iterable[Path], digest_of: Callable[[Path], bytes] = content_hash) -> str:
    """Return the hash of names and contents of files and of all files below folders.

    Truth files do not count. digest_of: gives the hash of a content.
    """
    digest = hashlib.blake2b(digest_size=16)
    files: list[Path] = []
    for path in sorted(set(paths)):
        below = [path] if path.is_file() else sorted(_below(path))
        files += [file for file in below if _counts(file.name)]
    batches = [files[k : k + _FILES_AT_ONCE] for k in range(0, len(files), _FILES_AT_ONCE)]
    contents = in_threads(lambda batch: [digest_of(file) for file in batch], batches)
    for file, content in zip(files, chain.from_iterable(contents)):
        digest.update(f"{file.name}\0{file.stat().st_size}\0".encode())
        digest.update(content)
    return digest.hexdigest()


def _counts(name: str) -> bool:
    """Return whether a file of this name is recorded, not the truth of a synthetic session."""
    return not _TRUTH_FILES.fullmatch(name) and not name.startswith(".")


def _below(folder: Path) -> Iterator[Path]:
    """Yield all files below a folder, those in linked folders too."""
    for place, _, names in os.walk(folder, followlinks=True):
        yield from filter(Path.is_file, (Path(place) / name for name in names))


@lru_cache
def hash_of_code(places: tuple[str, ...], root: Path = _ROOT) -> str:
    """Return the hash of the sources in these folders, with all below them, and files.

    A new version so never takes an old version's results for its own. Raises FileNotFoundError where
    a place is none.
    """
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
    """Return the value as JSON has it: arrays as lists, NaN as null, dataclasses as tables."""
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, np.ndarray) and np.issubdtype(value.dtype, np.floating):
        return np.where(np.isfinite(value), value, None).tolist()
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (np.bool_, np.integer)):
        return value.item()
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return str(value) if isinstance(value, Path) else value


def write_result(path: Path, result: dict) -> None:
    """Write one trial's result, of plain values, whole."""
    write_whole(path, json.dumps(result, sort_keys=True, allow_nan=False) + "\n")


def read_result(path: Path) -> dict | None:
    """Read a result; return None where there is none that can be read."""
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None
