"""The one way in which the bench says that its input is bad."""

from pathlib import PurePath


class BadInput(Exception):
    """One clear line: file, row or frame, what was found, what is allowed. Ends with exit code 2.

    `file`, `row` (as an editor counts, the header being row 1) and `column` are kept apart as well, so that
    `check` can list many.
    """

    def __init__(
        self,
        reason: str,
        *,
        file: str | PurePath | None = None,
        row: int | None = None,
        column=None,
    ):
        self.reason, self.file, self.row, self.column = reason, file, row, column
        place = ", ".join(_places(file, row, column))
        super().__init__(" ".join(f"{place}: {reason}".split()) if place else reason)


def _places(file, row, column):
    if file is not None:
        yield str(file)
    if row is not None:
        yield f"row {row}"
    if column is not None:
        yield f"column {column}"
