"""Numbers of things in words."""


def counted(count: int, noun: str) -> str:
    """Return a count with its noun, such as `1 frame` or `2 frames`."""
    plural = "" if count == 1 else "s"
    return f"{count} {noun}{plural}"
