"""Hashes of contents, kept from run to run."""

import os
import time

import pytest

from bench.base import digests
from bench.base.digests import Digests
from bench.base.results import content_hash

LONG_AGO_S = 60.0


@pytest.fixture
def read(monkeypatch):
    """Files whose contents were read."""
    found = []
    monkeypatch.setattr(
        digests, "content_hash", lambda file: found.append(file.name) or content_hash(file)
    )
    return found


def looked_later(monkeypatch):
    """From here on files were changed long ago."""
    later = time.time_ns() + int(1e9 * LONG_AGO_S)
    monkeypatch.setattr(digests.time, "time_ns", lambda: later)


def digest_of(file, out):
    one = Digests(out)
    digest = one.of(file)
    one.keep()
    return digest


def test_a_file_that_is_as_it_was_is_read_once(tmp_path, monkeypatch, read):
    file = tmp_path / "0.png"
    file.write_bytes(b"a")
    looked_later(monkeypatch)
    assert (
        digest_of(file, tmp_path / "out") == digest_of(file, tmp_path / "out") == content_hash(file)
    )
    assert read == ["0.png"]


def test_a_file_that_was_changed_is_read_again_even_if_its_size_and_time_are_the_same(
    tmp_path, monkeypatch, read
):
    file = tmp_path / "0.png"
    file.write_bytes(b"a")
    then = file.stat()
    looked_later(monkeypatch)
    before = digest_of(file, tmp_path / "out")
    time.sleep(0.02)  # more than a tick of the file system's clock
    file.write_bytes(b"b")
    os.utime(file, ns=(then.st_atime_ns, then.st_mtime_ns))
    assert digest_of(file, tmp_path / "out") == content_hash(file) != before


def test_a_file_that_was_changed_just_now_is_read_again(tmp_path, read):
    file = tmp_path / "0.png"
    file.write_bytes(b"a")
    for _ in range(2):
        digest_of(file, tmp_path / "out")
    assert read == ["0.png"] * 2


def test_a_damaged_file_of_hashes_is_none(tmp_path, monkeypatch, read):
    file = tmp_path / "0.png"
    file.write_bytes(b"a")
    looked_later(monkeypatch)
    digest_of(file, tmp_path / "out")
    (tmp_path / "out" / digests.KEPT).write_text("[1, 2")
    assert digest_of(file, tmp_path / "out") == content_hash(file)
