"""A tiny session, made once for all tests of the rig; read only."""

import pytest

from bench.rig.simulation import simulate
from tests.scenes.rig_sessions import TINY, protocol_file


@pytest.fixture(scope="session")
def tiny(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tiny")
    return simulate(folder / "session", protocol=protocol_file(folder, TINY), seed=5)
