"""kill -9 at a random moment of a writer that stores run after run."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import numpy as np

from reports.faults.sample import in_child, inputs_of, numbered, open_store, sample_run, whole
from reports.store.care import DAMAGED, check_store

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
