"""What a session is refused for."""

from pathlib import Path

import pytest

from bench.base.errors import BadInput
from bench.session.session_check import checked_session


def refusal(session: Path) -> str:
    """The one line that the manifests or recordings of a session are refused with."""
    with pytest.raises(BadInput) as bad:
        checked_session(session)
    line = str(bad.value)
    assert "\n" not in line
    return line
