"""A stage of the evidence: records that are computed once and then read from their file.

The file holds the records, and the runs behind them, as JSON text. Its name contains a hash of what
determines the records: the depth, the sources of the engine, the references and the verification,
the scenes, the processor, the BLAS kernel and the optional code of numpy, and the declared external
dependencies. If any of them changes, the stage is computed again; a change of the report's own code
does not cause that. Because the machine is part of the hash, numbers of two machines are never
mixed.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from reports.provenance import collect_provenance, this_machine
from reports.runner import Runner
from reports.store.keys import evidence_version, hash_of, plain
from reports.store.records import read_record, write_record
from reports.store.uses import StoredFile
from verification.finding import Failure, attempt

_LAYOUT = 5  # of the files


class Stage:
    """The records of one stage, and their file.

    Parameters
    ----------
    folder : folder of the table files.
    name : name of the stage; the file's name starts with it.
    kind : the type of the records, such as ``tuple[Claim, ...]``.
    depth : "quick" or "full".
    depends : external dependencies of the records by name, such as files outside of the project.

    Attributes
    ----------
    records : None until the stage is filled, and if it cannot be.
    runs : the runs that the records were made from, by file.
    failures : the cases that raised. If there are any, the records are written to a file named
        "incomplete", which later calls do not read, so that they compute the stage again.
    seconds : the time that it took to compute or read the records.
    """

    def __init__(
        self,
        folder: Path,
        name: str,
        kind: Any,
        depth: str,
        depends: Mapping[str, str] | None = None,
    ) -> None:
        word = name.replace(" ", "_")
        self.key = hash_of(
            {
                "stage": word,
                "layout": _LAYOUT,
                "inputs": {"depth": depth},
                "code": evidence_version(),
                "depends": depends or {},
                "machine": this_machine(),
            }
        )
        self.name = name
        self.kind = kind
        self.path = folder / f"{word}-{self.key[:16]}.h5"
        self.records: Any = None
        self.runs: dict[str, StoredFile] = {}
        self.failures: list[Failure] = []
        self.seconds = 0.0

    def fill(self, runner: Runner, compute: Callable[[list[Failure]], Any]) -> Stage:
        """Read the records from their file if it exists, else compute and write them; return the
        stage.

        The runs that `compute` requests from `runner` are kept with the records. Exceptions are
        recorded as failures; KeyboardInterrupt is not caught.
        """
        started = time.perf_counter()
        fill = self._read if self.path.is_file() else partial(self._compute, runner, compute)
        attempt("all of it", fill, self.failures)
        self.seconds = time.perf_counter() - started
        return self

    def _read(self) -> None:
        content = read_record(self.path)
        self.runs = {
            run["file"]: StoredFile(**run | {"used_by": tuple(run["used_by"])})
            for run in content["runs"]
        }
        self.records = self._checked(content["records"])

    def _compute(self, runner: Runner, compute: Callable[[list[Failure]], Any]) -> None:
        with runner.recording(self.name.partition(",")[0]) as used:  # of a topic, not of its part
            computed = compute(self.failures)
        records = plain(computed)
        found = self._checked(json.loads(json.dumps(records)))
        self.failures += getattr(computed, "failures", ())
        incomplete = self.path.with_name(f"{self.path.stem}-incomplete.h5")
        incomplete.unlink(missing_ok=True)
        if self.failures:
            self.path = incomplete
        provenance = collect_provenance() | {"sources": evidence_version()}
        content = {"runs": list(used.values()), "records": records}
        write_record(self.path, content, provenance)
        self.records = found
        self.runs = dict(used)

    def _checked(self, records: Any) -> Any:
        """Return the records made of JSON; raise if they are not of the stage's type."""
        from pydantic import TypeAdapter

        return TypeAdapter(self.kind).validate_python(records)
