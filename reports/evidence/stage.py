"""A stage of the evidence: records that are computed once and then read from their file.

The file holds the records, and the runs behind them, as JSON text. Its name contains a hash of what determines the
records: the stage's inputs, the sources of the engine, the references and the verification, the scenes, the processor,
the BLAS kernel and the optional code of numpy, and the declared external dependencies. If any of them changes, the
stage is computed again; a change of the report's own code does not cause that. Because the machine is part of the hash,
numbers of two machines are never mixed.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from reports.provenance import collect_provenance, this_machine
from reports.runner import Runner
from reports.store.io import mark_store
from reports.store.keys import SOURCES, evidence_version, hash_of, plain
from reports.store.tables import read_record, write_record
from reports.uses import UsedRun, add_use
from verification.finding import Failure

_LAYOUT = 3  # of the files: 2 had the rows of tables as columns


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
            content = read_record(self.path)
            self.runs = {run["file"]: UsedRun(**run | {"used_by": tuple(run["used_by"])}) for run in content["runs"]}
            if runner is not None:
                for run in self.runs.values():
                    add_use(runner.used, run)
            return adapter.validate_python(content["records"])
        recording = runner.recording(self.name.replace("_", " ")) if runner is not None else nullcontext(self.runs)
        with recording as used:
            records = compute()
        self.runs = dict(used)
        content = {"runs": list(self.runs.values()), "records": plain(records)}
        read_back = adapter.validate_python(json.loads(json.dumps(content["records"])))  # raises for a wrong record
        self.failures += getattr(records, "failures", ())
        incomplete = self.path.with_name(f"{self.path.stem}-incomplete.h5")
        incomplete.unlink(missing_ok=True)
        if self.failures:
            self.path = incomplete
        mark_store(self.path.parent)
        write_record(self.path, content, f"Records of the stage {self.name}", runs=tuple(self.runs),
                     command="iapb reproduce", provenance=collect_provenance() | {SOURCES: evidence_version()})
        return read_back
