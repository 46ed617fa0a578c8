"""No room, or no leave, to write: the process gets no more bytes than a limit, or a folder that refuses files."""

from __future__ import annotations

import os
import resource
import signal
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import IapbError
from reports.faults.sample import in_child, inputs_of, numbered, open_store, sample_run, whole
from reports.store.care import DAMAGED, check_store


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
        kept, half = whole(store, 0), store.path_of(inputs_of(number)).exists()
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
