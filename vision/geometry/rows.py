"""A table of arrays: a dataclass whose fields have one row each for every thing that it describes."""

from collections.abc import Sequence
from dataclasses import fields
from typing import Self

import numpy as np


class Rows:
    """A dataclass of arrays (n, …), a row each of n things."""

    def select(self, which: np.ndarray | slice) -> Self:
        """Return the rows of a mask, of indices or of a slice, in their order."""
        return type(self)(*(getattr(self, field.name)[which] for field in fields(self)))

    @classmethod
    def join(cls, tables: Sequence[Self]) -> Self:
        """Return the rows of several tables as one."""
        columns = []
        for field in fields(cls):
            columns.append(np.concatenate([getattr(table, field.name) for table in tables]))
        return cls(*columns)
