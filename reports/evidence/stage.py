"""A stage of the evidence: records that are computed once and then read from their file.

The file's name carries a hash of what determines the records: the stage's inputs and the sources of the engine, the
references and the verification. So a changed line of theirs makes the stage run again, a change of the report not.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from reports.evidence.tables import numbers_tables
from reports.store_keys import canonical_json, code_version, plain
from reports.store_tables import Column, Table, read_table, write_tables

_RECORDS = "records"


@cache
def evidence_version() -> str:
    """Hash of everything that can change a verdict: engine, references, verification, and these stages."""
    digest = hashlib.sha256(code_version().encode())
    root = Path(__file__).resolve().parents[2]
    for folder in ("verification", "reports/evidence"):
        for path in sorted((root / folder).rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


class Stage:
    """Where the records of one topic are kept.

    Parameters
    ----------
    folder : of the table files.
    name : of the topic; starts the file's name.
    kind : the type of the records, such as ``tuple[Claim, ...]``.
    inputs : what determines them besides the code.
    """

    def __init__(self, folder: Path, name: str, kind: Any, inputs: Mapping[str, Any]) -> None:
        text = canonical_json({"stage": name, "inputs": inputs, "code": evidence_version()})
        self.key = hashlib.sha256(text.encode()).hexdigest()
        self.name = name
        self.path = folder / f"{name}-{self.key[:16]}.h5"
        self._kind = kind

    def get_or_compute(self, compute: Callable[[], Any]) -> Any:
        """Return the records: from the file where there is one, else computed and written."""
        from pydantic import TypeAdapter

        adapter = TypeAdapter(self._kind)
        if self.path.is_file():
            return adapter.validate_python(json.loads(read_table(self.path, _RECORDS)["json"][0]))
        records = compute()
        text = json.dumps(plain_records(records), ensure_ascii=False)  # writes NaN and Infinity, and reads them
        read_back = adapter.validate_python(json.loads(text))  # what is no such record is not written
        title = f"Records of the stage {self.name}"
        table = Table(_RECORDS, (Column("json", (text,), "1", "the records as JSON"),), title, command="iapb reproduce")
        self.path.parent.mkdir(parents=True, exist_ok=True)
        write_tables(self.path, (table, *numbers_tables(records)))
        return read_back


def plain_records(records: Any) -> Any:
    """Records as plain values, numpy's included."""
    from dataclasses import fields, is_dataclass

    if is_dataclass(records) and not isinstance(records, type):
        return {field.name: plain_records(getattr(records, field.name)) for field in fields(records)}
    if isinstance(records, Mapping):
        return {str(name): plain_records(value) for name, value in records.items()}
    if isinstance(records, list | tuple):
        return [plain_records(value) for value in records]
    return plain(records)
