"""MATLAB's files of version 4 to 7, read by SciPy: damaged ones are refused before it loses its place in them.

SciPy takes the types and sizes within a variable for granted, and dies of one that is another. So the elements of
each variable that is not compressed are followed first; one that is compressed has a checksum.
"""

import math
import struct
import zlib
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
# [bytes] Up to so many stand in the tag itself. A layout.
_IN_TAG = 4
# [—] Type of an element that is a variable. A layout.
_MATRIX = 14
# [—] Type of one that is compressed. A layout.
_COMPRESSED = 15
# [—] Type of a variable's class and flags. A layout.
_FLAGS = 6
# [—] Type of dimensions. A layout.
_INTEGERS = 5
# [—] Types of names. A layout.
_NAMES = (1, 16)
# [bytes] Of a number, or a letter, by the type of its element. A layout.
_SIZES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
# [—] Class of a variable of variables. A layout.
_CELL = 1
# [—] Classes of structures. A layout.
_STRUCTURES = (2, 3)
# [—] Class of one that has a class's name. A layout.
_OBJECT = 3
# [—] Class of letters. A layout.
_TEXT = 4
# [—] Class of a matrix by its entries. A layout.
_SPARSE = 5
# [—] Classes of numbers. A layout.
_NUMBERS = range(6, 16)
# [—] Class of a function. A layout.
_FUNCTION = 16
# [—] Class of what only MATLAB knows. A layout.
_OPAQUE = 17
# [—] Flag of an imaginary part. A layout.
_COMPLEX = 0x0800
# [levels] Of variables within each other. Stated.
_MOST_LEVELS = 50
# Errors of SciPy's reader on a damaged file.
_NOT_MATLAB = (
    MatReadError,
    zlib.error,
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
    try:
        if order:
            _Elements(content, order, _HEADER, len(content)).follow_variables()
        return loadmat(path, simplify_cells=True, appendmat=False)
    except _NOT_MATLAB as problem:
        words = " ".join(str(problem).split())
        raise Refused(f"cannot be read as a MATLAB file ({words})") from None


class _Damaged(ValueError):
    """Parts of a file that do not add up."""

    def __init__(self):
        """Say so."""
        super().__init__("its parts do not add up: it is damaged")


class _Elements:
    """The elements of a file of version 5 between two places, one after the other.

    order: "<" or ">", of its bytes. levels: that may be within one.
    """

    def __init__(
        self, content: bytes, order: str, start: int, stop: int, levels: int = _MOST_LEVELS
    ):
        """Begin at the first."""
        self.content = content
        self.order = order
        self.at = start
        self.stop = stop
        self.levels = levels

    def follow_variables(self) -> None:
        """Follow all variables to the end. Raise _Damaged where they do not end there."""
        while self.at < self.stop:
            kind, size, start = self._tag()
            if kind == _MATRIX and size:
                self._within(start, start + size).follow_matrix()
            elif kind not in (_MATRIX, _COMPRESSED):
                raise _Damaged
            self.at = start + size

    def follow_matrix(self) -> None:
        """Follow the elements of one variable."""
        kind, start, size = self._next()
        if kind != _FLAGS or size != 8:
            raise _Damaged
        (flags,) = struct.unpack_from(f"{self.order}I", self.content, start)
        of_class = flags & 0xFF
        if of_class == _OPAQUE:
            self._follow_opaque()
            return
        count = math.prod(self._integers(least=2))
        self._name()
        parts = 2 if flags & _COMPLEX else 1
        if of_class in _NUMBERS:
            self._follow_numbers(count, parts)
        elif of_class == _TEXT:
            self._numbers()
        elif of_class == _CELL:
            self._follow_matrices(count)
        elif of_class in _STRUCTURES:
            self._follow_fields(count, of_class)
        elif of_class == _FUNCTION:
            self._follow_matrices(1)
        elif of_class == _SPARSE:
            for _ in range(2 + parts):
                self._numbers()
        else:
            raise _Damaged

    def _follow_opaque(self) -> None:
        """Follow an object that only MATLAB knows."""
        for _ in range(3):
            self._name()
        self._follow_matrices(1)

    def _follow_numbers(self, count: int, parts: int) -> None:
        """Follow so many numbers, with an imaginary part where parts is 2."""
        for _ in range(parts):
            if self._numbers() != count:
                raise _Damaged

    def _follow_fields(self, count: int, of_class: int) -> None:
        """Follow so many structures."""
        if of_class == _OBJECT:
            self._name()
        (length,) = self._integers(least=1)
        names = self._name()
        if length < 1 or names % length:
            raise _Damaged
        self._follow_matrices(count * (names // length))

    def _follow_matrices(self, count: int) -> None:
        """Follow so many variables within this one."""
        if count > (self.stop - self.at) // _TAG or not self.levels:
            raise _Damaged
        for _ in range(count):
            kind, start, size = self._next()
            if kind != _MATRIX:
                raise _Damaged
            if size:
                self._within(start, start + size).follow_matrix()

    def _within(self, start: int, stop: int) -> "_Elements":
        """Return the elements of a variable, one level deeper."""
        return _Elements(self.content, self.order, start, stop, self.levels - 1)

    def _integers(self, *, least: int) -> tuple[int, ...]:
        """Return the whole numbers of the next element, so many at least, none below 0."""
        kind, start, size = self._next()
        if kind != _INTEGERS or size % 4 or size < 4 * least:
            raise _Damaged
        found = struct.unpack_from(f"{self.order}{size // 4}i", self.content, start)
        if min(found) < 0:
            raise _Damaged
        return found

    def _name(self) -> int:
        """Return how many letters the next element has, which is a name."""
        kind, _, size = self._next()
        if kind not in _NAMES:
            raise _Damaged
        return size

    def _numbers(self) -> int:
        """Return how many numbers or letters the next element has."""
        kind, _, size = self._next()
        if kind not in _SIZES or size % _SIZES[kind]:
            raise _Damaged
        return size // _SIZES[kind]

    def _next(self) -> tuple[int, int, int]:
        """Return type, first byte and size of the next element, and go behind it."""
        kind, size, start = self._tag()
        is_in_tag = start < self.at + _TAG
        self.at = start + (_IN_TAG if is_in_tag else size + -size % _TAG)
        if self.at > self.stop:
            raise _Damaged
        return kind, start, size

    def _tag(self) -> tuple[int, int, int]:
        """Return type, size and first byte of the element that is next."""
        if self.at + _TAG > self.stop:
            raise _Damaged
        kind, size = struct.unpack_from(f"{self.order}2I", self.content, self.at)
        start = self.at + _TAG
        if kind >> 16:
            kind, size = kind & 0xFFFF, kind >> 16
            start = self.at + _IN_TAG
            if size > _IN_TAG:
                raise _Damaged
        if start + size > self.stop:
            raise _Damaged
        return kind, size, start
