"""Hashes: what counts is what a result depends on, and results come back as they went."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.base.results import hash_of, hash_of_files, number, plain, read_result, write_result


@dataclass(frozen=True)
class Thing:
    path: Path
    values: np.ndarray


def test_a_moved_session_is_the_same_session():
    values = np.arange(3.0)
    assert hash_of(Thing(Path("/here/trial"), values)) == hash_of(Thing(Path("/there/trial"), values))
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


def test_results_come_back_as_they_went(tmp_path):
    value = 0.1 + 0.2
    write_result(tmp_path / "r.json", {"x": np.float64(value), "n": np.int64(3), "none": math.nan, "a": np.eye(2)})
    assert read_result(tmp_path / "r.json") == {"x": value, "n": 3, "none": None, "a": [[1.0, 0.0], [0.0, 1.0]]}
    assert math.isnan(number(None)) and number(3) == 3.0


def test_half_a_result_is_none(tmp_path):
    (tmp_path / "r.json").write_text('{"x": 1.')
    assert read_result(tmp_path / "r.json") is None
    assert read_result(tmp_path / "absent.json") is None


def test_plain_takes_nested_dataclasses():
    assert plain({"thing": Thing(Path("a"), np.array([True, False]))}) == {
        "thing": {"path": "a", "values": [True, False]}
    }
