"""Commands killed at random moments, in a tree of other people's files: `KILLS` by name, each `fault(folder, times)`.

Part of `python -m tests.robustness.faults`. A kill is survived if no result is damaged, no finished one is gone, and
the hash of the foreign tree is as before; at the end each command must come to its end.
"""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from reports.store.care import DAMAGED, WHOLE, check_store
from reports.store.io import mark_store

ROOT = Path(__file__).resolve().parents[2]
OWN = "own"  # folder of a command's results, in the foreign tree
STUDY = """\
name: killed
title: Killed
scene: peg_corner
worlds: [IAPB]
values: {duration: 2.0}
grid:
  contact.friction: [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]
"""
FOREIGN = ("thesis.h5", "big.iso.partial", "notes.txt", "mine-0123456789abcdef.h5", ".x.h5.1.writing",
           f"{OWN}/thesis.h5", f"{OWN}/log.h5.log", f"{OWN}/y.h5.2.writing", f"{OWN}/z.h5.partial")  # fmt: skip
COMMANDS: dict[str, Sequence[str]] = {
    "run": ("run", "peg_corner", "--set", "duration=400", "--resume", "--out", OWN),
    "live": ("live", "peg_corner", "--seconds", "2", "--out", OWN),
    "sweep": ("sweep", "study.yaml", "--workers", "2", "--out", OWN),
    "reproduce": ("reproduce", "--figure", "fig02", "--out", OWN),
    "verify": ("verify", "--full", "--impacts", "300", "--trajectories", "2", "--out", OWN),
    "store gc": ("store", "gc", OWN, "--delete"),
}


def killed_command(name: str, folder: Path, times: int) -> tuple[int, int, int, str]:
    """Start a command and kill it with its children within the time that it takes undisturbed."""
    _make_foreign(folder)
    mark_store(folder / OWN)  # iapb store gc touches marked folders only
    before, rng, survived, lost = foreign_hash(folder), np.random.default_rng(0), 0, 0
    began = time.monotonic()
    assert _start(name, folder).wait() == 0, f"iapb {name} does not run"
    longest = time.monotonic() - began
    for _ in range(times):
        finished = _finished(folder)
        if name in ("run", "sweep"):  # and not read from its file
            for path in finished:
                path.unlink()
            finished = set()
        process = _start(name, folder)
        time.sleep(float(rng.uniform(0.2, 1.0)) * longest)
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        gone = len(finished - _finished(folder))
        damaged = sum(state.state == DAMAGED for state in check_store(folder / OWN))
        lost += gone
        survived += gone == 0 and damaged == 0 and foreign_hash(folder) == before
    ended = _start(name, folder).wait()
    return times, survived if ended == 0 else 0, lost, "nothing: the process is gone; the next one goes on"


def _make_foreign(folder: Path) -> None:
    rng = np.random.default_rng(0)
    for name in FOREIGN:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(rng.bytes(2000))
        os.utime(path, (0.0, 0.0))
    (folder / "study.yaml").write_text(STUDY)
    (folder / OWN / "link.h5").symlink_to(folder / "thesis.h5")


def foreign_hash(folder: Path) -> str:
    """Hash of the foreign files, links and what they lead to."""
    digest = hashlib.sha256()
    for name in (*FOREIGN, "study.yaml", f"{OWN}/link.h5"):
        path = folder / name
        digest.update(name.encode() + bytes(path.is_symlink()) + (path.read_bytes() if path.is_file() else b"gone"))
    return digest.hexdigest()


def _finished(folder: Path) -> set[Path]:
    return {state.path for state in check_store(folder / OWN) if state.state == WHOLE}


def _start(name: str, folder: Path) -> subprocess.Popen[bytes]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen([sys.executable, "-m", "reports.cli", *COMMANDS[name]], cwd=folder, env=environment,
                            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)  # fmt: skip


# name -> (folder, times) -> tried, survived, lost, said
KILLS: dict[str, Callable[[Path, int], tuple[int, int, int, str]]] = {
    f"kill -9 of iapb {name}": partial(killed_command, name) for name in COMMANDS
}
