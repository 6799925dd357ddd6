"""Whole files or none, and one run at a time."""

import os
import subprocess
import sys

import pytest

from bench.base.atomic import lock_output, whole_file, write_whole
from bench.base.errors import BadInput
from tests.faults.interrupted import full_disk


def test_a_file_is_written_with_its_folders(tmp_path):
    write_whole(tmp_path / "a" / "b" / "c.txt", "α\n")
    assert (tmp_path / "a" / "b" / "c.txt").read_text() == "α\n"
    assert [path.name for path in (tmp_path / "a" / "b").iterdir()] == ["c.txt"]


def test_the_old_file_stays_where_writing_fails(tmp_path):
    path = tmp_path / "table.csv"
    write_whole(path, "old")
    with pytest.raises(KeyboardInterrupt), whole_file(path) as temporary:
        temporary.write_text("half of the ne")
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["table.csv"]


def test_a_full_disk_leaves_the_old_file_and_names_it(tmp_path):
    path = tmp_path / "table.csv"
    write_whole(path, "old")
    with full_disk(0), pytest.raises(OSError, match=str(path)):
        write_whole(path, "new")
    assert path.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["table.csv"]


def test_writers_that_go_by_the_suffix_find_it(tmp_path):
    with whole_file(tmp_path / "figure.png") as temporary:
        assert temporary.suffix == ".png"
        temporary.write_bytes(b"PNG")
    assert (tmp_path / "figure.png").read_bytes() == b"PNG"


def test_others_may_read_what_was_written(tmp_path):
    old = os.umask(0o022)
    try:
        write_whole(tmp_path / "table.csv", "x")
    finally:
        os.umask(old)
    assert (tmp_path / "table.csv").stat().st_mode & 0o777 == 0o644


OTHER_RUN = """
import sys
from pathlib import Path
from bench.base.atomic import lock_output
with lock_output(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_second_run_on_one_output_stops(tmp_path):
    command = [sys.executable, "-c", OTHER_RUN, str(tmp_path)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout.readline() == "held\n"
        with (
            pytest.raises(BadInput, match=rf"another run \(process {other.pid}\)"),
            lock_output(tmp_path),
        ):
            pass
        other.kill()
        other.wait()
        with lock_output(tmp_path):  # a killed run holds nothing
            pass


def test_what_a_killed_run_was_writing_is_swept_by_the_next(tmp_path):
    (tmp_path / "planes").mkdir()
    with pytest.raises(ZeroDivisionError), whole_file(tmp_path / "planes" / "a.png") as temporary:
        left = temporary.read_bytes(), temporary.name
        raise ZeroDivisionError
    (tmp_path / "planes" / left[1]).write_bytes(left[0])  # as SIGKILL leaves it
    with lock_output(tmp_path):
        assert list((tmp_path / "planes").iterdir()) == []
