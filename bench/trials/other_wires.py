"""Files that say where a whisker's wire is in the pictures of a trial, for those who look for another."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from bench.base.results import read_result, write_result
from bench.records.plain import from_plain, to_plain
from vision.pictures.others import Others, RodLines


def write_lines(path: Path, key: str, lines: Mapping[str, RodLines]) -> None:
    """The file of a wire's lines, by camera; key: hash of what they were made from."""
    write_result(path, {"hash": key, "cameras": to_plain(lines)})


def has_lines(path: Path, key: str) -> bool:
    """Whether the file stands there, made from the same."""
    kept = read_result(path)
    return bool(kept) and kept.get("hash") == key


def lines_in(files: Iterable[tuple[str, Path]]) -> dict[str, Others]:
    """By camera the wires of whiskers, (name, file) each; of those that have a file."""
    found: dict[str, dict[str, RodLines]] = {}
    for whisker, path in files:
        for camera, lines in (read_result(path) or {"cameras": {}})["cameras"].items():
            found.setdefault(camera, {})[whisker] = from_plain(RodLines, lines)
    return found
