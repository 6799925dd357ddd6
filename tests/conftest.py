"""Fixtures common to all tests: the recorded-like sessions and the real recordings, where they are there."""

import os
import shutil
from pathlib import Path

from bench.base.workers import single_thread

single_thread()  # as every verb does, before NumPy is imported

import numpy as np  # noqa: E402
import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402

from fixtures.say_exact import exact_copy  # noqa: E402

# The same examples on every machine, however busy it is.
settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")

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
def steel_sample(shared, tmp_path_factory) -> Path:
    """The recorded-like session of a Nitinol whisker on a steel bar, whose givens are exact."""
    out = tmp_path_factory.mktemp("shared") / "steel-sample"
    return exact_copy(shared / "sessions" / "steel-sample", out)


@pytest.fixture(scope="session")
def real(shared) -> Path:
    """Real public video; skipped where it is absent."""
    folder = shared / "real"
    if not folder.is_dir():
        pytest.skip("no real recordings beside this checkout")
    return folder


@pytest.fixture(scope="session")
def small_session() -> Path:
    """The session that the demo evaluates; read only."""
    return REPOSITORY / "fixtures" / "small-session"


@pytest.fixture(scope="session")
def steel_signals() -> Path:
    """All trials of the recording that the small session is cut from, without pictures; read only."""
    return REPOSITORY / "fixtures" / "steel-signals"


@pytest.fixture
def small_copy(small_session, tmp_path) -> Path:
    """A small session to spoil."""
    return Path(shutil.copytree(small_session, tmp_path / "session", copy_function=shutil.copyfile))


@pytest.fixture
def as_video():
    """A function (folder, suffix, fourcc, rate_Hz) that puts a video in place of a folder of pictures."""
    return _as_video


def _as_video(folder: Path, suffix: str, fourcc: str, rate_Hz: float = 20.0):
    import cv2

    pictures = [cv2.imread(str(file), cv2.IMREAD_GRAYSCALE) for file in sorted(folder.iterdir())]
    video, size = folder.with_suffix(suffix), pictures[0].shape[::-1]
    writer = cv2.VideoWriter(str(video), cv2.VideoWriter_fourcc(*fourcc), rate_Hz, size, False)
    for picture in pictures:
        writer.write(picture)
    writer.release()
    shutil.rmtree(folder)
    return video, pictures


@pytest.fixture
def rng() -> np.random.Generator:
    """A generator with a fixed seed, so that a failure can be seen again."""
    return np.random.default_rng(20080923)
