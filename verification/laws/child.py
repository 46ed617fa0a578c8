"""A resolver in a process of its own: fresh when asked for, watched, and ended when it hangs.

`Child` forks a keeper before the first call. The keeper never calls the resolver. It forks a worker
that does, and another one when the worker ends, so each worker starts with a fresh resolver. The
kernel's alarm ends a worker whose call takes too long, compiled code that never returns included.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from verification.laws.resolver import Resolver, ResolverFault, answer_of

# messages: start a new worker; end
FRESH = "fresh"
LAST = "last"
# exit statuses of a worker that ends the keeper, too, and of one that makes room for a fresh one
_CLOSED = 97
_RESTART = 98


class Child:
    """A resolver in processes of its own; called as the resolver is, it returns the same v⁺.

    A worker that gives no answer within `limit` [s], or that crashes, raises ResolverFault.
    """

    def __init__(self, resolver: Resolver, limit: float) -> None:
        self._pipe, theirs = Pipe()
        sys.stdout.flush()
        with warnings.catch_warnings():  # of threads, which the child does not need
            warnings.simplefilter("ignore")
            self._keeper = os.fork()
        if self._keeper == 0:
            try:
                self._pipe.close()
                _keep(resolver, theirs, limit)
            finally:
                os._exit(0)
        theirs.close()

    def __call__(self, *given: Any) -> Any:
        """Return v⁺ of the worker; arguments that it changed are changed here, too."""
        self._pipe.send(given)
        answer, after = self._pipe.recv()
        for mine, theirs in zip(given, after, strict=False):  # a worker that ended returns none
            if isinstance(mine, np.ndarray):
                mine[...] = theirs
        if isinstance(answer, ResolverFault):
            raise answer
        return answer

    def restart(self) -> None:
        """Let the next call find a fresh resolver."""
        self._pipe.send(FRESH)

    def close(self) -> None:
        """End the processes; a worker that hangs is ended by its alarm."""
        with suppress(OSError):
            self._pipe.send(LAST)
        self._pipe.close()
        with suppress(ProcessLookupError):
            os.kill(self._keeper, signal.SIGKILL)
        os.waitpid(self._keeper, 0)


@contextmanager
def child_of(resolver: Resolver, limit: float) -> Iterator[Child | None]:
    """The child of a resolver; None where a process cannot be forked."""
    if not hasattr(os, "fork"):
        yield None
        return
    child = Child(resolver, limit)
    try:
        yield child
    finally:
        child.close()


def _keep(resolver: Resolver, pipe: Connection, limit: float) -> None:
    """Fork a worker whenever the last one has ended."""
    faulthandler.disable()  # a crash is told by the keeper
    for number in (signal.SIGINT, signal.SIGALRM, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)
    silent = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):  # what the resolver prints belongs to its own process
        os.dup2(silent, stream)
    while True:
        worker = os.fork()
        if worker == 0:
            try:
                os._exit(_work(resolver, pipe, limit))
            finally:
                os._exit(_CLOSED)
        status = os.waitstatus_to_exitcode(os.waitpid(worker, 0)[1])
        if status == _CLOSED:
            return
        if status != _RESTART:
            pipe.send((ResolverFault(_end_of_worker(status, limit)), ()))


def _end_of_worker(status: int, limit: float) -> str:
    """Return why a worker has ended in a call."""
    if status == -signal.SIGALRM:
        return f"gave no answer within {limit:g} s"
    how = signal.Signals(-status).name if status < 0 else f"status {status}"
    return f"ended its process by {how}"


def _work(resolver: Resolver, pipe: Connection, limit: float) -> int:
    """Answer calls; return the exit status of the worker."""
    while True:
        try:
            given = pipe.recv()
        except EOFError:
            return _CLOSED
        if given in (FRESH, LAST):
            return _RESTART if given == FRESH else _CLOSED
        signal.setitimer(signal.ITIMER_REAL, limit)
        answer = answer_of(resolver, given)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        pipe.send((answer, given))
