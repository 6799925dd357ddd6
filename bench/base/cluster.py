"""A Dask cluster that runs already, in place of processes here, with the same results to the byte.

Its workers read the session and write into the output folder themselves: both must be there under the same paths. They
must have our code and the versions of the libraries that this process has, and one thread for linear algebra. Each sees
to that before its first job. A worker does one job at a time, however many threads it has.
"""

import platform
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from functools import lru_cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from bench.base.atomic import LOCK
from bench.base.errors import BadInput
from bench.base.results import hash_of_code
from bench.base.workers import DIED, Workers, has_one_thread, pictures_by_one_thread

_CODE = ("bench", "vision", "estimator")
_LIBRARIES = (
    "numpy",
    "scipy",
    "scikit-image",
    "opencv-contrib-python-headless",
)  # what results are computed by
_LONG_ENOUGH_S = 10.0  # s, for a scheduler to answer. Set by eye
# of one task; Dask warns from 10 MB on, and a task holds the rig pictures of all cameras
_LARGE = "1GB"
_ONE_AT_A_TIME = threading.Lock()


class Cluster(Workers):
    """The workers of the cluster whose scheduler has this address; use as a context, within the lock on `out`.

    Where a worker dies, Dask gives its task to another, as often as its scheduler's `allowed-failures` says. Entering
    raises BadInput where Dask is not installed or no scheduler answers.
    """

    def __init__(self, address: str, out: Path, progress: bool = False):
        super().__init__(0, progress)
        self.address, self.out = address, out

    def __enter__(self) -> "Cluster":
        try:
            from distributed import Client
        except ImportError:
            raise BadInput(
                "--dask needs distributed: pip install 'whisker-bench[cluster]'"
            ) from None
        try:
            self._client = Client(self.address, timeout=_LONG_ENOUGH_S, set_as_default=False)
        except (OSError, ValueError):
            raise self._bad("no scheduler answers there") from None
        if not self._client.nthreads():
            self._client.close()
            raise self._bad("its scheduler has no worker yet")
        return self

    def _bad(self, reason: str) -> BadInput:
        return BadInput(f"--dask {self.address}: {reason}")

    def __exit__(self, kind, *_) -> None:
        self._client.close()  # what is still under way has no one who waits for it, and is dropped

    def _finished(self, job: Callable, tasks: Sequence) -> Iterator[tuple[int, object]]:
        import dask
        from distributed import as_completed

        lock = self.out / LOCK
        given = partial(_job, job, here=facts(), lock=(lock, lock.read_text()))
        waiting, busy, done = deque(enumerate(tasks)), {}, as_completed(loop=self._client.loop)
        while waiting or busy:
            while waiting and len(busy) < max(
                len(self._client.nthreads()), 1
            ):  # one each, few at the scheduler
                place, task = waiting.popleft()
                with dask.config.set({"distributed.admin.large-graph-warning-threshold": _LARGE}):
                    future = self._client.submit(given, task, pure=False)
                busy[future] = place
                done.add(future)
            future = next(done)
            yield busy.pop(future), self._result(future)

    def _result(self, future: Any) -> object:
        """Of a job that is done. Raises what the job raised, BadInput where the cluster was lost or is not ours."""
        from distributed.scheduler import KilledWorker

        try:
            return future.result()
        except KilledWorker:
            return DIED
        except CancelledError:
            raise self._bad("the cluster was lost; the same command goes on from there") from None
        except ModuleNotFoundError as problem:
            raise self._bad(f"a worker has no {problem.name}") from None


@lru_cache
def facts() -> dict[str, str]:
    """What two processes must have alike to give the same bytes."""
    libraries = {name: version(name) for name in _LIBRARIES}
    return {"whisker-bench": hash_of_code(_CODE), "Python": platform.python_version(), **libraries}


def _job(job: Callable, task: Any, here: dict[str, str], lock: tuple[Path, str]) -> Any:
    """The job, on a worker. Raises BadInput where it is not one of ours. lock: a file, and what it says."""
    _check_code(tuple(here.items()))
    file, said = lock
    if not file.is_file() or file.read_text() != said:
        raise BadInput(
            f"{_worker()} does not see {file.parent}: session and output must be there under the same paths"
        )
    with _ONE_AT_A_TIME, pictures_by_one_thread():
        return job(task)


@lru_cache
def _check_code(here: tuple[tuple[str, str], ...]) -> None:
    there = facts()
    for name, wanted in here:
        if there[name] != wanted:
            raise BadInput(
                f"{_worker()} has {name} {there[name]}, here it is {wanted}: install the same on both"
            )
    if not has_one_thread():
        raise BadInput(
            f"{_worker()} computes with several threads: start it with OMP_NUM_THREADS=1 "
            "OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1"
        )


def _worker() -> str:
    return f"the worker on {platform.node()}"
