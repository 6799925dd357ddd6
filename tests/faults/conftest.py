"""Each test of faults spoils a session of its own."""

from pathlib import Path

import pytest


@pytest.fixture
def session(small_copy) -> Path:
    """A sound session, to be spoilt."""
    return small_copy
