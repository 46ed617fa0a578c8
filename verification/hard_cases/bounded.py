"""One resolver call in a process of its own, so that it can be cut: a C routine cannot be interrupted from Python.

Used where a method forms the Delassus matrix of thousands of contacts: minutes and gigabytes. The clock starts when
the process has compiled; what exceeds the limit is killed and reported as timed out, never waited for.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from typing import TYPE_CHECKING, Any, NamedTuple

from iapb.errors import IapbError

if TYPE_CHECKING:
    from verification.hard_cases.case import HardCase

LIMIT_SECONDS = 2.0  # two thousand haptic steps: a method beyond this is of no use to anyone here
LIMIT_BYTES = 6 << 30  # address space: seven matrices of 10,000 x 10,000 doubles and the libraries
_READY = b"ready\n"


class TimedOut(IapbError):
    """A call took more than its limit of time."""


class OutOfMemory(IapbError):
    """A call needed more than its limit of memory."""


class Answer(NamedTuple):
    """What is judged of an impact: v⁺, rank, clamp; and the time of the call [s]."""

    velocity: Any
    rank: int
    clamp: float
    seconds: float


def bounded_impact(
    case: HardCase, method: str, limit: float = LIMIT_SECONDS, most_bytes: int = LIMIT_BYTES
) -> Answer:
    """Resolve one hard case by one method in a process of its own.

    Raises
    ------
    TimedOut, OutOfMemory
        Beyond `limit` [s] or `most_bytes` of address space (POSIX systems only).
    IapbError
        What the resolver itself raised.
    """
    paths = {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}  # the packages that we run from
    threads = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # each thread's buffers count as address space
    command, environment = [sys.executable, "-m", __name__], {**os.environ, **paths, **threads}
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment) as process:
        if process.stdout is None or process.stdout.readline() != _READY:
            raise IapbError("the process for a bounded call did not start")
        try:
            out, _ = process.communicate(pickle.dumps((case, method, most_bytes)), timeout=limit)
        except subprocess.TimeoutExpired:
            process.kill()
            raise TimedOut(f"cut after {limit:g} s") from None
    if process.returncode != 0:
        raise IapbError(f"the process for a bounded call ended with code {process.returncode}")
    found = pickle.loads(out)
    if isinstance(found, Exception):
        raise found
    answer: Answer = found
    return answer


def _serve() -> None:
    """Warm up, say so, then read one call and write its answer."""
    from reference.one_thread import one_thread
    from verification.hard_cases import bounded  # by its name: what __main__ pickles is not found again
    from verification.hard_cases.judge_impact import resolve_once, warm_up

    with one_thread():
        warm_up()
        sys.stdout.buffer.write(_READY)
        sys.stdout.buffer.flush()
        case, method, most_bytes = pickle.loads(sys.stdin.buffer.read())
        _limit_memory(most_bytes)
        try:
            found: Any = resolve_once(case, method)
        except MemoryError:
            found = bounded.OutOfMemory(f"needs more than {most_bytes / 2**30:g} GiB")
        except IapbError as error:
            found = IapbError(str(error))
    sys.stdout.buffer.write(pickle.dumps(found))


def _limit_memory(most_bytes: int) -> None:
    try:
        import resource
    except ImportError:  # not a POSIX system: time alone limits the call
        return
    resource.setrlimit(resource.RLIMIT_AS, (most_bytes, most_bytes))


if __name__ == "__main__":
    _serve()
