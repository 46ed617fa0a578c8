"""The manifest: every file that the report was made from, its hashes, and the command that makes it again."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from reports.pages.records import StoredFile
from reports.runner import Runner
from reports.store_read import opened


def manifest(runner: Runner, tables: Iterable[Path], out: Path) -> tuple[StoredFile, ...]:
    """One line per run file used and per table file, in the order of use."""
    runs = [_line(label.rsplit(" ", 1)[0], path, out) for label, path in runner.used.items()]
    return tuple(runs + [_line(path.stem.rsplit("-", 1)[0], path, out) for path in tables])


def _line(name: str, path: Path, out: Path) -> StoredFile:
    with opened(path, expected_format=None) as file:
        attributes = dict(file.attrs)
    key = str(attributes.get("run_key", path.stem.rsplit("-", 1)[-1]))
    place = path.relative_to(out).as_posix()
    command = f"iapb inspect out/{place}" if "run_key" in attributes else "iapb reproduce"
    return StoredFile(name, place, key, str(attributes["content_hash"]), command, path.stat().st_size)
