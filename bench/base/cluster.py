"""A Dask cluster that runs already, in place of processes here, with the same results to the byte.

Its workers read the session and write into the output folder themselves: both must be there under the same paths. They
must have our code and the versions of the libraries that this process has. Each sees to that before its first job. A
worker does one job at a time, by one thread, however many it has.
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
from bench.base.workers import DIED, Workers, one_thread

_CODE = ("bench", "vision", "estimator")
# Libraries that results are computed by.
_LIBRARIES = ("numpy", "scipy", "scikit-image", "opencv-contrib-python-headless")
# [s] For a scheduler to answer. Stated.
_LONG_ENOUGH_S = 10.0
# of one task; Dask warns from 10 MB on, and a task holds the rig pictures of all cameras
_LARGE = "1GB"
_ONE_AT_A_TIME = threading.Lock()


class Cluster(Workers):
    """The workers of the cluster whose scheduler has this address; use as a context, within the lock on `out`.

    Where a worker dies, Dask gives its task to another, as often as its scheduler's `allowed-failures` says. Entering
    raises BadInput where Dask is not installed or no scheduler answers.
    """

    def __init__(self, address: str, out: Path):
        """Keep the address; the scheduler is not called yet."""
        super().__init__(0)
        self.address = address
        self.out = out

    def __enter__(self) -> "Cluster":
        """Start the connection to the scheduler. Raise BadInput where there is none."""
        try:
            from distributed import Client
        except ImportError:
            fix = "--dask needs distributed: pip install 'whisker-bench[cluster]'"
            raise BadInput(fix) from None
        try:
            self._client = Client(self.address, timeout=_LONG_ENOUGH_S, set_as_default=False)
        except (OSError, ValueError):
            raise self._bad("no scheduler answers there") from None
        if not self._client.nthreads():
            self._client.close()
            raise self._bad("its scheduler has no worker yet")
        super().__enter__()
        return self

    def _bad(self, reason: str) -> BadInput:
        """Return the error of a cluster that cannot be worked with."""
        return BadInput(f"--dask {self.address}: {reason}")

    def __exit__(self, kind: type[BaseException] | None, *_) -> None:
        """Close the connection. Unfinished tasks have no one who waits for them, and are dropped."""
        super().__exit__(kind)
        self._client.close()

    def _finished(self, job: Callable, tasks: Sequence) -> Iterator[tuple[int, object]]:
        """Yield places and results as they come; DIED in place of a result."""
        import dask
        from distributed import as_completed

        lock = self.out / LOCK
        given = partial(_job, job, here=facts(), lock=(lock, lock.read_text()))
        waiting = deque(enumerate(tasks))
        busy: dict[Any, int] = {}  # place of each task
        done = as_completed(loop=self._client.loop)
        while waiting or busy:
            # one a worker, few at the scheduler
            while waiting and len(busy) < max(len(self._client.nthreads()), 1):
                place, task = waiting.popleft()
                with dask.config.set({"distributed.admin.large-graph-warning-threshold": _LARGE}):
                    future = self._client.submit(given, task, pure=False)
                busy[future] = place
                done.add(future)
            future = next(done)
            yield busy.pop(future), self._result(future)

    def _result(self, future: Any) -> object:
        """Return the result of a finished job, DIED where its worker died.

        Raises what the job raised, BadInput where the cluster was lost or is not ours.
        """
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
    """Return what two processes must have alike to give the same bytes."""
    libraries = {name: version(name) for name in _LIBRARIES}
    return {"whisker-bench": hash_of_code(_CODE), "Python": platform.python_version(), **libraries}


def _job(job: Callable, task: Any, here: dict[str, str], lock: tuple[Path, str]) -> Any:
    """Run a job on a worker. Raise BadInput where it is not one of ours.

    here: `facts` of the process that sent it. lock: a file, and its text.
    """
    _check_code(tuple(here.items()))
    file, text = lock
    if not file.is_file() or file.read_text() != text:
        rule = "session and output must be there under the same paths"
        raise BadInput(f"{_worker()} does not see {file.parent}: {rule}")
    with _ONE_AT_A_TIME, one_thread():
        return job(task)


@lru_cache
def _check_code(here: tuple[tuple[str, str], ...]) -> None:
    """Raise BadInput where a worker has other code or libraries."""
    own = facts()
    for name, wanted in here:
        if own[name] != wanted:
            found = f"{_worker()} has {name} {own[name]}, here it is {wanted}"
            raise BadInput(f"{found}: install the same on both")


def _worker() -> str:
    """Return how messages name this worker."""
    return f"the worker on {platform.node()}"
