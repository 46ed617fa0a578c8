"""Report that kernels are being compiled, which can take a minute or two. Nested listeners report
it once."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from iapb.errors import harmless

_listening: list[bool] = []  # not empty: a listener reports already
_begun: list[bool] = []  # not empty: this process has said that it compiles
WORTH_SAYING = 1.0  # [s] of compiling
BEGIN = "Compiling kernels (seconds to a minute or two); they are cached for the next time ..."


@contextmanager
def compiling_told(say: Callable[[str], None]) -> Iterator[None]:
    """Call say(line) when this process first compiles a kernel, and at the end with the time if it
    is WORTH_SAYING.

    A kernel from numba's cache is not compiled and not reported.
    """
    from numba.core import event

    if _listening:
        yield
        return

    def say_once() -> None:
        if not _begun:
            _begun.append(True)
            say(BEGIN)

    listener = _listener(say_once)
    _listening.append(True)
    try:
        with event.install_listener("numba:compile", listener):
            yield
    finally:
        _listening.pop()
        if listener.done and listener.duration >= WORTH_SAYING:
            say(f"Compiling took {listener.duration:.1f} s.")


def to_stderr(line: str) -> None:
    """Write a line to stderr now, if it can be written; what would give a terminal orders is
    escaped."""
    with suppress(OSError):
        print(harmless(line), file=sys.stderr, flush=True)


def tell_from_worker(told: Any) -> None:
    """Initialise a worker process. Of the processes that share the flag `told`, the first to
    compile reports it."""
    from numba.core import event

    def say_once() -> None:
        with told.get_lock():
            first, told.value = not told.value, True
        if first:
            to_stderr(BEGIN)

    _listening.append(True)
    event.register("numba:compile", _listener(say_once))


def _listener(begin: Callable[[], None]) -> Any:
    """Return a numba listener that calls begin() and adds up the time of compiling, in `duration`
    once `done`."""
    from numba.core.event import TimingListener

    class Listener(TimingListener):
        def on_start(self, event: object) -> None:
            begin()
            super().on_start(event)

    return Listener()
