"""The same bytes by any number of processes, in parts put together, and by a Dask cluster whose workers die."""

import pytest

from bench.base.cluster import Cluster
from bench.base.settings import Settings
from bench.commands.cli import main
from bench.workflows.session_evaluation import evaluate
from tests.faults.interrupted import contents, differences
from tests.scenes.deaths import dies


@pytest.fixture(scope="module")
def by_one(small_session, tmp_path_factory) -> dict[str, bytes]:
    """Every file that one process writes."""
    out = tmp_path_factory.mktemp("one")
    evaluate(small_session, out, Settings(), workers=1)
    return contents(out)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [2, 4])
def test_any_number_of_workers(small_session, by_one, tmp_path, workers):
    evaluate(small_session, tmp_path, Settings(), workers=workers)
    assert not differences(contents(tmp_path), by_one)


@pytest.mark.slow
def test_parts_put_together(small_session, by_one, tmp_path):
    """Each trial alone in a folder of its own, as on machines of their own: their files, laid together, are those of
    one run, and `evaluate` of all makes the rest from them, without another look at what they have seen."""
    parts = {}
    for trial in sorted(path.name for path in (small_session / "trials").iterdir()):
        evaluate(small_session, tmp_path / trial, Settings(trials=trial))
        parts |= {
            name: data
            for name, data in contents(tmp_path / trial).items()
            if name.startswith("trials/")
        }
    assert parts == {name: data for name, data in by_one.items() if name.startswith("trials/")}
    for name, data in parts.items():
        (tmp_path / "all" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "all" / name).write_bytes(data)
    evaluate(small_session, tmp_path / "all", Settings())
    lacking = differences(contents(tmp_path / "all"), by_one)
    assert all(name.startswith("calibration/seen/") for name in lacking)


@pytest.fixture
def cluster():
    """The scheduler's address of two worker processes on this machine, started from another folder."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None
    ) as made:
        yield made.scheduler_address


@pytest.mark.slow
def test_a_cluster(small_session, by_one, cluster, tmp_path, capsys):
    assert main(["evaluate", str(small_session), "--out", str(tmp_path), "--dask", cluster]) in (
        0,
        1,
    )
    assert not differences(contents(tmp_path), by_one)


@pytest.mark.slow
def test_a_worker_of_a_cluster_that_dies_costs_a_retry(cluster, tmp_path):
    """Dask gives a task up after so many deaths as its scheduler allows, three retries unless told otherwise."""
    (tmp_path / ".lock").write_text("this run")
    tasks = [(tmp_path / "fine", 0), (tmp_path / "once", 1), (tmp_path / "always", 9)]
    with Cluster(cluster, tmp_path) as pool:
        found = pool.run(dies, tasks, "deaths", lost=lambda task: f"{task[0].name} is lost")
    assert found == ["fine", "once", "always is lost"]
    assert len((tmp_path / "once").read_text()) >= 2
