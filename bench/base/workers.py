"""Processes that work side by side, with the same results for any number of them.

Every job runs with one thread, however many processes there are, because libraries sum in another order with other
numbers of threads: in fresh processes, or here where one is asked for and this one has a single thread itself
(`single_thread`), which spares it from loading every library twice. Tests pass 0 workers: then jobs run here.
"""

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, nullcontext

from tqdm import tqdm

from bench.base.errors import BadInput

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_LOOK_FOR_PARENT_S = 1.0  # s: so long a worker may outlive a run that was killed
_KILLED = (
    "a worker process was killed, by the system where memory ran out; what was finished is kept: the same command goes "
    "on from there, with fewer --workers if need be"
)


class Workers:
    """`count` processes; use as a context. Leaving it by an exception (Ctrl-C too) ends them at once."""

    def __init__(self, count: int, progress: bool = False):
        self.count, self.progress = count, progress
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> "Workers":
        return self

    def __exit__(self, kind, *_) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=kind is None, cancel_futures=True)
            if kind is not None:
                _end_children()

    def run(self, job: Callable, tasks: Sequence, name: str) -> list:
        """job(task) of every task, in their order; a bar over them where progress is wanted."""
        results = [None] * len(tasks)
        for place, result in tqdm(
            self._finished(job, tasks), desc=name, total=len(tasks), leave=False, disable=not self.progress
        ):
            results[place] = result
        return results

    def _finished(self, job: Callable, tasks: Sequence) -> Iterator[tuple[int, object]]:
        if self.count == 0 or (self.count == 1 and _has_one_thread()):
            for place, task in enumerate(tasks):
                with _pictures_by_one_thread() if self.count else nullcontext():
                    result = job(task)
                yield place, result
        elif tasks:
            pool = self._started()
            try:
                places = {pool.submit(job, task): place for place, task in enumerate(tasks)}
                yield from ((places[future], future.result()) for future in as_completed(places))
            except BrokenProcessPool:
                raise BadInput(_KILLED) from None

    def _started(self) -> ProcessPoolExecutor:
        if self._pool is None:
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(self.count, context, initializer=_begin, initargs=(os.getpid(),))
            with _single_threaded():
                for _ in range(self.count):
                    self._pool.submit(_nothing)
        return self._pool


def single_thread() -> None:
    """One thread for linear algebra in this process, unless another number was asked for. Before numpy is loaded."""
    for name in _THREADS:
        os.environ.setdefault(name, "1")


def _has_one_thread() -> bool:
    return all(os.environ.get(name) == "1" for name in _THREADS)


@contextmanager
def _pictures_by_one_thread() -> Iterator[None]:
    """OpenCV keeps to one thread in here, as in a worker."""
    import cv2

    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)


@contextmanager
def _single_threaded() -> Iterator[None]:
    """Processes started in here inherit one thread for linear algebra; this one keeps what it has."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name, None) if value is None else os.environ.update({name: value})


def _begin(parent: int) -> None:
    """Ctrl-C is the parent's to handle; a process whose parent was killed ends by itself."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    import cv2

    cv2.setNumThreads(1)


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_LOOK_FOR_PARENT_S)
    os._exit(1)


def _nothing() -> None:
    """Makes the pool start a process."""


def _end_children() -> None:
    for child in multiprocessing.active_children():
        child.terminate()
