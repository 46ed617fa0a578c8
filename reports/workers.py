"""Processes of this machine that share out a longer piece of work; Ctrl-C is the parent's, which then ends them."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import active_children, get_context
from threading import Thread
from typing import Any

from iapb.errors import IapbError
from reports.compiling import tell_from_worker

_WATCH = 1.0  # [s] between two looks at whether the parent is still there


@contextmanager
def starting_a_process() -> Iterator[None]:
    """Keep Ctrl-C from a process that is started inside, for good.

    A child inherits what its parent's thread has blocked. One that ignored it only once it runs would be hit while
    it imports: a traceback, and a pool whose lock a dying worker held waits for ever.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Pool(ProcessPoolExecutor):
    """Starts its workers as they are needed, in `submit`."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **options: Any) -> Future[Any]:
        with starting_a_process():
            return super().submit(function, *arguments, **options)


def _begin(told: Any, parent: int) -> None:
    """Initialise a worker, which otherwise would wait for ever for a parent that was killed."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_WATCH)
        os._exit(1)

    Thread(target=watch, daemon=True).start()
    tell_from_worker(told)


@contextmanager
def worker_pool(count: int) -> Iterator[ProcessPoolExecutor]:
    """Give `count` processes that start Python anew; whatever ends this early ends them, at once.

    The first to compile a kernel says so.

    Raises
    ------
    IapbError
        A worker was killed, as happens where memory runs out.
    """
    others, context = set(active_children()), get_context("spawn")
    told = context.Value("b", False)
    pool = _Pool(count, mp_context=context, initializer=_begin, initargs=(told, os.getpid()))
    try:
        yield pool
    except BrokenProcessPool as error:
        raise IapbError("a worker process was killed, as happens where memory runs out; what was done is kept, and "
                        "the same command goes on from there, with fewer --workers for less memory") from error
    except BaseException:
        for worker in set(active_children()) - others:
            worker.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
