"""Hashes: what counts is what a result depends on, and results come back as they went."""

import ast
import math
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from bench.base.results import (
    DRAWING,
    ESTIMATING,
    SEEING,
    hash_of,
    hash_of_code,
    hash_of_files,
    plain,
    read_result,
    write_result,
)

ROOT = Path(__file__).resolve().parents[3]


@dataclass(frozen=True)
class Thing:
    path: Path
    values: np.ndarray


def test_a_moved_session_is_the_same_session():
    values = np.arange(3.0)
    assert hash_of(Thing(Path("/here/trial"), values)) == hash_of(
        Thing(Path("/there/trial"), values)
    )
    assert hash_of(Thing(Path("trial"), values)) != hash_of(Thing(Path("other"), values))


def test_every_digit_counts():
    assert hash_of(1.0) != hash_of(np.nextafter(1.0, 2.0))
    picture = np.zeros((50, 50), dtype=np.uint8)
    other = picture.copy()
    other[49, 49] = 1
    assert hash_of(picture) != hash_of(other)
    assert hash_of(picture) != hash_of(picture.astype(np.uint16))


def test_truth_files_do_not_count(tmp_path):
    (tmp_path / "signals.csv").write_text("a")
    before = hash_of_files([tmp_path])
    (tmp_path / "truth.csv").write_text("b")
    (tmp_path / "truth.toml").write_text("c")
    assert hash_of_files([tmp_path]) == before
    (tmp_path / "signals.csv").write_text("b")
    assert hash_of_files([tmp_path]) != before


def test_pictures_in_a_linked_folder_count(tmp_path):
    (tmp_path / "disk").mkdir()
    (tmp_path / "trial").mkdir()
    (tmp_path / "trial" / "low").symlink_to(tmp_path / "disk")
    found = set()
    for data in ("", "a", "b"):
        (tmp_path / "disk" / "0.png").write_text(data)
        found.add(hash_of_files([tmp_path / "trial"]))
    assert len(found) == 3


def test_results_come_back_as_they_went(tmp_path):
    value = 0.1 + 0.2
    result = {"x": np.float64(value), "n": np.int64(3), "none": math.nan, "a": np.eye(2)}
    write_result(tmp_path / "r.json", plain(result))
    assert read_result(tmp_path / "r.json") == {
        "x": value,
        "n": 3,
        "none": None,
        "a": [[1.0, 0.0], [0.0, 1.0]],
    }


def test_half_a_result_is_none(tmp_path):
    (tmp_path / "r.json").write_text('{"x": 1.')
    assert read_result(tmp_path / "r.json") is None
    assert read_result(tmp_path / "absent.json") is None


def test_plain_takes_nested_dataclasses():
    assert plain({"thing": Thing(Path("a"), np.array([True, False]))}) == {
        "thing": {"path": "a", "values": [True, False]}
    }


FOLDERS = sorted(
    path.name for path in (ROOT / "vision").iterdir() if (path / "__init__.py").is_file()
)


@pytest.mark.parametrize("folder", FOLDERS)
def test_a_changed_line_in_any_folder_of_vision_looks_at_the_pictures_again(folder, tmp_path):
    for package in ("vision", "bench", "estimator"):
        shutil.copytree(
            ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__")
        )
    seeing, estimating = (hash_of_code(places, tmp_path) for places in (SEEING, ESTIMATING))
    with (tmp_path / "vision" / folder / "__init__.py").open("a") as file:
        file.write("# a line more\n")
    hash_of_code.cache_clear()
    assert hash_of_code(SEEING, tmp_path) != seeing
    assert hash_of_code(ESTIMATING, tmp_path) != estimating


def test_a_changed_figure_or_estimator_looks_at_no_picture_again(tmp_path):
    for package in ("vision", "bench", "estimator"):
        shutil.copytree(
            ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__")
        )
    before = [hash_of_code(places, tmp_path) for places in (SEEING, ESTIMATING, DRAWING)]
    for changed in ("bench/base/drawing.py", "estimator/slip.py"):
        with (tmp_path / changed).open("a") as file:
            file.write("# a line more\n")
    hash_of_code.cache_clear()
    after = [hash_of_code(places, tmp_path) for places in (SEEING, ESTIMATING, DRAWING)]
    assert [a == b for a, b in zip(before, after)] == [True, False, False]


def _imported(path: Path) -> set[Path]:
    """Our modules that a module imports."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            names |= {node.module, *(f"{node.module}.{one.name}" for one in node.names)}
    return {file for name in names if (file := ROOT / f"{name.replace('.', '/')}.py").is_file()}


def test_all_code_that_what_is_seen_rests_on_is_in_its_hash():
    """What vision's records pass through; what results are written by does not change them, nor does an estimator."""
    reached, new = set(), {ROOT / "bench/trials/seen.py"}
    while new:
        reached |= new
        new = {found for path in new for found in _imported(path)} - reached
    apart = [ROOT / place for place in ("bench/base", "estimator")]
    covered = [ROOT / place for place in SEEING]
    missing = [
        path
        for path in reached
        if not any(path.is_relative_to(place) for place in (*covered, *apart))
    ]
    assert len(reached) > 50 and missing == []


def test_a_place_without_sources_is_told(tmp_path):
    with pytest.raises(FileNotFoundError, match="vision"):
        hash_of_code(("vision",), tmp_path)
