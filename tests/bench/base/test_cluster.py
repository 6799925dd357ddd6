"""A Dask cluster in place of processes: the same results in the same order, and one clear line where it is not ours."""

import sys

import pytest

from bench.base import cluster
from bench.base.atomic import lock_output
from bench.base.cluster import Cluster
from bench.base.errors import BadInput

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def local():
    """A cluster of two workers in this process."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None
    ) as made:
        yield made.scheduler_address


@pytest.fixture
def of_two(local, tmp_path):
    with lock_output(tmp_path), Cluster(local, tmp_path) as pool:
        yield pool


def test_order_is_that_of_the_tasks(of_two):
    assert of_two.run(abs, list(range(0, -7, -1)), "numbers") == list(range(7))
    assert of_two.run(abs, [], "nothing") == []


def test_bad_input_comes_through_as_it_was(of_two):
    with pytest.raises(BadInput, match=r"signals\.csv, row 7: is wrong"):
        of_two.run(_refuse, ["x"], "bad")


def _refuse(_):
    raise BadInput("is wrong", file="signals.csv", row=7)


def test_a_worker_must_see_the_output(of_two, tmp_path):
    """A folder of the same name that is not the same folder."""
    lock = tmp_path / ".lock", "of another run"
    with pytest.raises(BadInput, match="session and output must be there under the same paths"):
        cluster._job(abs, -1, cluster.facts(), lock)


def test_a_worker_must_have_what_is_here():
    here = tuple((cluster.facts() | {"numpy": "1.0"}).items())
    with pytest.raises(BadInput, match=r"has numpy .*, here it is 1\.0: install the same on both"):
        cluster._check_code(here)


def test_no_scheduler_is_told_in_a_line(monkeypatch, tmp_path):
    monkeypatch.setattr(cluster, "_LONG_ENOUGH_S", 0.2)
    with pytest.raises(BadInput, match=r"--dask tcp://127\.0\.0\.1:9: no scheduler answers there"):
        Cluster("tcp://127.0.0.1:9", tmp_path).__enter__()


def test_without_dask_the_line_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(BadInput, match=r"pip install 'whisker-bench\[cluster\]'"):
        Cluster("tcp://127.0.0.1:9", tmp_path).__enter__()
