"""What may happen to a store of runs, done to it on purpose: `FAULTS` by name, each `fault(folder, times)`.

    python -m tests.robustness.faults --times 120      (part of make fuzz)
"""

from __future__ import annotations

import argparse
import os
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, partial
from math import inf
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import IapbError, RunFileError
from iapb.run import Run
from reports.store import RunStore
from reports.store.care import DAMAGED, WHOLE, check_store, collect_garbage, garbage
from reports.store.io import mark_store, sealed
from reports.store.keys import content_hash
from reports.store.runs import read_run
from reports.store.schema import FORMAT_VERSION
from tests.robustness.kills import KILLS


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


@cache
def sample_run() -> Run:
    """The run itself, simulated once per process."""
    from iapb import find_scene, load_scene
    from reference.worlds import run_world

    return run_world(load_scene(find_scene("peg_corner")).with_values({"duration": 0.4}), "IAPB")


def numbered(number: int) -> Run:
    """A run that differs from the others in its results."""
    run = sample_run()
    return replace(run, q=run.q + float(number))


def inputs_of(number: int) -> dict[str, Any]:
    """What the store files it under."""
    return {"number": number}


def open_store(folder: Path) -> RunStore:
    """A store whose keys do not depend on the code: hashing that takes longer than what is tried here."""
    return RunStore(folder, code="faults")


def whole(store: RunStore, number: int) -> bool:
    """Whether the run of that number is there and is what was stored."""
    path = store.place_of(inputs_of(number)).path
    return path.is_file() and content_hash(read_run(path)) == content_hash(numbered(number))


def in_child(work: Callable[..., None], *arguments: Any) -> Any:
    """Start `work` in a process that shares what was simulated so far; return the process."""
    process = get_context("fork").Process(target=work, args=arguments)
    process.start()
    return process


_FINISHED = "finished"
_LONGEST = 0.25  # [s]: a dozen runs are stored in that time


def killed_writer(folder: Path, times: int) -> tuple[int, int, int, str]:
    """Let a process write, kill it, and look at what it had said was finished."""
    sample_run()
    rng, survived, lost = np.random.default_rng(0), 0, 0
    for attempt in range(times):
        store = open_store(folder / str(attempt))
        writer = in_child(_write_for_ever, folder / str(attempt))
        time.sleep(float(rng.uniform(0.0, _LONGEST)))
        os.kill(writer.pid, signal.SIGKILL)
        writer.join()
        said = folder / str(attempt) / _FINISHED
        finished = [int(line) for line in said.read_text().split()] if said.is_file() else []
        gone = sum(not whole(store, number) for number in finished)
        broken = sum(state.state == DAMAGED for state in check_store(store.folder))
        lost += gone
        survived += gone == 0 and broken == 0
    return times, survived, lost, "nothing: the process is gone; the next one goes on"


def _write_for_ever(folder: Path) -> None:
    store = open_store(folder)
    number = 0
    while True:
        store.put(inputs_of(number), numbered(number), "sample")
        with (folder / _FINISHED).open("a") as said:
            said.write(f"{number}\n")
        number += 1


def full_disk(folder: Path, times: int) -> tuple[int, int, int, str]:
    """Store one run, then one under a limit of bytes that it exceeds at a random place."""
    sample_run()
    store = open_store(folder)
    size = store.put(inputs_of(0), numbered(0), "sample").stat().st_size
    rng, survived, lost, last = np.random.default_rng(1), 0, 0, ""
    for number in range(1, times + 1):
        receiver, sender = get_context("fork").Pipe(duplex=False)
        writer = in_child(_write_with_limit, folder, number, int(rng.uniform(0.0, 0.99) * size), sender)
        writer.join()
        told = receiver.recv() if receiver.poll() else ""
        kept, half = whole(store, 0), store.place_of(inputs_of(number)).path.exists()
        broken = any(state.state == DAMAGED for state in check_store(folder))
        lost += not kept
        survived += kept and not half and not broken and bool(told) and writer.exitcode == 0
        last = told or last
    return times, survived, lost, last.replace(str(folder), "out")


def _write_with_limit(folder: Path, number: int, limit: int, sender: Any) -> None:
    """Store a run with at most `limit` bytes per file; tell the error, or "" where there was none."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # a write past the limit fails, as on a full disk
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))
    try:
        open_store(folder).put(inputs_of(number), numbered(number), "sample")
    except (OSError, IapbError) as error:
        sender.send(str(error))
    sender.close()


def forbidden_folder(folder: Path, times: int) -> tuple[int, int, int, str]:
    """Store into folders that take no files: one without leave to write, and one that is a file."""
    survived, last = 0, ""
    for number in range(times):
        try:
            open_store(_forbidden(folder, number)).put(inputs_of(0), numbered(0), "sample")
        except (OSError, IapbError) as error:
            survived, last = survived + 1, str(error)
    return times, survived, 0, last.replace(str(folder), "out")


def _forbidden(folder: Path, number: int) -> Path:
    """A folder that refuses files, also to root, whom permissions do not stop."""
    place = folder / str(number)
    if number % 2 or os.geteuid() == 0:
        place.write_text("a file where the folder should be")
    else:
        place.mkdir(mode=0o500)
    return place


def damaged_byte(folder: Path, times: int) -> tuple[int, int, int, str]:
    """Flip a random bit of a random byte; reading must refuse, or give the results unchanged."""
    path, content = _stored(folder)
    right, rng = content_hash(read_run(path)), np.random.default_rng(2)
    survived, said = 0, ""
    for _ in range(times):
        damaged = bytearray(content)
        damaged[int(rng.integers(len(damaged)))] ^= 1 << int(rng.integers(8))
        path.write_bytes(bytes(damaged))
        try:
            survived += content_hash(read_run(path)) == right
        except RunFileError as error:
            survived, said = survived + 1, _told(error, path)
    return times, survived, times - survived, said


def foreign_file(folder: Path, times: int) -> tuple[int, int, int, str]:
    """Files that are no runs, of every kind in turn; each must be refused by name."""
    path, content = _stored(folder)
    kinds = list(_foreign(content))
    return _refused(path, [kinds[k % len(kinds)] for k in range(times)])


def _foreign(content: bytes) -> Iterator[Callable[[Path], None]]:
    """Nothing, a table, half of a run, its first bytes, a run with a tail, somebody else's HDF5."""
    for wrong in (b"", b"time,x\n0,1\n", content[: len(content) // 2], content[:8], content + b"tail"):
        yield partial(_put, wrong)
    yield _somebody_elses


def _put(content: bytes, path: Path) -> None:
    path.write_bytes(content)


def _somebody_elses(path: Path) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file["x"] = np.arange(3.0)
    path.write_bytes(sealed(path.read_bytes()))


def other_version(folder: Path, times: int) -> tuple[int, int, int, str]:
    """Files of older and of newer format versions."""
    path, content = _stored(folder)
    versions = [v for v in range(1, 2 + FORMAT_VERSION) if v != FORMAT_VERSION]
    return _refused(path, [partial(_with_version, content, versions[k % len(versions)]) for k in range(times)])


def _with_version(content: bytes, version: int, path: Path) -> None:
    import h5py

    path.write_bytes(content)
    with h5py.File(path, "a") as file:
        file.attrs["format_version"] = version
    path.write_bytes(sealed(path.read_bytes()))


def _refused(path: Path, makers: list[Callable[[Path], None]]) -> tuple[int, int, int, str]:
    survived, said = 0, ""
    for make in makers:
        make(path)
        try:
            read_run(path)
        except RunFileError as error:
            survived, said = survived + (path.name in str(error)), _told(error, path)
    return len(makers), survived, len(makers) - survived, said


def _stored(folder: Path) -> tuple[Path, bytes]:
    path = open_store(folder).put(inputs_of(0), numbered(0), "sample")
    return path, path.read_bytes()


def _told(error: RunFileError, path: Path) -> str:
    return str(error).replace(str(path), path.name)


_RUNS = 3  # per attempt


def rival_writers(folder: Path, times: int) -> tuple[int, int, int, str]:
    """Both store the same runs; afterwards each run is there once, whole, and in the index once."""
    sample_run()
    survived, lost = 0, 0
    for attempt in range(times):
        place = folder / str(attempt)
        store = open_store(place)
        writers = [in_child(_write_three, place) for _ in range(2)]
        for writer in writers:
            writer.join()
        missing = sum(not whole(store, number) for number in range(_RUNS))
        sound = {state.state for state in check_store(place)} == {WHOLE} and len(store.entries()) == _RUNS
        lost += missing
        survived += missing == 0 and sound and all(writer.exitcode == 0 for writer in writers)
    return times, survived, lost, "nothing: the first to finish wins, the other finds the run there"


def _write_three(folder: Path) -> None:
    store = open_store(folder)
    for number in range(_RUNS):
        store.put(inputs_of(number), numbered(number), "sample")


def collecting_writers(folder: Path, times: int) -> tuple[int, int, int, str]:
    """Two processes write while another removes garbage without a pause, the files they write made old at once."""
    sample_run()
    survived, lost = 0, 0
    for attempt in range(times):
        place = folder / str(attempt)
        store = open_store(place)
        mark_store(place)
        collector = in_child(_collect_for_ever, place)
        writers = [in_child(_write_three, place) for _ in range(2)]
        for writer in writers:
            writer.join()
        os.kill(collector.pid, signal.SIGKILL)
        collector.join()
        missing = sum(not whole(store, number) for number in range(_RUNS))
        lost += missing
        survived += missing == 0 and all(writer.exitcode == 0 for writer in writers)
    return times, survived, lost, "nothing: what is written is locked, and gc passes it over"


def _collect_for_ever(folder: Path) -> None:
    while True:
        for path in folder.glob(".*.writing"):
            with suppress(OSError):
                os.utime(path, (0.0, 0.0))  # as if the writer had been at it for years
        collect_garbage(garbage(folder))


# name -> (folder, times) -> tried, survived, lost, said
FAULTS: dict[str, Callable[[Path, int], tuple[int, int, int, str]]] = {
    "kill -9 at a random moment": killed_writer,
    "the disk is full": full_disk,
    "a damaged byte": damaged_byte,
    "a file that is no run": foreign_file,
    "a file of another format version": other_version,
    "two processes write one store": rival_writers,
    "a folder that cannot be written": forbidden_folder,
    "gc --delete without a pause": collecting_writers,
}


def try_faults(
    folder: Path, times: int, faults: Mapping[str, Callable[[Path, int], tuple[int, int, int, str]]] = FAULTS,
    jobs: int = 1,
) -> tuple[FaultRecord, ...]:
    """Do every fault `times` times, each in a folder of its own below `folder`, `jobs` faults at once."""
    with ProcessPoolExecutor(jobs, get_context("fork")) as pool:
        tried = [pool.submit(_tried, name, fault, folder / str(number), times)
                 for number, (name, fault) in enumerate(faults.items())]
        return tuple(each.result() for each in tried)


def _tried(name: str, fault: Callable[[Path, int], tuple[int, int, int, str]], folder: Path, times: int) -> FaultRecord:
    folder.mkdir(parents=True)
    one = FaultRecord(name, *fault(folder, times))
    print(f"{name:<34} {one.tried:>5} tried, {one.survived:>5} survived, {one.lost} lost: {one.said}", flush=True)
    return one


def main() -> int:
    """Try the faults; return 0 if all were survived, else 1."""
    parser = argparse.ArgumentParser(prog="python -m tests.robustness.faults", description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=120, help="how often each fault is done")
    parser.add_argument("--kills", type=int, default=102, help="how often a command is killed, in all")
    parser.add_argument("--jobs", type=int, default=1, help="faults that are done at once")
    parser.add_argument("--seconds", type=float, default=inf, help="after which a command is killed no more")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        kills = {name: partial(kill, seconds=given.seconds) for name, kill in KILLS.items()}
        records = try_faults(Path(folder) / "commands", -(-given.kills // len(KILLS)), kills, given.jobs)
        records = try_faults(Path(folder) / "store", given.times, jobs=given.jobs) + records
    return int(any(one.survived < one.tried or one.lost for one in records))


if __name__ == "__main__":
    sys.exit(main())
