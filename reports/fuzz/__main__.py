"""`python -m reports.fuzz --cases 100000`: many wrong inputs, in processes of their own; what breaks is kept.

A reader that takes its whole process down (a fault inside a library) is found, too: the case is kept, and the next
process goes on behind it.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from reports.fuzz.kinds import kinds
from reports.fuzz.trial import Broken, FuzzRecord, case, fuzz, kept

_BATCH = 500  # cases that one process tries
_SHOWN = 5


def main(arguments: list[str] | None = None) -> int:
    """Try the cases; return 0 if none broke anything, else 1."""
    options = _options(arguments)
    chosen = [options.kind] if options.kind else list(kinds())
    share = -(-options.cases // len(chosen))
    broken: list[Broken] = []
    tried, start = 0, time.monotonic()
    for kind in chosen:
        counts = {"read": 0, "refused": 0}
        for record in _records(kind, range(options.first, options.first + share), options.seed, options.keep):
            counts["read"] += record.read
            counts["refused"] += record.refused
            broken += record.broken
            tried += record.tried
            _say(f"{kind}: {sum(counts.values())} of {share}, {len(broken)} broken in all")
        _say("")
        print(f"{kind:<22} {share:>7} tried, {counts['read']:>6} read, {counts['refused']:>6} refused by name, "
              f"{sum(each.kind == kind for each in broken)} broken", flush=True)
    print(f"{tried} cases of {len(chosen)} kinds in {time.monotonic() - start:.0f} s; {len(broken)} broken.")
    for each in broken[:_SHOWN]:
        print(f"{each.file}\n{each.how}")
    return 1 if broken else 0


def _options(arguments: list[str] | None) -> Any:
    parser = argparse.ArgumentParser("reports.fuzz", description=__doc__)
    parser.add_argument("--cases", type=int, default=100_000, help="in all, shared out evenly among the kinds")
    parser.add_argument("--kind", choices=list(kinds()), help="only this one")
    parser.add_argument("--first", type=int, default=0, help="number of the first case of each kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, default=Path("out/fuzz"), help="folder for what broke something")
    return parser.parse_args(arguments)


def _records(kind: str, numbers: range, seed: int, keep: Path) -> Iterator[FuzzRecord]:
    """Yield a record per batch; where a process died, one for that case, and the rest of its batch is tried again."""
    kinds()[kind].samples()  # made once, here
    batches = [numbers[at : at + _BATCH] for at in range(0, len(numbers), _BATCH)]
    while batches:
        batch = batches.pop(0)
        record, last, status = _in_child(kind, batch, seed, keep)
        if record is None:
            at = batch.index(last)
            batches[:0] = [part for part in (batch[:at], batch[at + 1 :]) if part]
            record = _died(kind, last, seed, keep, status)
        yield record


def _in_child(kind: str, batch: range, seed: int, keep: Path) -> tuple[FuzzRecord | None, int, int | None]:
    """Try a batch in a process; return its record (None: it died), the last case that it began, and how it ended."""
    context = get_context("fork")
    at = context.Value("q", batch[0])
    receiver, sender = context.Pipe(duplex=False)
    child = context.Process(target=_try, args=(kind, batch, seed, keep, sender, at))
    child.start()
    sender.close()
    record = _received(receiver)
    child.join()
    return record, at.value, child.exitcode


def _try(kind: str, batch: range, seed: int, keep: Path, sender: Any, at: Any) -> None:
    def begin(number: int) -> None:
        at.value = number

    sender.send(fuzz(kind, batch, seed, keep, begin=begin))
    sender.close()


def _received(receiver: Any) -> FuzzRecord | None:
    try:
        found: FuzzRecord = receiver.recv()
    except EOFError:
        return None
    return found


def _died(kind: str, number: int, seed: int, keep: Path, status: int | None) -> FuzzRecord:
    name, content = case(kinds()[kind], seed, number)
    how = f"the process ended with {status}"
    broken = Broken(kind, number, seed, how, kept(keep, kind, number, name, content, how))
    return FuzzRecord(kind, 1, 0, 0, (broken,), how)


_say: Callable[[str], None] = (
    (lambda text: print(f"\r{text:<80}", end="\r", file=sys.stderr, flush=True))
    if sys.stderr.isatty() else (lambda text: None)
)  # fmt: skip

if __name__ == "__main__":
    sys.exit(main())
