"""Processes: results in the tasks' order, one thread each, errors as they are, nobody left behind."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from bench.base.errors import BadInput
from bench.base.workers import Workers
from tests.scenes.deaths import dies

REPOSITORY = Path(__file__).resolve().parents[3]


def test_order_is_that_of_the_tasks():
    with Workers(2) as pool:
        assert pool.run(abs, [-3, -2, -1], "numbers") == [3, 2, 1]
        assert pool.run(abs, [], "nothing") == []


def test_no_workers_run_here():
    with Workers(0) as pool:
        assert pool.run(lambda _: os.getpid(), [1], "here") == [os.getpid()]


def test_each_process_has_one_thread_and_this_one_keeps_its_own(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    with Workers(2) as pool:
        assert pool.run(os.getenv, ["OMP_NUM_THREADS"], "threads") == ["1"]
        assert pool.run(_threads, ["x"], "threads") == [{1}]
    assert os.environ["OMP_NUM_THREADS"] == "7"


def _threads(_) -> set[int]:
    """Return the numbers of threads of OpenCV and of each library of linear algebra."""
    import cv2
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_info

    return {cv2.getNumThreads(), *(one["num_threads"] for one in threadpool_info())}


@pytest.mark.parametrize("count", [0, 1])
def test_jobs_here_have_one_thread_while_the_workers_are_open(count):
    """Results are those of processes, and small matrices by two threads take several times the processor."""
    import cv2
    from threadpoolctl import threadpool_limits

    before = cv2.getNumThreads()
    cv2.setNumThreads(2)
    with threadpool_limits(2):
        assert _threads(None) == {2}
        with Workers(count) as pool:
            assert pool.run(lambda _: (os.getpid(), _threads(None)), [1], "here") == [
                (os.getpid(), {1})
            ]
        assert _threads(None) == {2}
    cv2.setNumThreads(before)


def test_bad_input_comes_through_as_it_was():
    with pytest.raises(BadInput, match="row 7"), Workers(1) as pool:
        pool.run(_refuse, ["x"], "bad")


def _refuse(_):
    raise BadInput("is wrong", file="signals.csv", row=7)


def test_a_process_that_dies_costs_its_task_a_retry_and_the_third_death_is_its_result(tmp_path):
    tasks = [(tmp_path / "fine", 0), (tmp_path / "once", 1), (tmp_path / "always", 9)]
    with Workers(2) as pool:
        found = pool.run(dies, tasks, "deaths", lost=lambda task: f"{task[0].name} is lost")
    assert found == ["fine", "once", "always is lost"]
    assert [len(file.read_text()) for file, _ in tasks] == [1, 2, 3]  # how often each was begun


def test_a_killed_process_is_told_in_a_line(tmp_path, monkeypatch):
    monkeypatch.setattr("bench.base.workers.MOST_DEATHS", 1)
    with (
        pytest.raises(BadInput, match="a worker process was killed three times"),
        Workers(2) as pool,
    ):
        pool.run(dies, [(tmp_path / "always", 9)], "killed")


_LONG = """
import os, signal, sys, time
from bench.base.workers import Workers
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
    with Workers(2) as pool:
        print(*pool.run(abs, [1, 2], "first"), flush=True)
        pool.run(time.sleep, [60, 60], "long")
"""


@pytest.mark.parametrize("kill", [signal.SIGINT, signal.SIGKILL])
def test_no_process_outlives_the_run(tmp_path, kill):
    """Neither Ctrl-C nor a kill leaves workers behind: the group is empty within a few seconds."""
    script = tmp_path / "long.py"
    script.write_text(_LONG)
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY)}
    run = subprocess.Popen(
        [sys.executable, str(script)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=environment,
        start_new_session=True,
    )
    assert run.stdout.readline() == b"1 2\n"
    run.send_signal(kill)
    run.wait(timeout=20)
    run.stdout.close()
    deadline = time.time() + 10.0
    while time.time() < deadline and _group_lives(run.pid):
        time.sleep(0.1)
    assert not _group_lives(run.pid)


def _group_lives(group: int) -> bool:
    """Is a process of the group running? Those that ended and wait to be collected do not count."""
    for entry in Path("/proc").iterdir() if Path("/proc").is_dir() else ():
        try:
            state, _, its_group = (entry / "stat").read_text().rsplit(") ", 1)[1].split()[:3]
        except (OSError, IndexError):
            continue
        if int(its_group) == group and state != "Z":
            return True
    return False
