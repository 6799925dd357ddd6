"""A task whose process dies: by name, so that other processes find it."""

import os
import signal
from pathlib import Path


def dies(task: tuple[Path, int]) -> str:
    """Its process is killed so often; a file counts, a letter each time."""
    begun, deaths = task
    with begun.open("a") as file:
        file.write("x")
    if len(begun.read_text()) <= deaths:
        os.kill(os.getpid(), signal.SIGKILL)
    return begun.name
