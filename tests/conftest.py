"""Fixtures common to all tests: the recorded-like sessions and the real recordings, where they are there."""

import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent


def _shared_folder() -> Path | None:
    candidates = [os.environ.get("WHISKER_BENCH_SHARED"), REPOSITORY.parent / "shared"]
    return next((Path(c) for c in candidates if c and (Path(c) / "sessions").is_dir()), None)


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder with `sessions/`, `real/` and `paper/`; tests that need it are skipped where it is absent."""
    folder = _shared_folder()
    if folder is None:
        pytest.skip("no shared recordings beside this checkout (set WHISKER_BENCH_SHARED)")
    return folder


@pytest.fixture(scope="session")
def steel_sample(shared) -> Path:
    """The recorded-like session of a Nitinol whisker on a steel bar."""
    return shared / "sessions" / "steel-sample"


@pytest.fixture(scope="session")
def real(shared) -> Path:
    """Real public video; skipped where it is absent."""
    folder = shared / "real"
    if not folder.is_dir():
        pytest.skip("no real recordings beside this checkout")
    return folder
