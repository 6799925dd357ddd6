"""The one way in which the bench says that its input is bad."""


class BadInput(Exception):
    """One clear line: file, row or frame, what was found, what is allowed. Ends with exit code 2."""
