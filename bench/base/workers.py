"""Processes that work in parallel, with the same results for any number of them.

Every job runs with one thread, however many processes there are, because libraries sum in another order with other
numbers of threads, and small matrices by several threads take many times the processor. Two workers and more are
fresh processes; with one or none jobs run here, by one thread while the workers are open (`one_thread`).
"""

import multiprocessing
import os
import signal
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager
from functools import cache
from typing import TYPE_CHECKING

from bench.base.errors import BadInput
from bench.base.progress import count_parts

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_PICTURES = "OPENCV_FOR_THREADS_NUM"  # OpenCV's own number, as it is loaded
# [s] That a worker may outlive a run that was killed. Stated.
_PARENT_CHECK_S = 1.0
# [processes] That die at one task, which is then given up. Stated.
MOST_DEATHS = 3
DIED = object()  # in place of the result of such a task
KILLED = (
    "a worker process was killed three times at the same task, by the system where memory ran out; what was finished "
    "is kept: the same command goes on from there, with fewer --workers if need be"
)


class Workers:
    """`count` processes; use as a context. Leaving it by an exception (Ctrl-C too) ends them at once."""

    def __init__(self, count: int):
        """Start no process yet."""
        self.count = count
        # one process each: a death is the death of one task
        self._processes: list[ProcessPoolExecutor] = []
        self._open = ExitStack()

    def __enter__(self) -> "Workers":
        """Return the workers; this process has one thread until they are left."""
        self._open.enter_context(one_thread())
        return self

    def __exit__(self, kind: type[BaseException] | None, *_) -> None:
        """Stop the processes, at once where there was an exception."""
        self._open.close()
        for process in self._processes:
            process.shutdown(wait=kind is None, cancel_futures=True)
        if kind is not None and self._processes:
            _end_children()

    def run(self, job: Callable, tasks: Sequence, name: str, lost: Callable | None = None) -> list:
        """Return job(task) of every task, in their order; log the progress.

        A task whose process dies is given to another, MOST_DEATHS times in all; then lost(task) stands
        for its result. Raises BadInput where there is no `lost`.
        """
        results = [None] * len(tasks)
        finished = self._finished(job, tasks)
        for place, result in count_parts(finished, name, len(tasks)):
            if result is DIED and lost is None:
                raise BadInput(KILLED)
            results[place] = lost(tasks[place]) if result is DIED else result
        return results

    def _finished(self, job: Callable, tasks: Sequence) -> Iterator[tuple[int, object]]:
        """Yield places and results as they come; DIED in place of a result."""
        if self.count < 2:
            for place, task in enumerate(tasks):
                yield place, job(task)
        elif tasks:
            yield from self._by_processes(job, tasks)

    def _by_processes(self, job: Callable, tasks: Sequence) -> Iterator[tuple[int, object]]:
        """Yield places and results of tasks that other processes do."""
        idle = self._start(min(self.count, len(tasks)))
        waiting = deque(range(len(tasks)))
        deaths: Counter[int] = Counter()
        busy: dict[Future, tuple[int, int]] = {}  # process and place of each task
        while waiting or busy:
            while waiting and idle:
                number = idle.pop()
                place = waiting.popleft()
                busy[self._submit(number, job, tasks[place])] = number, place
            for future in wait(busy, return_when=FIRST_COMPLETED).done:
                number, place = busy.pop(future)
                idle.append(number)
                result = _result(future)
                deaths[place] += result is DIED
                if result is DIED and deaths[place] < MOST_DEATHS:
                    waiting.appendleft(place)
                else:
                    yield place, result

    def _start(self, count: int) -> list[int]:
        """Start as many processes as are missing to a number; return the numbers of all."""
        while len(self._processes) < count:
            self._processes.append(_process())
        return list(range(len(self._processes)))

    def _submit(self, number: int, job: Callable, task: object) -> Future:
        """Give a task to a process, which is started anew where it has died; return its future."""
        try:
            return self._processes[number].submit(job, task)
        except BrokenProcessPool:
            self._processes[number] = _process()
            return self._processes[number].submit(job, task)


def _result(future: Future) -> object:
    """Return the result of a finished task, DIED where its process died. Raise what it raised."""
    try:
        return future.result()
    except BrokenProcessPool:
        return DIED


def _process() -> ProcessPoolExecutor:
    """Start a process of one thread."""
    context = multiprocessing.get_context("spawn")
    process = ProcessPoolExecutor(1, context, initializer=_begin, initargs=(os.getpid(),))
    with _single_threaded():
        process.submit(_nothing)
    return process


def single_thread() -> None:
    """Set one thread for linear algebra in this process, before NumPy is loaded.

    Another number in the environment stays.
    """
    for name in _THREADS:
        os.environ.setdefault(name, "1")


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep linear algebra and OpenCV to one thread within the context, as in a worker."""
    import cv2

    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        with _thread_pools().limit(limits=1):
            yield
    finally:
        cv2.setNumThreads(before)


@cache
def _thread_pools() -> "ThreadpoolController":
    """Return the thread pools of NumPy's and SciPy's linear algebra, which are loaded here."""
    import scipy.linalg  # noqa: F401
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


@contextmanager
def _single_threaded() -> Iterator[None]:
    """Set one thread for processes started within the context; this one keeps its own."""
    before = {name: os.environ.get(name) for name in (*_THREADS, _PICTURES)}
    os.environ.update(dict.fromkeys(before, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _begin(parent: int) -> None:
    """Begin a process: it leaves Ctrl-C to its parent, and ends by itself where that was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    """Wait for the parent's end, and end the process then."""
    while os.getppid() == parent:
        time.sleep(_PARENT_CHECK_S)
    os._exit(1)


def _nothing() -> None:
    """Return nothing: a first task makes the pool start its process."""


def _end_children() -> None:
    """Stop all processes that this one started."""
    for child in multiprocessing.active_children():
        child.terminate()
