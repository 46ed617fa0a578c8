"""Wrong input on purpose: valid files and command lines, damaged at random, given to the readers.

Whatever comes in must be read, or be refused by one of iapb's own errors; never a traceback, a hang, or memory without
end. `inputs` says what is damaged and who reads it, `damage` how.

    python -m tests.robustness.fuzz --cases 100000      (part of make fuzz)

Cases are tried in processes of their own: a reader that takes its process down (a fault inside a library) is found,
too, and the next process goes on behind it. What breaks something is kept in out/fuzz.
"""

from __future__ import annotations

import argparse
import json
import resource
import signal
import sys
import tempfile
import threading
import time
import traceback
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cache, partial
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


class TooLong(BaseException):
    """A case took longer than LONGEST. Not an Exception: no reader may catch it."""


@dataclass
class FuzzRecord:
    """What came of the cases of one kind.

    read : taken as valid; refused : refused by one of iapb's errors; broken : anything else, the file and what came
    """

    tried: int = 0
    read: int = 0
    refused: int = 0
    broken: list[tuple[str, str]] = field(default_factory=list)


def case(kind: Any, seed: int, number: int) -> tuple[str, bytes]:
    """Return name and content of a case; the same for the same seed and number, whatever else is tried."""
    rng = np.random.default_rng([seed, zlib.crc32(kind.name.encode()), number])
    samples = kind.samples()
    names = sorted(samples)
    name, other = (names[int(rng.integers(len(names)))] for _ in range(2))
    return name, kind.damaged(samples[name], samples[other], rng)


def fuzz(
    kind: str, numbers: Sequence[int], seed: int = 0, keep: Path | None = None,
    begin: Callable[[int], None] = lambda number: None,
) -> FuzzRecord:
    """Try the cases of one kind with these numbers.

    Parameters
    ----------
    kind : one of `KINDS`
    numbers : which cases
    seed : of all cases
    keep : folder for the cases that broke something, and how; None: not kept
    begin : called with the number of each case before it is tried
    """
    chosen, record = KINDS[kind], FuzzRecord()
    with tempfile.TemporaryDirectory() as folder, bounded_memory():
        prepare(Path(folder))
        for number in numbers:
            begin(number)
            name, content = case(chosen, seed, number)
            outcome, words = judge(chosen, Path(folder) / name, content)
            record.tried, record.read = record.tried + 1, record.read + (outcome == READ)
            record.refused += outcome == REFUSED
            if outcome == BROKEN:
                record.broken.append((kept(keep, kind, number, name, content, words), words))
    return record


def judge(kind: Any, path: Path, content: bytes) -> tuple[str, str]:
    """Write a case and let it be read; return the outcome and what was said."""
    path.write_bytes(content)
    try:
        with bounded_time():
            kind.read(path)
    except IapbError as error:
        return REFUSED, str(error).replace(f"{path.parent}/", "")
    except TooLong:
        return BROKEN, f"not done after {LONGEST:g} s\n{traceback.format_exc()}"
    except KeyboardInterrupt:
        raise
    except BaseException:  # whatever comes is the finding
        return BROKEN, traceback.format_exc()
    return READ, ""


def kept(folder: Path | None, kind: str, number: int, name: str, content: bytes, how: str) -> str:
    """Keep a case that broke something, and how; return its file."""
    if folder is None:
        return ""
    place = folder / kind.replace(" ", "_")
    place.mkdir(parents=True, exist_ok=True)
    path = place / f"{number:09d}-{name}"
    path.write_bytes(content)
    record = {"kind": kind, "number": number, "how": how}
    path.with_name(f"{path.name}.how.json").write_text(json.dumps(record, indent=1))
    return str(path)


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
    if not statm.exists() or sys.platform != "linux":
        yield
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    most = int(statm.read_text().split()[0]) * resource.getpagesize() + _MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


_BATCH = 2000  # cases that one process tries
_ROUNDS = 100
_SHOWN = 5


def main(arguments: list[str] | None = None) -> int:
    """Try the cases; return 0 if none broke anything, else 1."""
    parser = argparse.ArgumentParser(prog="python -m tests.robustness.fuzz", description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=100_000, help="in all, shared out among the kinds")
    parser.add_argument("--minutes", type=float, default=inf, help="after which no more are tried")
    parser.add_argument("--kind", choices=list(KINDS), help="only this one")
    parser.add_argument("--first", type=int, default=0, help="number of the first case of each kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, default=Path("out/fuzz"), help="folder for what broke something")
    options = parser.parse_args(arguments)
    found = {kind: FuzzRecord() for kind in ([options.kind] if options.kind else KINDS)}
    shares, start = sum(KINDS[kind].share for kind in found), time.monotonic()
    for turn in range(_ROUNDS):  # all kinds in turn, so that each is tried where time is short
        for kind, record in found.items():
            size = ceil(options.cases * KINDS[kind].share / shares)
            numbers = range(options.first + turn * size // _ROUNDS, options.first + (turn + 1) * size // _ROUNDS)
            if numbers and time.monotonic() - start < 60.0 * options.minutes:
                _try_in_children(kind, numbers, options.seed, options.keep, record)
    for kind, record in found.items():
        print(f"{kind:<22} {record.tried:>7} tried, {record.read:>6} read, {record.refused:>6} refused by name, "
              f"{len(record.broken)} broken", flush=True)
    broken = [one for record in found.values() for one in record.broken]
    print(f"{sum(record.tried for record in found.values())} cases of {len(found)} kinds in "
          f"{time.monotonic() - start:.0f} s; {len(broken)} broken.")
    for file, how in broken[:_SHOWN]:
        print(f"{file}\n{how}")
    return 1 if broken else 0


def _try_in_children(kind: str, numbers: range, seed: int, keep: Path, sums: FuzzRecord) -> None:
    """Try a batch per process; where one died, count that case, and try the rest of its batch again."""
    _warm(kind)
    batches = [numbers[at : at + _BATCH] for at in range(0, len(numbers), _BATCH)]
    while batches:
        batch = batches.pop(0)
        record, last, status = _in_child(kind, batch, seed, keep)
        if record is None:
            at = batch.index(last)
            batches[:0] = [part for part in (batch[:at], batch[at + 1 :]) if part]
            how = f"the process ended with {status}"
            record = FuzzRecord(1, broken=[(kept(keep, kind, last, *case(KINDS[kind], seed, last), how), how)])
        for name in ("tried", "read", "refused", "broken"):
            setattr(sums, name, getattr(sums, name) + getattr(record, name))


@cache
def _warm(kind: str) -> None:
    """Make and read the valid samples here, once: each process that is forked has their modules and kernels."""
    with tempfile.TemporaryDirectory() as folder:
        prepare(Path(folder))
        for name, content in KINDS[kind].samples().items():
            judge(KINDS[kind], Path(folder) / name, content)


def _in_child(kind: str, batch: range, seed: int, keep: Path) -> tuple[FuzzRecord | None, int, int | None]:
    """Try a batch in a process; return its record (None: it died), the last case that it began, and how it ended."""
    context = get_context("fork")
    at = context.Value("q", batch[0])
    receiver, sender = context.Pipe(duplex=False)
    child = context.Process(target=_try, args=(kind, batch, seed, keep, sender, at))
    child.start()
    sender.close()
    record = None
    with suppress(EOFError):
        record = receiver.recv()
    child.join()
    return record, at.value, child.exitcode


def _try(kind: str, batch: range, seed: int, keep: Path, sender: Any, at: Any) -> None:
    sender.send(fuzz(kind, batch, seed, keep, begin=partial(setattr, at, "value")))
    sender.close()


if __name__ == "__main__":
    sys.exit(main())
