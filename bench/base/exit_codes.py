"""Exit codes of the command line, and how a job that writes a file ends."""

from collections.abc import Iterable, Sequence

DONE = 0  # without a warning
WITH_WARNINGS = 1  # done all the same
BAD_INPUT = 2  # or wrong usage, as argparse has it
INTERRUPTED = 130  # 128 + SIGINT, as shells have it
FAULT_OF_OURS = 70  # EX_SOFTWARE: neither a result nor the user's input


def print_written(lines: Iterable[str], warnings: Sequence[str], written: str) -> int:
    """Print what was found, the warnings, and which files were written; return the exit code."""
    marked = [f"warning: {warning}" for warning in warnings]
    print(*lines, *marked, f"written{written}", sep="\n")
    return WITH_WARNINGS if warnings else DONE
