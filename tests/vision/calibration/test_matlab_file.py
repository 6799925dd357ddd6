"""MATLAB's files: every kind of variable is read, and a damaged byte is refused before SciPy dies of it."""

import struct

import numpy as np
import pytest
import scipy.io
import scipy.sparse

from vision.calibration.matlab_file import load_matlab
from vision.geometry.refusals import Refused

CONTENT = {
    "complex": np.arange(6.0).reshape(2, 3) + 1j,
    "text": "hello",
    "cells": np.array([1, "x", np.eye(2)], dtype=object),
    "bytes": np.arange(5, dtype=np.uint8),
    "empty": np.zeros((0, 3)),
    "nested": {"q": {"r": [1, 2]}},
    "sparse": scipy.sparse.csc_array(np.eye(3)),
}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "trace.tr4"


@pytest.mark.parametrize("is_compressed", [False, True])
def test_every_kind_of_variable_is_read(path, is_compressed):
    scipy.io.savemat(path, CONTENT, appendmat=False, do_compression=is_compressed)
    read = load_matlab(path)
    assert read["text"] == "hello" and read["nested"]["q"]["r"].tolist() == [1, 2]
    np.testing.assert_array_equal(read["complex"], CONTENT["complex"])
    np.testing.assert_array_equal(read["sparse"].toarray(), np.eye(3))
    assert read["empty"].size == 0 and read["cells"][1] == "x"


@pytest.mark.parametrize("is_compressed", [False, True])
def test_damaged_bytes_are_refused_or_change_a_value(path, is_compressed):
    """Without the check 9 of 2000 such files ended the process."""
    scipy.io.savemat(path, CONTENT, appendmat=False, do_compression=is_compressed)
    sound = path.read_bytes()
    rng = np.random.default_rng(5)
    refused = 0
    for at in rng.integers(128, len(sound), 150).tolist():
        damaged = bytearray(sound)
        damaged[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        try:
            load_matlab(path)
        except Refused as refusal:
            assert str(refusal).startswith("cannot be read as a MATLAB file (")
            refused += 1
    assert refused > 40


def test_a_type_that_there_is_not_is_refused(path):
    scipy.io.savemat(path, {"a": np.arange(4.0)}, appendmat=False)
    damaged = bytearray(path.read_bytes())
    first = damaged.index(struct.pack("<2I", 9, 32))  # the tag of four doubles
    damaged[first] = 200
    path.write_bytes(damaged)
    with pytest.raises(Refused, match="do not add up: it is damaged"):
        load_matlab(path)
