"""Work in parts: finished parts are not computed again, and the results do not depend on the scheduler.

`do_missing` skips the finished parts and hands the others to a scheduler: `here`, `processes(count)` or
`cluster(address)`. Only the parent process handles Ctrl-C: it ends its workers. Results kept before that stay.
"""

from __future__ import annotations

import logging
import os
import signal
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager
from itertools import islice
from multiprocessing import active_children, get_context
from threading import Thread
from typing import Any

from iapb.compiling import tell_from_worker
from iapb.errors import ArgumentError, IapbError, MissingDependencyError

_LOUD = ("distributed", "distributed.client", "distributed.core", "tornado.application", "asyncio")

# Called as scheduler(compute, parts); yields (part, result) as results come.
Scheduler = Callable[[Callable[[Any], Any], Iterable[Any]], Generator[tuple[Any, Any]]]

_AHEAD = 4  # parts submitted per worker: enough to keep it busy, few enough that Ctrl-C loses little work
_CLUSTER_AHEAD = 256  # parts submitted to a cluster at the same time
_WATCH = 1.0  # [s] between two checks that the parent is alive


def do_missing(
    parts: Iterable[Any], compute: Callable[[Any], Any], keep: Callable[[Any, Any], None], *,
    done: Callable[[Any], bool], scheduler: Scheduler, progress: Callable[[int, int], None],
    size: Callable[[Any], int] = lambda part: 1,
) -> None:
    """Compute the parts that are not done yet, and keep each result as it comes.

    Parameters
    ----------
    compute : makes the result of a part, in this or another process, as the scheduler decides
    keep : called as keep(part, result), in this process
    done : whether the result of a part is kept already
    progress : called as progress(size done, total size)
    size : returns the size of a part
    """
    every = list(parts)
    missing = [part for part in every if not done(part)]
    total = sum(map(size, every))
    made = total - sum(map(size, missing))
    progress(made, total)
    with closing(scheduler(compute, missing)) as results:
        for part, result in results:
            keep(part, result)
            made += size(part)
            progress(made, total)


def here(compute: Callable[[Any], Any], parts: Iterable[Any]) -> Generator[tuple[Any, Any]]:
    """Compute in this process, one after the other."""
    for part in parts:
        yield part, compute(part)


def processes(workers: int) -> Scheduler:
    """Compute in `workers` processes of this machine; results come in the order in which they finish."""

    def schedule(compute: Callable[[Any], Any], parts: Iterable[Any]) -> Generator[tuple[Any, Any]]:
        with worker_pool(workers) as pool:
            yield from _as_they_finish(pool, compute, parts, workers * _AHEAD)

    return schedule


def _as_they_finish(
    pool: Executor, compute: Callable[[Any], Any], parts: Iterable[Any], ahead: int
) -> Generator[tuple[Any, Any]]:
    left, running = iter(parts), dict[Future[Any], Any]()
    while running := running | {pool.submit(compute, part): part for part in islice(left, ahead - len(running))}:
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            yield running.pop(future), future.result()


def cluster(address: str) -> Scheduler:
    """Compute on the dask.distributed cluster whose scheduler has this address.

    Raises
    ------
    MissingDependencyError
        dask.distributed is not installed (extra ``cluster``).
    ArgumentError
        No scheduler answers.
    """

    def schedule(compute: Callable[[Any], Any], parts: Iterable[Any]) -> Generator[tuple[Any, Any]]:
        client = _client(address)
        from distributed.comm import CommClosedError

        try:  # pure=False, because `compute` writes a file
            yield from _as_they_finish(client.get_executor(pure=False), compute, parts, _CLUSTER_AHEAD)
        except (CommClosedError, CancelledError) as error:
            raise IapbError(f"the scheduler at {address} no longer answers; finished points are kept. Start one "
                            "and run the same command again: it continues there") from error
        finally:
            client.close()

    return schedule


def _client(address: str) -> Any:
    try:
        from distributed import Client
    except ImportError as error:
        raise MissingDependencyError("distributed", "A sweep on a cluster", "pip install 'iapb[cluster]'") from error
    for name in _LOUD:  # if the scheduler dies, print one sentence of ours without dask's tracebacks
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        return Client(address, timeout="10s")
    except (OSError, ValueError, TimeoutError) as error:
        raise ArgumentError("--scheduler", address, "the address of a running dask scheduler") from error


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
    """A process pool that starts its workers on demand, in `submit`, with SIGINT blocked."""

    submit = starting_a_process()(ProcessPoolExecutor.submit)


def _begin(told: Any, parent: int) -> None:
    """Initialise a worker; it exits when its parent is gone, instead of waiting forever."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_WATCH)
        os._exit(1)

    Thread(target=watch, daemon=True).start()
    tell_from_worker(told)


@contextmanager
def worker_pool(count: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool of `count` processes with the start method "spawn"; any exception terminates them at once.

    The first worker that compiles a kernel prints a message.

    Raises
    ------
    IapbError
        A worker was killed, for example because memory ran out.
    """
    others, context = set(active_children()), get_context("spawn")
    told = context.Value("b", False)
    pool = _Pool(count, mp_context=context, initializer=_begin, initargs=(told, os.getpid()))
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
