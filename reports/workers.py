"""Executors like those of `concurrent.futures`: worker processes of this machine, or a dask
cluster."""

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager
from multiprocessing import active_children, get_context, parent_process
from threading import Thread
from typing import Any

from iapb.errors import ArgumentError, IapbError, MissingDependencyError, installing

# Loggers of dask: if the scheduler dies, one sentence of ours is printed without their tracebacks.
_LOUD = ("distributed", "distributed.client", "distributed.core", "tornado.application", "asyncio")


def cores() -> int:
    """Return the number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0))


REPORT_WORKERS = min(4, cores())  # a worker of a report holds some 500 MB


def executor(workers: int, dask: str = "") -> AbstractContextManager[Executor]:
    """Return a context with an executor: `workers` processes, or the dask cluster whose scheduler
    is at `dask`.

    Only this process hears Ctrl-C. An exception inside the context ends the worker processes at
    once.

    Raises
    ------
    IapbError
        A worker process was killed, for example because memory ran out, or the cluster no longer
        answers.
    MissingDependencyError
        dask.distributed is not installed (extra ``cluster``).
    ArgumentError
        No scheduler answers at the address `dask`.
    """
    return _cluster(dask) if dask else _processes(workers)


@contextmanager
def _without_ctrl_c() -> Iterator[None]:
    """Block SIGINT permanently in every process that is started inside this context.

    A child inherits the signals that its parent's thread has blocked. If the child blocked SIGINT
    only after its start, Ctrl-C could stop it during its imports: it would print a traceback, and
    if it held the lock of the pool, the pool would wait forever.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Processes(ProcessPoolExecutor):
    """Worker processes, which start on demand in `submit`, with SIGINT blocked."""

    submit = _without_ctrl_c()(ProcessPoolExecutor.submit)


def _begin() -> None:
    """Initialise a worker: it ends with its parent, also a killed one."""

    def watch() -> None:
        parent: Any = parent_process()
        parent.join()
        os._exit(1)

    Thread(target=watch, daemon=True).start()


@contextmanager
def _processes(workers: int) -> Iterator[Executor]:
    others = set(active_children())
    pool = _Processes(workers, mp_context=get_context("spawn"), initializer=_begin)
    try:
        yield pool
    except BrokenProcessPool as error:
        raise IapbError(
            "a worker process was killed, probably because memory ran out; finished files are "
            "kept. "
            "Run the same command again with fewer --workers"
        ) from error
    except BaseException:
        for worker in set(active_children()) - others:
            worker.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _cluster(address: str) -> Iterator[Executor]:
    try:
        from distributed import Client
        from distributed.comm import CommClosedError
    except ImportError as error:
        extra = installing("cluster")
        raise MissingDependencyError("distributed", "A sweep on a cluster", extra) from error
    for name in _LOUD:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        client = Client(address, timeout="30s")
    except (OSError, ValueError, TimeoutError) as error:
        raise ArgumentError("--dask", address, "the address of a running dask scheduler") from error
    try:
        yield client.get_executor(pure=False)  # because the work writes files
    except (CommClosedError, CancelledError) as error:
        raise IapbError(
            f"the scheduler at {address} no longer answers; finished files are kept. Start one and "
            "run the same command again: it continues there"
        ) from error
    finally:
        client.close()
