"""A copy of the small session for each test to spoil."""

import shutil
from pathlib import Path

import pytest

SMALL_SESSION = Path(__file__).resolve().parents[2] / "fixtures" / "small-session"


@pytest.fixture
def session(tmp_path) -> Path:
    """The small session: text files are copies, pictures are links to the originals (replace, never write)."""
    return Path(shutil.copytree(SMALL_SESSION, tmp_path / "session", copy_function=_copy_or_link))


def _copy_or_link(source: str, target: str) -> str:
    if Path(source).suffix in {".jpg", ".png"}:
        Path(target).symlink_to(source)
        return target
    return shutil.copyfile(source, target)
