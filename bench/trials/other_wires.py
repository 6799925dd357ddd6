"""Files with the place of a whisker's wire in the pictures of a trial, for the other whiskers."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from bench.base.results import read_result, write_result
from bench.records.plain import from_plain, to_plain
from vision.pictures import Others, RodLines


def write_lines(path: Path, key: str, lines: Mapping[str, RodLines]) -> None:
    """Write a wire's lines by camera to a file; key: hash of their inputs."""
    write_result(path, {"hash": key, "cameras": to_plain(lines)})


def has_lines(path: Path, key: str) -> bool:
    """Return whether the file is there and has the same inputs."""
    kept = read_result(path)
    return bool(kept) and kept.get("hash") == key


def lines_in(files: Iterable[tuple[str, Path]]) -> dict[str, Others]:
    """Return the wires of whiskers by camera and name, from pairs (name, file); missing files are
    left out.
    """
    found: dict[str, dict[str, RodLines]] = {}
    for whisker, path in files:
        kept = read_result(path)
        if kept is None:
            continue
        for camera, lines in kept["cameras"].items():
            found.setdefault(camera, {})[whisker] = from_plain(RodLines, lines)
    return found
