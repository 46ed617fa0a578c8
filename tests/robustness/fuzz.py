"""Wrong input on purpose: valid files and command lines, damaged at random, given to the readers.

Whatever comes in must be read, or be refused by one of iapb's own errors; never a traceback, a hang, or memory without
end. `inputs` says what is damaged and who reads it, `damage` how.

    python -m tests.robustness.fuzz --cases 100000      (part of make fuzz)

Cases are tried in processes of their own: a reader that takes its process down (a fault inside a library) is found,
too, and the next process goes on behind it. What breaks something is kept in out/fuzz.
"""

from __future__ import annotations

import argparse
import resource
import signal
import sys
import tempfile
import threading
import time
import traceback
import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from math import ceil, inf
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import IapbError
from tests.robustness.inputs import KINDS, prepare

READ, REFUSED, BROKEN = "read", "refused", "broken"
LONGEST = 20.0  # [s] of this process's own time; a case takes milliseconds, the largest legal file a few seconds
_MEMORY = 4 << 30  # bytes beyond what the process has: a wrong file may not ask for more
_BATCH = 2000  # cases that one process tries
_AT = "number"  # file that names the case at hand


class TooLong(BaseException):
    """A case took longer than LONGEST. Not an Exception: no reader may catch it."""


def case(kind: Any, seed: int, number: int) -> tuple[str, bytes]:
    """Return name and content of a case; the same for the same seed and number, whatever else is tried."""
    rng = np.random.default_rng([seed, zlib.crc32(kind.name.encode()), number])
    samples = kind.samples()
    names = sorted(samples)
    name, other = (names[int(rng.integers(len(names)))] for _ in range(2))
    return name, kind.damaged(samples[name], samples[other], rng)


def fuzz(kind: str, numbers: Iterable[int], seed: int, folder: Path) -> tuple[Counter[str], list[tuple[int, str]]]:
    """Try the cases of one kind with these numbers in a folder; return the outcomes, and which broke something, how."""
    outcomes, broken = Counter[str](), list[tuple[int, str]]()
    prepare(folder)
    with bounded_memory():
        for number in numbers:
            (folder / _AT).write_text(str(number))
            name, content = case(KINDS[kind], seed, number)
            outcome, words = judge(KINDS[kind].read, folder / name, content)
            outcomes[outcome] += 1
            broken += [(number, words)] if outcome == BROKEN else []
    return outcomes, broken


def judge(read: Callable[[Path], Any], path: Path, content: bytes) -> tuple[str, str]:
    """Write a case and let it be read; return the outcome and what was said."""
    path.write_bytes(content)
    try:
        with bounded_time():
            read(path)
    except IapbError as error:
        return REFUSED, str(error)
    except KeyboardInterrupt:
        raise
    except BaseException:  # whatever comes is the finding
        return BROKEN, traceback.format_exc()
    return READ, ""


@contextmanager
def bounded_time() -> Iterator[None]:
    """Stop what runs longer than LONGEST, counted in this process's own time: a busy machine is no hang.

    Signals reach the main thread only; elsewhere nothing is stopped.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(*_: object) -> None:
        raise TooLong

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)


@contextmanager
def bounded_memory() -> Iterator[None]:
    """Let memory grow by _MEMORY at most, where the system can say how much there is."""
    statm = Path("/proc/self/statm")
    if not statm.exists():
        yield
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    most = int(statm.read_text().split()[0]) * resource.getpagesize() + _MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def main(arguments: list[str] | None = None) -> int:
    """Try the cases; return 0 if none broke anything, else 1."""
    parser = argparse.ArgumentParser(prog="python -m tests.robustness.fuzz", description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=100_000, help="in all, shared out among the kinds")
    parser.add_argument("--minutes", type=float, default=inf, help="after which no more are tried")
    parser.add_argument("--kind", choices=list(KINDS), help="only this one")
    parser.add_argument("--first", type=int, default=0, help="number of the first case of each kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, default=Path("out/fuzz"), help="folder for what broke something")
    given = parser.parse_args(arguments)
    kinds = [given.kind] if given.kind else list(KINDS)
    shares, start, failed = sum(KINDS[kind].share for kind in kinds), time.monotonic(), 0
    for kind in kinds:
        size, outcomes = ceil(given.cases * KINDS[kind].share / shares), Counter[str]()
        batches = [range(first, min(first + _BATCH, given.first + size))
                   for first in range(given.first, given.first + size, _BATCH)]
        while batches and time.monotonic() - start < 60.0 * given.minutes:
            numbers = batches.pop(0)
            counted, broken = _in_child(kind, numbers, given.seed, batches)
            outcomes += counted
            for number, how in broken:
                name, content = case(KINDS[kind], given.seed, number)
                path = given.keep / kind.replace(" ", "_") / f"{number:09d}-{name}"
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
                print(f"{path}\n{how}")
        failed += outcomes[BROKEN]
        print(f"{kind:<22} {outcomes.total():>7} tried, {outcomes[READ]:>6} read, {outcomes[REFUSED]:>6} refused by "
              f"name, {outcomes[BROKEN]} broken", flush=True)
    return int(failed > 0)


def _in_child(kind: str, numbers: range, seed: int, batches: list[range]) -> tuple[Counter[str], list[tuple[int, str]]]:
    """Try a batch in a process; if it dies, count the case at hand, and put the others back into `batches`."""
    with tempfile.TemporaryDirectory() as folder, ProcessPoolExecutor(1, get_context("fork")) as pool:
        try:
            return pool.submit(fuzz, kind, numbers, seed, Path(folder)).result()
        except BrokenProcessPool:
            last = int((Path(folder) / _AT).read_text())
    batches[:0] = [part for part in (range(numbers.start, last), range(last + 1, numbers.stop)) if part]
    return Counter({BROKEN: 1}), [(last, "the process ended")]


if __name__ == "__main__":
    sys.exit(main())
