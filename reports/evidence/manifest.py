"""The manifest: every file that the report was made from, its hashes, and the command that reproduces it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from reports.evidence.stage import Stage
from reports.pages.records import StoredFile
from reports.provenance import machine_of
from reports.store.io import opened
from reports.store.runs import read_provenance
from reports.uses import UsedRun

ABSENT = "absent"  # a run that a stage was made from, whose file has been removed since
UNNAMED = "the report"  # the user of a run that no claim, topic or figure requested
TABLE_COMMAND = "iapb reproduce"


def manifest(used: Mapping[str, UsedRun], stages: Iterable[Stage], out: Path) -> tuple[StoredFile, ...]:
    """Return one line per used run file and per table file, in the order of use; paths are relative to `out`."""
    runs = [_run(run, out) for run in used.values()]
    return tuple(runs + [_table(stage, out) for stage in stages])


def _run(run: UsedRun, out: Path) -> StoredFile:
    path = out / "runs" / run.file
    status = run.status if path.is_file() else ABSENT
    place, users = f"runs/{run.file}", run.used_by or (UNNAMED,)
    made_on = "" if status == ABSENT else machine_of(read_provenance(path))
    return StoredFile(run.name, place, run.key, run.content_hash, run.command, run.size, users, status, made_on)


def _table(stage: Stage, out: Path) -> StoredFile:
    with opened(stage.path, expected_format=None) as file:
        content = str(file.attrs["content_hash"])
    place, name = stage.path.relative_to(out).as_posix(), stage.name.replace("_", " ")
    made_on = machine_of(read_provenance(stage.path))
    return StoredFile(name, place, stage.key, content, TABLE_COMMAND, stage.path.stat().st_size, made_on=made_on)
