"""MATLAB's files of version 4 to 7, read by SciPy: damaged ones are refused before it loses its place in them."""

import struct
from pathlib import Path
from typing import Any

from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from vision.geometry.refusals import Refused

# [bytes] Of a file of version 5: its header, at whose end version and order of bytes stand. A layout.
_HEADER = 128
_ORDERS = {b"\0\1IM": "<", b"\1\0MI": ">"}
# [bytes] Before each element: its type and its size. A layout.
_TAG = 8
# [—] Types of the elements that hold a variable: as it is, or compressed. A layout.
_VARIABLES = (14, 15)
# Errors of SciPy's reader on a damaged file.
_NOT_MATLAB = (
    MatReadError,
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    OSError,
    EOFError,
    OverflowError,
    MemoryError,
)


def load_matlab(path: Path) -> dict[str, Any]:
    """Return the variables of a file by name, structures as dictionaries.

    Raises Refused where it is damaged or none, NotImplementedError where it is of version 7.3, which is HDF5.
    """
    content = path.read_bytes()
    order = _ORDERS.get(content[_HEADER - 4 : _HEADER])
    if order and not _is_whole(content, order):
        raise Refused("cannot be read as a MATLAB file (its parts do not add up: it is damaged)")
    try:
        return loadmat(path, simplify_cells=True, appendmat=False)
    except _NOT_MATLAB as problem:
        words = " ".join(str(problem).split())
        raise Refused(f"cannot be read as a MATLAB file ({words})") from None


def _is_whole(content: bytes, order: str) -> bool:
    """Return whether the variables of a file of version 5 follow each other up to its end."""
    at = _HEADER
    while at < len(content):
        if at + _TAG > len(content):
            return False
        kind, size = struct.unpack_from(f"{order}2I", content, at)
        if kind not in _VARIABLES:
            return False
        at += _TAG + size
    return at == len(content)
