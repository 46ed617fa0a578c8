"""What may happen to a store of runs, done to it on purpose: `FAULTS` by name, each `fault(folder, rng)`, done once.

If the store does not survive a fault, an assertion fails.
"""

from __future__ import annotations

import os
import resource
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest

from iapb import find_scene, load_scene
from iapb.errors import IapbError
from iapb.run import Run
from reference.worlds import run_world
from reports.store import RunStore, content_hash, read_run
from reports.store.care import DAMAGED, WHOLE, check_store, collect_garbage, garbage
from reports.store.io import mark_store
from tests.robustness.damage import Rng

_FINISHED, _LONGEST = "finished", 0.25  # [s]: a dozen runs are stored in that time
_RUNS = 3  # of each of two writers


@cache
def sample_run() -> Run:
    """The run itself, simulated once per process."""
    return run_world(load_scene(find_scene("peg_corner")).with_values({"duration": 0.4}), "IAPB")


def numbered(number: int) -> Run:
    """A run that differs from the others in its results."""
    run = sample_run()
    return replace(run, q=run.q + float(number))


def open_store(folder: Path) -> RunStore:
    """A store whose keys do not depend on the code: hashing that takes longer than what is tried here."""
    return RunStore(folder, code="faults")


def put(folder: Path, number: int = 0) -> Path:
    """Store the run of that number."""
    return open_store(folder).put({"number": number}, numbered(number), "sample")


def must_have(folder: Path, *numbers: int) -> None:
    """Check that the runs of these numbers are there as stored, and that no file is damaged."""
    for number in numbers:
        path = open_store(folder).place_of({"number": number}).path
        assert path.is_file() and content_hash(read_run(path)) == content_hash(numbered(number)), number
    assert not any(state.state == DAMAGED for state in check_store(folder))


def in_child(work: Callable[..., None], *arguments: Any) -> Any:
    """Start `work` in a process that shares what was simulated so far; return the process."""
    process = get_context("fork").Process(target=work, args=arguments)
    process.start()
    return process


def killed_writer(folder: Path, rng: Rng) -> None:
    """Let a process write, kill it at a random moment, and look at what it had said was finished."""
    sample_run()
    writer = in_child(write_for_ever, folder)
    time.sleep(float(rng.uniform(0.0, _LONGEST)))
    os.kill(writer.pid, signal.SIGKILL)
    writer.join()
    said = folder / _FINISHED
    must_have(folder, *(map(int, said.read_text().split()) if said.is_file() else ()))


def write_for_ever(folder: Path) -> None:
    for number in range(10**9):
        put(folder, number)
        with (folder / _FINISHED).open("a") as said:
            said.write(f"{number}\n")


def full_disk(folder: Path, rng: Rng) -> None:
    """Store one run, then one under a limit of bytes that it exceeds at a random place."""
    limit = int(rng.uniform(0.0, 0.99) * put(folder).stat().st_size)
    said = folder / "said"
    writer = in_child(_write_with_limit, folder, limit, said)
    writer.join()
    must_have(folder, 0)
    assert writer.exitcode == 0 and said.is_file() and len(list(folder.glob("*.h5"))) == 1


def _write_with_limit(folder: Path, limit: int, said: Path) -> None:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # a write past the limit fails, as on a full disk
    most = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, most))
    try:
        put(folder, 1)
    except (OSError, IapbError) as error:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
        said.write_text(str(error))


def forbidden_folder(folder: Path, rng: Rng) -> None:
    """Store into a folder that takes no files: a file is in its place."""
    (folder / "file").write_text("a file where the folder should be")
    with pytest.raises((OSError, IapbError)):
        put(folder / "file")


def rival_writers(folder: Path, rng: Rng) -> None:
    """Two processes store the same runs; afterwards each run is there once, whole."""
    _with_two_writers(folder)
    assert {state.state for state in check_store(folder)} == {WHOLE} and len(open_store(folder).entries()) == _RUNS


def collecting_writers(folder: Path, rng: Rng) -> None:
    """Two processes write while another removes garbage without a pause, the files they write made old at once."""
    mark_store(folder)
    collector = in_child(_collect_for_ever, folder)
    try:
        _with_two_writers(folder)
    finally:
        collector.kill()
        collector.join()


def _with_two_writers(folder: Path) -> None:
    sample_run()
    writers = [in_child(lambda: [put(folder, number) for number in range(_RUNS)] and None) for _ in range(2)]
    for writer in writers:
        writer.join()
        assert writer.exitcode == 0
    must_have(folder, *range(_RUNS))


def _collect_for_ever(folder: Path) -> None:
    while True:
        for path in folder.glob(".*.writing"):
            with suppress(OSError):
                os.utime(path, (0.0, 0.0))  # as if the writer had been at it for years
        collect_garbage(garbage(folder))


FAULTS: dict[str, Callable[[Path, Rng], None]] = {
    "kill -9 at a random moment": killed_writer,
    "the disk is full": full_disk,
    "two processes write one store": rival_writers,
    "a folder that cannot be written": forbidden_folder,
    "gc --delete without a pause": collecting_writers,
}
