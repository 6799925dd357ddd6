"""Text files that people bring: no larger than expected, and UTF-8."""

from pathlib import Path

from bench.base.errors import BadInput


def check_size(path: Path, most_bytes: int, advice: str, label: str) -> None:
    """Raise BadInput, naming the file as `label`, where it is larger than most_bytes."""
    if path.stat().st_size > most_bytes:
        raise BadInput(f"has more than {most_bytes >> 20} MB; {advice}", file=label)


def decode(content: bytes, advice: str, label: str) -> str:
    """Return bytes as text, without a byte-order mark. Raise BadInput where they are not UTF-8."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise BadInput(f"is not UTF-8 text; {advice}", file=label) from None


def read_text(path: Path, advice: str, label: str) -> str:
    """Return a file's text. Raise BadInput where it cannot be read, or is not UTF-8."""
    try:
        content = path.read_bytes()
    except OSError as problem:
        raise BadInput(f"cannot be read ({problem.strerror})", file=label) from None
    return decode(content, advice, label)
