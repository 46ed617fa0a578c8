"""Records of evidence: one text of JSON in a sealed HDF5 file, with its provenance."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reference.hdf5 import Budget, values_at
from reports.store import io
from reports.store.keys import plain
from reports.store.schema import FORMAT_VERSION, TABLE_FORMAT

RECORDS = "records"


def write_record(path: Path, value: Any, provenance: Mapping[str, str]) -> Path:
    """Write any records as JSON; see `plain` for the types."""
    with io.new_file(path, replace=True) as file:
        file.attrs.update({"format": TABLE_FORMAT, "format_version": FORMAT_VERSION})
        for name, fact in provenance.items():
            io.write_text(file.require_group("provenance"), name, fact)
        text = json.dumps(plain(value), ensure_ascii=False)
        io.write_text(file.create_group(RECORDS), "json", text)
    return path


def read_record(path: Path) -> Any:
    """Return the records in a file as lists and mappings.

    Raises
    ------
    RunFileError
        The file is absent, damaged or not a file of records.
    """
    with io.opened(path, TABLE_FORMAT) as file:
        return json.loads(values_at(file, f"{RECORDS}/json", Budget(path, file)))
