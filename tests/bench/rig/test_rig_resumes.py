"""The same bytes for any workers, after a stop and after a kill; nothing of others is touched."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from bench.base.errors import BadInput
from bench.base.progress import show_progress
from bench.rig.simulation import simulate
from tests.scenes.rig_sessions import TINY, contents, protocol_file


def test_same_seed_same_bytes_for_any_workers(tiny, tmp_path):
    twin = simulate(tmp_path / "twin", protocol=protocol_file(tmp_path, TINY), seed=5, workers=2)
    assert contents(twin) == contents(tiny)


def test_another_seed_is_another_session(tiny, tmp_path):
    other = simulate(
        tmp_path / "other", protocol=protocol_file(tmp_path, TINY), seed=6, signals_only=True
    )
    ours, theirs = contents(tiny), contents(other)
    assert all(
        ours[name] != data
        for name, data in theirs.items()
        if name.endswith(("signals.csv", "truth.toml"))
    )


def test_signals_only_differs_by_the_pictures_alone(tiny, tmp_path):
    bare = contents(
        simulate(
            tmp_path / "bare", protocol=protocol_file(tmp_path, TINY), seed=5, signals_only=True
        )
    )
    assert bare == {k: v for k, v in contents(tiny).items() if not k.endswith((".jpg", ".png"))}


def test_goes_on_where_it_stopped(tiny, tmp_path):
    path = protocol_file(tmp_path, TINY)
    session = simulate(tmp_path / "s", protocol=path, seed=5, signals_only=True)
    whole = contents(session)
    removed = session / "trials" / "steel_b20_v10"
    for file in removed.iterdir():
        file.unlink()
    removed.rename(removed.with_name(".steel_b20_v10.unfinished"))
    untouched = session / "trials" / "steel_b50_v10" / "signals.csv"
    before = untouched.stat().st_mtime_ns
    simulate(session, protocol=path, seed=5, signals_only=True)
    assert contents(session) == whole and untouched.stat().st_mtime_ns == before


def test_a_folder_of_something_else_is_left_alone(tiny, tmp_path):
    path = protocol_file(tmp_path, TINY)
    with pytest.raises(BadInput, match="another protocol or seed"):
        simulate(tiny, protocol=path, seed=8)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("keep")
    with pytest.raises(BadInput, match="not empty"):
        simulate(tmp_path / "mine", protocol=path, seed=5)
    assert contents(tmp_path / "mine") == {"notes.txt": b"keep"}


_RUN = """
import sys
from bench.rig.simulation import simulate
if __name__ == "__main__":
    simulate(sys.argv[1], protocol=sys.argv[2], seed=5, workers=2)
"""


@pytest.mark.slow
def test_goes_on_after_a_kill(tiny, tmp_path):
    """Killed in the middle of its parts; what was whole stays untouched, the rest is made, and all is as ever."""
    script, session = tmp_path / "run.py", tmp_path / "session"
    script.write_text(_RUN)
    path = protocol_file(tmp_path, TINY)
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).resolve().parents[3])}
    run = subprocess.Popen([sys.executable, script, session, path], env=environment)
    deadline = time.time() + 60
    while time.time() < deadline and not whole_parts(session) and run.poll() is None:
        time.sleep(0.01)
    run.kill()
    run.wait(20)
    kept = whole_parts(session)
    assert kept
    times = {p: p.stat().st_mtime_ns for p in kept}
    time.sleep(1.5)  # its workers see that it is gone
    simulate(session, protocol=path, seed=5)
    assert contents(session) == contents(tiny)
    assert {p: p.stat().st_mtime_ns for p in kept} == times


def whole_parts(session):
    folders = [*session.glob("boards/*"), *session.glob("trials/*")]
    return [p for p in folders if not p.name.startswith(".")]


def test_size_and_time_are_said_before_and_progress_after(tmp_path, caplog):
    show_progress()
    said, path = [], protocol_file(tmp_path, TINY)
    session = simulate(tmp_path / "s", protocol=path, signals_only=True, announce=said.append)
    (line,) = said
    assert "4 trials, 6 whisks, 0 pictures" in line and "MB" in line and "minutes" in line
    assert "parts: 4 ..." in caplog.messages
    assert any(line.startswith("parts: 4 of 4, ") for line in caplog.messages)
    size = (
        sum(len(data) for name, data in contents(session).items() if name.endswith("signals.csv"))
        / 1e6
    )
    assert float(line.split("about ")[1].split(" MB")[0]) == pytest.approx(size, abs=0.6)
