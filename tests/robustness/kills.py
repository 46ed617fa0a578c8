"""Commands killed while they write, in a tree of other people's files: `killed_command(name, folder, times)`.

A kill is survived if no result is damaged, no finished one is gone, and the hash of the foreign tree is as before. The
same command goes on in what the kill left, and is killed again; what it comes to in the end has the content of a run
that nobody disturbed. A kill counts where the command was still running. The commands start in a process that has
imported iapb and loaded its kernels, and runs write parts early and often: a kill meets their writing, not imports.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import signal
import time
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from reports import streaming
from reports.cli import main
from reports.store.care import DAMAGED, WHOLE, check_store, is_run
from reports.store.io import mark_store, sealed
from reports.store.runs import read_entry, read_run, store_run

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
COMMANDS: dict[str, Sequence[str]] = {
    "run": ("run", "peg_corner", "--set", "duration=60", "--resume", "--out", OWN),
    "live": ("live", "peg_corner", "--seconds", "0.7", "--out", OWN),
    "sweep": ("sweep", "study.yaml", "--workers", "1", "--out", OWN),
    "reproduce": ("reproduce", "--figure", "fig07", "--out", OWN),
    "verify": ("verify", "--full", "--impacts", "20", "--trajectories", "1", "--workers", "1", "--out", OWN),
    "store gc": ("store", "gc", OWN, "--delete"),
}
_OLDER, _LEFT, _STALE = 3, 1500, "stale-"  # files that gc finds: runs of older code, and what killed writers left
_LIVE = re.compile(r"peg_corner-\d{8}T\d+\.h5")
_MOST_ATTEMPTS = 5  # per kill that counts


def killed_command(name: str, folder: Path, times: int) -> None:
    """Start a command, kill it at some moment after it first changed its folder, start it again in what is left."""
    make_foreign(folder)
    garbage = _garbage_and_a_run(folder) if name == "store gc" else b""
    kept, before = set((folder / OWN).iterdir()), foreign_hash(folder)
    _plant(folder, garbage)
    assert _call(COMMANDS[name], folder) == 0, f"iapb {name} does not run"
    contents = _contents(folder)
    _clear(folder, kept)
    _plant(folder, garbage)
    child, began = _started(name, folder), time.monotonic()
    child.join()
    rest = time.monotonic() - began  # of an undisturbed command, after its first change
    _clear(folder, kept)
    rng, count = np.random.default_rng(0), 0
    for _ in range(_MOST_ATTEMPTS * times):
        if count == times:
            break
        _plant(folder, garbage)
        finished = _finished(folder)
        child = _started(name, folder)
        child.join(float(rng.uniform(0.0, rest)))
        if child.exitcode is None:
            os.killpg(child.pid, signal.SIGKILL)
            child.join()
        if child.exitcode != -signal.SIGKILL:  # it was done before
            assert not child.exitcode and _contents(folder) == contents
            _clear(folder, kept)
            continue
        count += 1
        assert finished <= _finished(folder) and foreign_hash(folder) == before
        assert all(state.state != DAMAGED for state in check_store(folder / OWN))
    assert count == times and _call(COMMANDS[name], folder) == 0 and _contents(folder) == contents
    assert _call(("store", "repair", OWN), folder) == 0 and foreign_hash(folder) == before


def _call(words: Sequence[str], folder: Path) -> int:
    before = Path.cwd()
    os.chdir(folder)
    try:
        with Path(os.devnull).open("w") as nowhere, redirect_stdout(nowhere), redirect_stderr(nowhere):
            return main(list(words))
    finally:
        os.chdir(before)


def _started(name: str, folder: Path) -> Any:
    """Start a command in a process of its own; return it after its first change of the folder, or at its end."""
    before = _listing(folder)
    child = get_context("fork").Process(target=_child, args=(name, folder))
    child.start()
    while child.exitcode is None and _listing(folder) == before:
        time.sleep(1e-3)
    return child


def _child(name: str, folder: Path) -> None:
    os.setsid()
    streaming.HELD, streaming.PAUSE = 1 << 18, 0.05
    os._exit(_call(COMMANDS[name], folder))


def _listing(folder: Path) -> set[str]:
    return {f"{place}/{name}" for place, _, names in os.walk(folder / OWN) for name in names}


def make_foreign(folder: Path) -> None:
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


def foreign_hash(folder: Path) -> str:
    """Hash of the foreign files, links and what they lead to."""
    digest = hashlib.sha256()
    for name in (*FOREIGN, "study.yaml", f"{OWN}/link.h5"):
        path = folder / name
        digest.update(name.encode() + bytes(path.is_symlink()) + (path.read_bytes() if path.is_file() else b"gone"))
    return digest.hexdigest()


def _garbage_and_a_run(folder: Path) -> bytes:
    """Store a run of the present code, which gc has to keep; return one of older code."""
    assert _call(("run", "peg_corner", "--set", "duration=0.5", "--out", OWN), folder) == 0
    [kept] = _finished(folder)
    store_run(folder / "older.h5", read_run(kept), key="older", code="iapb older")
    return (folder / "older.h5").read_bytes()


def _plant(folder: Path, garbage: bytes) -> None:
    """Put there what gc removes: runs of older code, and what writers left that were killed an hour ago."""
    for number in range(_OLDER if garbage else 0):
        (folder / OWN / f"{_STALE}{number}.h5").write_bytes(garbage)
    for number in range(_LEFT if garbage else 0):
        left = folder / OWN / f".{_STALE}{number}.h5.1.writing"
        left.write_bytes(sealed(b'{"format": "iapb part"'))  # whole: what is half written stays
        os.utime(left, (0.0, 0.0))


def _clear(folder: Path, kept: set[Path]) -> None:
    for path in set((folder / OWN).iterdir()) - kept:
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()


def _finished(folder: Path) -> set[Path]:
    return {state.path for state in check_store(folder / OWN)
            if state.state == WHOLE and not state.path.name.startswith(_STALE)}  # fmt: skip


def _contents(folder: Path) -> dict[str, str]:
    """Content hash of each finished run; live ones have the time in their name, and are never the same."""
    return {path.name: read_entry(path).content_hash for path in _finished(folder)
            if is_run(path) and not _LIVE.fullmatch(path.name)}  # fmt: skip
