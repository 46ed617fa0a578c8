"""Work in parts, by a scheduler: `here`, `processes(count)` or `cluster(address)`; results do not depend on which.

A scheduler is called as scheduler(compute, parts) and yields (part, result) as results come. Only the parent process
handles Ctrl-C: it ends its workers.
"""

from __future__ import annotations

import logging
import os
import signal
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from itertools import islice
from multiprocessing import active_children, get_context
from threading import Thread
from typing import Any

from iapb.compiling import tell_from_worker
from iapb.errors import ArgumentError, IapbError, MissingDependencyError, installing

Results = Generator[tuple[Any, Any]]
Scheduler = Callable[[Callable[[Any], Any], Iterable[Any]], Results]

_LOUD = ("distributed", "distributed.client", "distributed.core", "tornado.application", "asyncio")
_AHEAD = 4  # parts submitted per worker: enough to keep it busy, few enough that Ctrl-C loses little work
_CLUSTER_AHEAD = 256  # parts submitted to a cluster at the same time
_MOST_WORKERS = 4  # a worker of a report holds some 500 MB
_WATCH = 1.0  # [s] between two checks that the parent is alive


def here(compute: Callable[[Any], Any], parts: Iterable[Any]) -> Results:
    """Compute in this process, one after the other."""
    for part in parts:
        yield part, compute(part)


def processes(workers: int) -> Scheduler:
    """Compute in `workers` processes of this machine; results come in the order in which they finish."""

    def schedule(compute: Callable[[Any], Any], parts: Iterable[Any]) -> Results:
        with worker_pool(workers) as pool:
            yield from _as_they_finish(pool, compute, parts, workers * _AHEAD)

    return schedule


def cluster(address: str) -> Scheduler:
    """Compute on the dask.distributed cluster whose scheduler has this address.

    Raises
    ------
    MissingDependencyError
        dask.distributed is not installed (extra ``cluster``).
    ArgumentError
        No scheduler answers.
    """

    def schedule(compute: Callable[[Any], Any], parts: Iterable[Any]) -> Results:
        try:
            from distributed import Client
            from distributed.comm import CommClosedError
        except ImportError as error:
            raise MissingDependencyError("distributed", "A sweep on a cluster",
                                         installing("cluster")) from error
        for name in _LOUD:  # if the scheduler dies, print one sentence of ours without dask's tracebacks
            logging.getLogger(name).setLevel(logging.CRITICAL)
        try:
            client = Client(address, timeout="10s")
        except (OSError, ValueError, TimeoutError) as error:
            raise ArgumentError("--scheduler", address, "the address of a running dask scheduler") from error
        try:  # pure=False, because `compute` writes a file
            yield from _as_they_finish(client.get_executor(pure=False), compute, parts, _CLUSTER_AHEAD)
        except (CommClosedError, CancelledError) as error:
            raise IapbError(f"the scheduler at {address} no longer answers; finished points are kept. Start one "
                            "and run the same command again: it continues there") from error
        finally:
            client.close()

    return schedule


def _as_they_finish(pool: Executor, compute: Callable[[Any], Any], parts: Iterable[Any], ahead: int) -> Results:
    left, running = iter(parts), dict[Future[Any], Any]()
    while running := running | {pool.submit(compute, part): part for part in islice(left, ahead - len(running))}:
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            yield running.pop(future), future.result()


@contextmanager
def starting_a_process() -> Iterator[None]:
    """Block SIGINT permanently in every process that is started inside this context.

    A child inherits the signals that its parent's thread has blocked. If the child blocked SIGINT only after its
    start, Ctrl-C could stop it during its imports: it would print a traceback, and if it held the lock of the pool,
    the pool would wait forever.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Pool(ProcessPoolExecutor):
    """A process pool that starts its workers on demand, in `submit`, with SIGINT blocked.

    said : what the workers say by `tell_parent`
    """

    said: Any
    submit = starting_a_process()(ProcessPoolExecutor.submit)


_said: Any = None  # in a worker: where the parent reads


def tell_parent(*message: Any) -> None:
    """Send a message from a worker; the parent reads `said` of its pool."""
    _said.put(message)


def _begin(told: Any, said: Any, parent: int) -> None:
    """Initialise a worker; it exits when its parent is gone, instead of waiting forever."""
    global _said
    _said = said

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_WATCH)
        os._exit(1)

    Thread(target=watch, daemon=True).start()
    tell_from_worker(told)


def cores() -> int:
    """Return the number of worker processes that are worth starting on this machine."""
    return min(_MOST_WORKERS, len(os.sched_getaffinity(0)))


@contextmanager
def worker_pool(count: int) -> Iterator[_Pool]:
    """Yield a pool of `count` processes with the start method "spawn"; any exception terminates them at once.

    The first worker that compiles a kernel prints a message.

    Raises
    ------
    IapbError
        A worker was killed, for example because memory ran out.
    """
    others, context = set(active_children()), get_context("spawn")
    told, said = context.Value("b", False), context.SimpleQueue()
    pool = _Pool(count, mp_context=context, initializer=_begin, initargs=(told, said, os.getpid()))
    pool.said = said
    try:
        yield pool
    except BrokenProcessPool as error:
        raise IapbError("a worker process was killed, probably because memory ran out; finished work is kept. Run "
                        "the same command again with fewer --workers: it continues there") from error
    except BaseException:
        for worker in set(active_children()) - others:
            worker.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
