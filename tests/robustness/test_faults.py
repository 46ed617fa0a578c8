"""What may happen to a store, and commands killed while they write: nothing finished is lost or
damaged.

Each fault is `fault(folder, rng)`, done once; an assertion fails if the store does not survive it.
A kill is survived if no result is damaged and no finished one is gone. The same command is started
again in what the kill left, and in the end has the content of a run that nobody disturbed.
"""

import os
import resource
import signal
import time
from contextlib import chdir, redirect_stderr, redirect_stdout
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from iapb.errors import IapbError
from reports.cli import main
from reports.store import content_hash, read_run
from reports.store.check import DAMAGED, WHOLE, check_store, is_run
from reports.store.runs import read_entry
from tests.robustness.samples import TIMES, numbered, open_store, put, sample_run

pytestmark = pytest.mark.thorough

LONGEST = 0.25  # [s]: a dozen runs are stored in that time
RUNS = 3  # of each of two writers
COMMANDS = {
    "run": ("run", "peg_corner", "--set", "duration=60", "--every", "7", "--out", "own"),
    "reproduce": ("reproduce", "--figure", "fig07", "--out", "own"),
}


def must_have(folder, *numbers):
    """Check that the runs of these numbers are there as stored, and that no file is damaged."""
    for number in numbers:
        path = open_store(folder).place_of({"number": number}).path
        assert path.is_file() and content_hash(read_run(path)) == content_hash(numbered(number)), (
            number
        )
    assert not any(state.state == DAMAGED for state in check_store(folder))


def in_child(work, *arguments):
    """Start `work` in a process that shares what was simulated so far; return the process."""
    process = get_context("fork").Process(target=work, args=arguments)
    process.start()
    return process


def killed_writer(folder, rng):
    """Let a process write, kill it at a random moment, and look at what it had said was
    finished."""
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
    limit = int(rng.uniform(0.0, 0.99) * put(folder).stat().st_size)
    said = folder / "said"

    def write_with_limit():
        # a write past the limit fails, as on a full disk
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
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


def rival_writers(folder, rng):
    """Two processes store the same runs; afterwards each run is there once, whole."""
    sample_run()
    writers = [
        in_child(lambda: [put(folder, number) for number in range(RUNS)] and None) for _ in range(2)
    ]
    for writer in writers:
        writer.join()
        assert writer.exitcode == 0
    must_have(folder, *range(RUNS))
    assert {state.state for state in check_store(folder)} == {WHOLE} and len(
        open_store(folder).entries()
    ) == RUNS


@pytest.mark.parametrize(
    "fault",
    [killed_writer, full_disk, rival_writers],
    ids=lambda fault: fault.__name__,
)
def test_nothing_finished_is_lost(fault, tmp_path):
    rng = np.random.default_rng(0)
    for attempt in range(2 * TIMES):
        (tmp_path / str(attempt)).mkdir()
        fault(tmp_path / str(attempt), rng)


def hashes(folder):
    """Content hash of each finished run; no file may be damaged."""
    states = check_store(folder)
    assert not any(state.state == DAMAGED for state in states)
    return {
        state.path.name: read_entry(state.path).content_hash
        for state in states
        if state.state == WHOLE and is_run(state.path)
    }


def call(words, folder):
    """Run a command silently in a folder, as a process group of its own, and end the process."""
    os.setsid()
    with (
        chdir(folder),
        Path(os.devnull).open("w") as nowhere,
        redirect_stdout(nowhere),
        redirect_stderr(nowhere),
    ):
        os._exit(main(list(words)))


@pytest.mark.parametrize("name", COMMANDS)
def test_a_killed_command_loses_nothing_finished_and_runs_again(name, tmp_path):
    def done(folder):
        folder.mkdir(exist_ok=True)
        return in_child(call, COMMANDS[name], folder)

    began = time.monotonic()
    child = done(tmp_path / "undisturbed")
    child.join()
    lasted = time.monotonic() - began
    undisturbed = hashes(tmp_path / "undisturbed")
    assert child.exitcode == 0 and undisturbed
    rng = np.random.default_rng(0)
    finished = {}
    for _ in range(2 + TIMES // 20):
        child = done(tmp_path / "killed")
        child.join(float(rng.uniform(0.1, lasted)))
        if child.exitcode is None:
            os.killpg(child.pid, signal.SIGKILL)
            child.join()
        found = hashes(tmp_path / "killed")
        assert finished.items() <= found.items() <= undisturbed.items()
        finished = found
    child = done(tmp_path / "killed")
    child.join()
    assert child.exitcode == 0 and hashes(tmp_path / "killed") == undisturbed
