"""What may happen to a store, and commands killed while they write: nothing finished is lost, nothing foreign changes.

Each fault is `fault(folder, rng)`, done once; an assertion fails if the store does not survive it. Commands are killed
in a tree of other people's files. A kill is survived if no result is damaged, no finished one is gone, and the hash of
the foreign tree is as before. The same command goes on in what the kill left, and is killed again; what it comes to in
the end has the content of a run that nobody disturbed. A kill counts where the command was still running. The commands
start in a process that has imported iapb and loaded its kernels, and runs write parts early and often: a kill meets
their writing.
"""

import hashlib
import os
import resource
import shutil
import signal
import time
from contextlib import chdir, redirect_stderr, redirect_stdout, suppress
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from iapb.errors import IapbError, RunFileError
from reports import streaming
from reports.cli import main
from reports.store import content_hash, read_run
from reports.store.care import DAMAGED, WHOLE, check_store, collect_garbage, garbage, is_run
from reports.store.io import mark_store, sealed
from reports.store.runs import read_entry, store_run
from tests.robustness.samples import TIMES, numbered, open_store, put, sample_run

pytestmark = pytest.mark.thorough

LONGEST = 0.25  # [s]: a dozen runs are stored in that time
RUNS = 3  # of each of two writers
OWN = "own"  # folder of a command's results, in the foreign tree
STUDY = """\
name: killed
title: Killed
scene: peg_corner
worlds: [IAPB]
values: {duration: 1.0}
grid:
  contact.friction: [0.0, 0.2, 0.4]
"""
FOREIGN = ("thesis.h5", "big.iso.partial", "notes.txt", "mine-0123456789abcdef.h5", ".x.h5.1.writing",
           f"{OWN}/thesis.h5", f"{OWN}/run.h5.parts/00000001.part", f"{OWN}/y.h5.2.writing",
           f"{OWN}/z.h5.partial")  # fmt: skip
COMMANDS = {
    "run": ("run", "peg_corner", "--set", "duration=60", "--resume", "--out", OWN),
    "sweep": ("sweep", "study.yaml", "--workers", "1", "--out", OWN),
    "reproduce": ("reproduce", "--figure", "fig07", "--out", OWN),
    "verify": ("verify", "--full", "--impacts", "20", "--trajectories", "1", "--workers", "1", "--out", OWN),
    "store gc": ("store", "gc", OWN, "--delete"),
}
OLDER, LEFT, STALE = 3, 1500, "stale-"  # files that gc finds: runs of older code, and what killed writers left
MOST_ATTEMPTS = 5  # per kill that counts


def must_have(folder, *numbers):
    """Check that the runs of these numbers are there as stored, and that no file is damaged."""
    for number in numbers:
        path = open_store(folder).place_of({"number": number}).path
        assert path.is_file() and content_hash(read_run(path)) == content_hash(numbered(number)), number
    assert not any(state.state == DAMAGED for state in check_store(folder))


def in_child(work, *arguments):
    """Start `work` in a process that shares what was simulated so far; return the process."""
    process = get_context("fork").Process(target=work, args=arguments)
    process.start()
    return process


def killed_writer(folder, rng):
    """Let a process write, kill it at a random moment, and look at what it had said was finished."""
    sample_run()
    writer = in_child(write_for_ever, folder)
    time.sleep(float(rng.uniform(0.0, LONGEST)))
    os.kill(writer.pid, signal.SIGKILL)
    writer.join()
    said = folder / "finished"
    must_have(folder, *(map(int, said.read_text().split()) if said.is_file() else ()))


def write_for_ever(folder):
    for number in range(10**9):
        put(folder, number)
        with (folder / "finished").open("a") as said:
            said.write(f"{number}\n")


def full_disk(folder, rng):
    """Store one run, then one under a limit of bytes that it exceeds at a random place."""
    limit, said = int(rng.uniform(0.0, 0.99) * put(folder).stat().st_size), folder / "said"

    def write_with_limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # a write past the limit fails, as on a full disk
        most = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, most))
        try:
            put(folder, 1)
        except (OSError, IapbError) as error:
            resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
            said.write_text(str(error))

    writer = in_child(write_with_limit)
    writer.join()
    must_have(folder, 0)
    assert writer.exitcode == 0 and said.is_file() and len(list(folder.glob("*.h5"))) == 1


def forbidden_folder(folder, rng):
    """Store into a folder that takes no files: a file is in its place."""
    (folder / "file").write_text("a file where the folder should be")
    with pytest.raises((OSError, IapbError)):
        put(folder / "file")


def rival_writers(folder, rng):
    """Two processes store the same runs; afterwards each run is there once, whole."""
    sample_run()
    writers = [in_child(lambda: [put(folder, number) for number in range(RUNS)] and None) for _ in range(2)]
    for writer in writers:
        writer.join()
        assert writer.exitcode == 0
    must_have(folder, *range(RUNS))
    assert {state.state for state in check_store(folder)} == {WHOLE} and len(open_store(folder).entries()) == RUNS


def collecting_writers(folder, rng):
    """Two processes write while another removes garbage without a pause, the files they write made old at once."""
    def collect_for_ever():
        while True:
            for path in folder.glob(".*.writing"):
                with suppress(OSError):
                    os.utime(path, (0.0, 0.0))  # as if the writer had been at it for years
            collect_garbage(garbage(folder))

    mark_store(folder)
    collector = in_child(collect_for_ever)
    try:
        rival_writers(folder, rng)
    finally:
        collector.kill()
        collector.join()


@pytest.mark.parametrize("fault", [killed_writer, full_disk, forbidden_folder, rival_writers, collecting_writers],
                         ids=lambda fault: fault.__name__)  # fmt: skip
def test_nothing_finished_is_lost(fault, tmp_path):
    rng = np.random.default_rng(0)
    for attempt in range(2 * TIMES):
        (tmp_path / str(attempt)).mkdir()
        fault(tmp_path / str(attempt), rng)


def call(words, folder):
    with chdir(folder), Path(os.devnull).open("w") as nowhere, redirect_stdout(nowhere), redirect_stderr(nowhere):
        return main(list(words))


def started(name, folder):
    """Start a command in a process of its own; return it after its first change of the folder, or at its end."""
    def work():
        os.setsid()
        streaming.HELD, streaming.PAUSE = 1 << 18, 0.05
        os._exit(call(COMMANDS[name], folder))

    def listing():
        return {f"{place}/{name}" for place, _, names in os.walk(folder / OWN) for name in names}

    before = listing()
    child = in_child(work)
    while child.exitcode is None and listing() == before:
        time.sleep(1e-3)
    return child


def make_foreign(folder):
    """Put other people's files, links and a study into a folder, and mark its subfolder as a store."""
    rng = np.random.default_rng(0)
    for name in FOREIGN:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(rng.bytes(2000))
        os.utime(path, (0.0, 0.0))
    (folder / "study.yaml").write_text(STUDY)
    (folder / OWN / "link.h5").symlink_to(folder / "thesis.h5")
    mark_store(folder / OWN)  # iapb store gc touches marked folders only


def foreign_hash(folder):
    """Hash of the foreign files, links and what they lead to."""
    digest = hashlib.sha256()
    for name in (*FOREIGN, "study.yaml", f"{OWN}/link.h5"):
        path = folder / name
        digest.update(name.encode() + bytes(path.is_symlink()) + (path.read_bytes() if path.is_file() else b"gone"))
    return digest.hexdigest()


def finished(folder):
    return {state.path for state in check_store(folder / OWN)
            if state.state == WHOLE and not state.path.name.startswith(STALE)}  # fmt: skip


def contents(folder):
    """Content hash of each finished run."""
    return {path.name: read_entry(path).content_hash for path in finished(folder) if is_run(path)}


@pytest.mark.parametrize("name", COMMANDS if TIMES > 1 else ["run", "sweep", "store gc"])
def test_a_killed_command_loses_nothing_and_touches_nothing_foreign(name, tmp_path):
    """Start a command, kill it at some moment after it first changed its folder, start it again in what is left."""
    def plant():
        """Put there what gc removes: runs of older code, and what writers left that were killed an hour ago."""
        for number in range(OLDER if garbage else 0):
            (own / f"{STALE}{number}.h5").write_bytes(garbage)
        for number in range(LEFT if garbage else 0):
            left = own / f".{STALE}{number}.h5.1.writing"
            left.write_bytes(sealed(b'{"format": "iapb part"'))  # whole: what is half written stays
            os.utime(left, (0.0, 0.0))

    def clear():
        for path in set(own.iterdir()) - kept:
            shutil.rmtree(path) if path.is_dir() else path.unlink()

    own, garbage, times = tmp_path / OWN, b"", -(-TIMES // 4)
    make_foreign(tmp_path)
    if name == "store gc":  # a run of the present code, which gc has to keep, and one of older code
        assert call(("run", "peg_corner", "--set", "duration=0.5", "--out", OWN), tmp_path) == 0
        store_run(tmp_path / "older.h5", read_run(*finished(tmp_path)), key="older", code="iapb older")
        garbage = (tmp_path / "older.h5").read_bytes()
    kept, before = set(own.iterdir()), foreign_hash(tmp_path)
    plant()
    assert call(COMMANDS[name], tmp_path) == 0, f"iapb {name} does not run"
    undisturbed = contents(tmp_path)
    clear()
    plant()
    child, began = started(name, tmp_path), time.monotonic()
    child.join()
    rest = time.monotonic() - began  # of an undisturbed command, after its first change
    clear()
    rng, count = np.random.default_rng(0), 0
    for _ in range(MOST_ATTEMPTS * times):
        if count == times:
            break
        plant()
        whole = finished(tmp_path)
        child = started(name, tmp_path)
        child.join(float(rng.uniform(0.0, rest)))
        if child.exitcode is None:
            os.killpg(child.pid, signal.SIGKILL)
            child.join()
        if child.exitcode != -signal.SIGKILL:  # it was done before
            assert not child.exitcode and contents(tmp_path) == undisturbed
            clear()
            continue
        count += 1
        assert whole <= finished(tmp_path) and foreign_hash(tmp_path) == before
        assert all(state.state != DAMAGED for state in check_store(own))
    assert count == times and call(COMMANDS[name], tmp_path) == 0 and contents(tmp_path) == undisturbed
    assert call(("store", "repair", OWN), tmp_path) == 0 and foreign_hash(tmp_path) == before


def test_a_change_of_a_foreign_file_and_a_writer_in_place_would_be_seen(tmp_path, monkeypatch):
    make_foreign(tmp_path)
    before = foreign_hash(tmp_path)
    (tmp_path / FOREIGN[-1]).unlink()
    assert foreign_hash(tmp_path) != before

    def careless(folder):
        """The planted fault: straight into the target, unsynced and unsealed, said to be finished beforehand."""
        with open_store(folder).place_of({"number": 0}, "sample").path.open("wb") as file:
            (folder / "finished").write_text("0\n")
            while True:
                file.write(b"\x89HDF\r\n\x1a\n" * 100)
                file.flush()
                time.sleep(1e-3)

    monkeypatch.setitem(globals(), "write_for_ever", careless)
    with pytest.raises((AssertionError, RunFileError)):
        for attempt in range(3):
            (tmp_path / str(attempt)).mkdir()
            killed_writer(tmp_path / str(attempt), np.random.default_rng(attempt))
