"""A stage of the evidence: records that are computed once and then read from their file.

The file holds the tables of a record as typed columns, and everything else as JSON text. The file's name contains a
hash of what determines the records: the stage's inputs, the sources of the engine, the references and the verification,
the scenes, the processor, the BLAS kernel and the optional code of numpy, and the declared external dependencies. If
any of them changes, the stage is computed again; a change of the report's own code does not cause that. Because the
machine is part of the hash, numbers of two machines are never mixed. The file also lists the runs behind the records.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from reports.provenance import collect_provenance, this_machine
from reports.runner import Runner
from reports.store.io import mark_store
from reports.store.keys import SOURCES, evidence_version, hash_of, plain
from reports.store.tables import (
    Column,
    Table,
    columns_of,
    finding_table,
    read_tables,
    safe_name,
    write_tables,
)
from reports.uses import UsedRun, add_use
from verification import finding
from verification.finding import Failure

_RECORDS, _RUNS = "records", "runs used"
_LAYOUT = 2  # of the files: 1 had the rows of tables in the JSON as well


class Stage:
    """The file that stores the records of one topic.

    Parameters
    ----------
    folder : folder of the table files.
    name : name of the topic; the file's name starts with it.
    kind : the type of the records, such as ``tuple[Claim, ...]``.
    inputs : what determines the records besides the code.
    depends : external dependencies of the records by name, such as files outside of the project.

    Attributes
    ----------
    runs : the runs that the records were made from, by file; empty until the records are computed or read.
    failures : the cases that raised. If there are any, the records are written to a file named "incomplete", which
        later calls do not read, so that they compute the stage again.
    """

    def __init__(
        self, folder: Path, name: str, kind: Any, inputs: Mapping[str, Any], depends: Mapping[str, str] | None = None
    ) -> None:
        given = {"stage": name, "layout": _LAYOUT, "inputs": inputs, "code": evidence_version(),
                 "depends": depends or {}, "machine": this_machine()}  # fmt: skip
        self.key = hash_of(given)
        self.name = name
        self.path = folder / f"{name}-{self.key[:16]}.h5"
        self.runs: dict[str, UsedRun] = {}
        self.failures: list[Failure] = []
        self._kind = kind

    def get_or_compute(self, compute: Callable[[], Any], runner: Runner | None = None) -> Any:
        """Return the records: read them from the file if it exists, else compute and write them.

        The file also lists the runs that `compute` requested from `runner`; they count as used whenever it is read.
        """
        from pydantic import TypeAdapter

        adapter = TypeAdapter(self._kind)
        if self.path.is_file():
            return self._read(adapter, runner)
        records = self._computed(compute, runner)
        tables: dict[str, Table] = {}
        text = json.dumps(plain_records(records, tables), ensure_ascii=False)  # writes NaN and Infinity, and reads them
        read_back = adapter.validate_python(_whole(json.loads(text), tables))  # raises before a wrong record is written
        self.failures += getattr(records, "failures", ())
        incomplete = self.path.with_name(f"{self.path.stem}-incomplete.h5")
        incomplete.unlink(missing_ok=True)
        if self.failures:
            self.path = incomplete
        mark_store(self.path.parent)
        runs = (self._runs_table(),) if self.runs else ()
        write_tables(self.path, (self._records_table(text), *(one for one in tables.values() if one.columns), *runs),
                     collect_provenance() | {SOURCES: evidence_version()})
        return read_back

    def _computed(self, compute: Callable[[], Any], runner: Runner | None) -> Any:
        if runner is None:
            return compute()
        with runner.recording(self.name.replace("_", " ")) as used:
            records = compute()
        self.runs = dict(used)
        return records

    def _read(self, adapter: Any, runner: Runner | None) -> Any:
        tables = read_tables(self.path)
        self.runs = {run.file: run for run in _runs_of(tables[_RUNS])} if _RUNS in tables else {}
        if runner is not None:
            for run in self.runs.values():
                add_use(runner.used, run)
        return adapter.validate_python(_whole(json.loads(tables[_RECORDS]["json"][0]), tables))

    def _records_table(self, text: str) -> Table:
        column = Column("json", (text,), "1", "the records as JSON, without the rows of their tables")
        return Table(_RECORDS, (column,), f"Records of the stage {self.name}", tuple(self.runs), "iapb reproduce")

    def _runs_table(self) -> Table:
        rows = [plain_records(run, {}) for run in self.runs.values()]
        texts = [Column(name, tuple(row[name] for row in rows), "1", meaning) for name, meaning in _RUN_TEXTS.items()]
        users = Column("used_by", tuple("\n".join(row["used_by"]) for row in rows), "1", "what used it, a line each")
        size = Column("size", np.array([row["size"] for row in rows], np.int64), "byte", "size of the file")
        return Table(_RUNS, (*texts, users, size), f"Runs behind the stage {self.name}", command="iapb reproduce")


_RUN_TEXTS = {
    "file": "name within the folder of runs", "name": "scene, world and rendering", "key": "hash of what determines it",
    "content_hash": "hash of its results", "command": "makes it again", "status": "complete or partial",
}  # fmt: skip


def _runs_of(table: Table) -> Iterator[UsedRun]:
    for row, users in enumerate(table["used_by"]):
        texts = {name: str(table[name][row]) for name in _RUN_TEXTS}
        yield UsedRun(**texts, size=int(table["size"][row]), used_by=tuple(str(users).split("\n")) if users else ())


def plain_records(records: Any, tables: dict[str, Table], name: str = "table") -> Any:
    """Return records as plain values, without numpy types; `tables` receives their tables, each named by its place."""
    if isinstance(records, finding.Table):
        label, count = safe_name(name), 2
        while label in (*tables, _RECORDS, _RUNS):
            label, count = f"{safe_name(name)}_{count}", count + 1
        tables[label], words = columns_of(label, records)
        return words
    if is_dataclass(records) and not isinstance(records, type):
        own = str(getattr(records, "key", name))
        return {field.name: plain_records(getattr(records, field.name), tables, own) for field in fields(records)}
    if isinstance(records, Mapping):
        return {str(key): plain_records(value, tables, str(key)) for key, value in records.items()}
    if isinstance(records, list | tuple):
        return [plain_records(value, tables, name) for value in records]
    return plain(records)


def _whole(value: Any, tables: Mapping[str, Table]) -> Any:
    """Return the plain records with their tables inserted again."""
    if isinstance(value, dict):
        if {"table", "columns", "judged"} <= set(value):
            return finding_table(tables.get(value["table"]), value)
        return {name: _whole(item, tables) for name, item in value.items()}
    return [_whole(item, tables) for item in value] if isinstance(value, list) else value
