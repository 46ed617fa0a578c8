"""Files that are either there and whole, or not there: write aside, fsync, then rename."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

WRITING = ".writing"  # ends the name of a file that is not yet whole
# A write takes seconds; what is older than this was left by a writer that was killed.
_ABANDONED_AFTER_SECONDS = 3600.0


def sync(path: Path) -> None:
    """Make sure that a file, or the entries of a folder, are on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def written_aside(target: Path, *, replace: bool) -> Iterator[Path]:
    """Give a path to write to; afterwards move it to `target` in one step.

    A crash at any moment leaves `target` as it was. With ``replace=False`` a target that exists by then
    stays, and what was written aside is dropped: the first of two writers wins.
    """
    aside = target.with_name(f".{target.name}.{os.getpid()}{WRITING}")
    try:
        yield aside
        sync(aside)
        if replace:
            os.replace(aside, target)
        else:
            _move_if_absent(aside, target)
        sync(target.parent)
    finally:
        aside.unlink(missing_ok=True)


def _move_if_absent(aside: Path, target: Path) -> None:
    try:
        os.link(aside, target)  # fails when the target exists, unlike a rename
    except FileExistsError:
        return
    except OSError:  # a file system without hard links
        if not target.exists():
            os.rename(aside, target)


def remove_abandoned(folder: Path) -> None:
    """Remove what killed writers left in `folder`; files of writers still at work are younger."""
    for path in folder.glob(f".*{WRITING}"):
        with suppress(FileNotFoundError):
            if time.time() - path.stat().st_mtime > _ABANDONED_AFTER_SECONDS:
                path.unlink()
