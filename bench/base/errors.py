"""The one way in which the bench says that its input is bad."""

from pathlib import PurePath


class BadInput(Exception):
    """An error of the input, in one line: file, row or frame, what was found, what is allowed.

    The run ends with exit code 2. `file`, `row` (as an editor counts, the header being row 1) and
    `column` are attributes as well, so that `check` can list many.
    """

    def __init__(
        self,
        reason: str,
        *,
        file: str | PurePath | None = None,
        row: int | None = None,
        column: str | None = None,
    ):
        """Make the line from its reason and its place."""
        self.reason = reason
        self.file = file
        self.row = row
        self.column = column
        labels = {"": file, "row ": row, "column ": column}
        places = [f"{label}{value}" for label, value in labels.items() if value is not None]
        line = " ".join(f"{', '.join(places)}: {reason}".split()) if places else reason
        super().__init__(line)
