"""A resolver in a process of its own: fresh when asked for, watched, and ended when it hangs.

`Child` forks a keeper before the first call. The keeper never calls the resolver. It forks a worker
that does, and another one when the worker ends, so each worker starts with a fresh resolver. The
kernel's alarm ends a worker whose call takes too long, compiled code that never returns included.
"""

from __future__ import annotations

import faulthandler
import mmap
import os
import pickle
import signal
import struct
import sys
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from select import select
from typing import Any

import numpy as np

from verification.laws.resolver import Resolver, ResolverFault, answer_of

# messages: start a new worker; end
FRESH = "fresh"
LAST = "last"
_CLOSED = 9  # exit status of a worker that ends the keeper, too
_NOTE = struct.Struct("dq")  # start of the call that runs now, and length of its arguments
_ROOM = 1 << 22  # bytes for the arguments of one call
_EVERY = 1.0  # seconds between two looks at the call that runs now


class Child:
    """A resolver in processes of its own; called as the resolver is, it returns the same v⁺.

    A worker that gives no answer within `limit` [s], or that crashes, raises ResolverFault. The
    resolver's own process may note each call before it makes it; a call that takes longer than
    `limit` is then named on stderr.
    """

    def __init__(self, resolver: Resolver, limit: float, name: str = "the resolver") -> None:
        self._pipe, theirs = Pipe()
        self._noted = mmap.mmap(-1, _ROOM + _NOTE.size)
        sys.stdout.flush()
        with warnings.catch_warnings():  # of threads, which the child does not need
            warnings.simplefilter("ignore")
            self._keeper = os.fork()
        if self._keeper == 0:
            try:
                self._pipe.close()
                _Keeper(resolver, theirs, limit, name, self._noted).keep()
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

    def note(self, given: bytes) -> None:
        """Note the pickled arguments of a call that this process makes now; b"" ends the note."""
        if len(given) <= _ROOM:
            self._noted[_NOTE.size : _NOTE.size + len(given)] = given
            self._noted[: _NOTE.size] = _NOTE.pack(time.monotonic(), len(given))

    def close(self) -> None:
        """End the processes; a worker that hangs is ended by its alarm."""
        with suppress(OSError):
            self._pipe.send(LAST)
        self._pipe.close()
        with suppress(ProcessLookupError):
            os.kill(self._keeper, signal.SIGKILL)
        os.waitpid(self._keeper, 0)


@contextmanager
def child_of(resolver: Resolver, limit: float, name: str) -> Iterator[Child | None]:
    """The child of a resolver; None where a process cannot be forked."""
    if not hasattr(os, "fork"):
        yield None
        return
    child = Child(resolver, limit, name)
    try:
        yield child
    finally:
        child.close()


class _Keeper:
    """The processes' side: the keeper, and the worker that it forks."""

    def __init__(
        self, resolver: Resolver, pipe: Connection, limit: float, name: str, noted: mmap.mmap
    ) -> None:
        self.resolver = resolver
        self.pipe = pipe
        self.limit = limit
        self.name = name
        self.noted = noted
        self.named = 0.0  # start of the call that was named last
        self.terminal = os.dup(2)

    def keep(self) -> None:
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
                    os._exit(self.work())
                finally:
                    os._exit(_CLOSED)
            status = os.waitpid(worker, 0)[1]
            if os.WIFSIGNALED(status):
                self.pipe.send((ResolverFault(self.ending(os.WTERMSIG(status))), ()))
            elif os.WEXITSTATUS(status) == _CLOSED:
                return

    def ending(self, number: int) -> str:
        """Words for the signal that ended a worker."""
        if number == signal.SIGALRM:
            return f"gave no answer within {self.limit:g} s"
        return f"ended its process by {signal.Signals(number).name}"

    def work(self) -> int:
        """Answer calls; return the exit status of the worker."""
        while True:
            while not select([self.pipe], [], [], _EVERY)[0]:
                self.look()
            try:
                given = self.pipe.recv()
            except EOFError:
                return _CLOSED
            if given in (FRESH, LAST):
                return 0 if given == FRESH else _CLOSED
            signal.setitimer(signal.ITIMER_REAL, self.limit)
            answer = answer_of(self.resolver, given)
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            self.pipe.send((answer, given))

    def look(self) -> None:
        """Name the call that the resolver's own process has made for longer than the limit."""
        started, length = _NOTE.unpack(self.noted[: _NOTE.size])
        if length == 0 or started == self.named or time.monotonic() < started + self.limit:
            return
        self.named = started
        given = pickle.loads(self.noted[_NOTE.size : _NOTE.size + length])
        lines = [f"{self.name} has given no answer for {self.limit:g} s. The impact:"]
        lines += shown_arguments(given)
        os.write(self.terminal, ("\n".join(lines) + "\n").encode())


def shown_arguments(given: tuple[Any, ...], returned: Any = None) -> Iterator[str]:
    """Yield lines with each argument of a call, and what it returned."""
    names = ("M", "J", "v", "e") if len(given) == 4 else ("M", "J", "T", "v", "e", "μ")
    shown = list(zip(names, given, strict=True))
    if returned is not None:
        shown.append(("returned", returned))
    for name, value in shown:
        text = (
            value
            if isinstance(value, str)
            else np.array2string(np.asarray(value), precision=9, threshold=400)
        )
        lead = f"  {name} = "
        yield lead + text.replace("\n", "\n" + " " * len(lead))
