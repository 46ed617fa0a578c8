"""Try wrong inputs one by one and judge each: read, refused by name, or broken (a traceback, a hang, a crash)."""

from __future__ import annotations

import json
import resource
import signal
import sys
import tempfile
import threading
import traceback
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import IapbError

READ, REFUSED, BROKEN = "read", "refused", "broken"
LONGEST = 20.0  # [s] of this process's own time; a case takes milliseconds, the largest legal file a few seconds
_MEMORY = 4 << 30  # bytes beyond what the process has: a wrong file may not ask for more


class TooLong(BaseException):
    """A case took longer than LONGEST. Not an Exception: no reader may catch it."""


@dataclass(frozen=True)
class Broken:
    """A case that neither was read nor refused: which one, and what came instead.

    file : where it was kept, or empty
    """

    kind: str
    number: int
    seed: int
    how: str
    file: str = ""


@dataclass(frozen=True)
class FuzzRecord:
    """What came of the cases of one kind.

    read : taken as valid; refused : refused by one of iapb's errors; broken : anything else
    said : the shortest message of a refusal
    """

    kind: str
    tried: int
    read: int
    refused: int
    broken: tuple[Broken, ...]
    said: str


def case(kind: Any, seed: int, number: int) -> tuple[str, bytes]:
    """Return name and content of a case; the same for the same seed and number, whatever else is tried."""
    rng = np.random.default_rng([seed, zlib.crc32(kind.name.encode()), number])
    samples = kind.samples()
    names = sorted(samples)
    name, other = (names[int(rng.integers(len(names)))] for _ in range(2))
    return name, kind.damaged(samples[name], samples[other], rng)


def fuzz(
    kind: str, numbers: Sequence[int], seed: int = 0, keep: Path | None = None,
    progress: Callable[[int, int], None] | None = None, begin: Callable[[int], None] | None = None,
) -> FuzzRecord:
    """Try the cases of one kind with these numbers.

    Parameters
    ----------
    kind : one of `reports.fuzz.kinds.kinds()`
    numbers : which cases
    seed : of all cases
    keep : folder for the cases that broke something, and how; None: not kept
    progress : called as progress(cases done, cases in all)
    begin : called with the number of each case before it is tried

    Returns
    -------
    FuzzRecord
    """
    from reports.fuzz.kinds import kinds, prepare

    chosen, counts, said, broken = kinds()[kind], {READ: 0, REFUSED: 0}, "", []
    with tempfile.TemporaryDirectory() as folder:
        prepare(Path(folder))
        with bounded_memory():
            for done, number in enumerate(numbers, start=1):
                if begin is not None:
                    begin(number)
                name, content = case(chosen, seed, number)
                outcome, words = judge(chosen, Path(folder) / name, content)
                if outcome == BROKEN:
                    broken.append(Broken(kind, number, seed, words, kept(keep, kind, number, name, content, words)))
                else:
                    counts[outcome] += 1
                said = min((said, words), key=lambda text: (not text, len(text)))
                if progress is not None:
                    progress(done, len(numbers))
    return FuzzRecord(kind, len(numbers), counts[READ], counts[REFUSED], tuple(broken), said)


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
