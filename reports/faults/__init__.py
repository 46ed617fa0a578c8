"""What may happen to a store of runs, done to it on purpose: `FAULTS` by name, each `fault(folder, times)`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path

from verification.finding import Failure, attempt


@dataclass(frozen=True)
class FaultRecord:
    """One kind of fault.

    tried : how often; survived : times after which all that had been finished was there, whole, and what was not
    whole was told or left no trace; lost : finished results that were gone or wrong afterwards
    said : what a user reads, the last of the messages
    """

    fault: str
    tried: int
    survived: int
    lost: int
    said: str


# name: module of reports.faults and its function (folder, times) -> FaultRecord
FAULTS: dict[str, tuple[str, str]] = {
    "kill -9 at a random moment": ("killed", "killed_writer"),
    "the disk is full": ("full_disk", "full_disk"),
    "a damaged byte": ("damage", "damaged_byte"),
    "a file that is no run": ("damage", "foreign_file"),
    "a file of another format version": ("damage", "other_version"),
    "two processes write one store": ("rivals", "rival_writers"),
    "a folder that cannot be written": ("full_disk", "forbidden_folder"),
}


def try_faults(
    folder: Path, times: int = 20, progress: Callable[[int, int], None] | None = None,
    failures: list[Failure] | None = None,
) -> tuple[FaultRecord, ...]:
    """Do every fault `times` times, each in a folder of its own below `folder`.

    `failures` receives the kinds that raise; without it that passes through.
    """
    records = []
    for done, (name, (module, function)) in enumerate(FAULTS.items(), start=1):
        place = folder / function
        place.mkdir(parents=True)
        do = getattr(import_module(f"{__name__}.{module}"), function)
        found = attempt(name, partial(do, place, times), failures)
        if found is not None:
            records.append(FaultRecord(name, *found))
        if progress is not None:
            progress(done, len(FAULTS))
    return tuple(records)
