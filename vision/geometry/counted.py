"""Numbers of things in words."""


def counted(count: int, noun: str) -> str:
    """As `1 frame` or `2 frames`."""
    return f"{count} {noun}" + ("" if count == 1 else "s")
