"""Machine-readable metadata beside the report, as an RO-Crate (https://w3id.org/ro/crate/1.1)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

from reports.store.io import write_whole

CRATE_NAME = "ro-crate-metadata.json"
_CRATE = Path(__file__).with_name("crate.json")  # without date and version


def write_crate(out: Path, facts: Mapping[str, str]) -> Path:
    """Write the metadata of a report in `out`, given its provenance."""
    crate = json.loads(_CRATE.read_text(encoding="utf-8"))
    [report] = [entity for entity in crate["@graph"] if entity["@id"] == "./"]
    report["datePublished"] = datetime.now(UTC).date().isoformat()
    report["version"] = facts.get("commit", "")
    path = out / CRATE_NAME
    write_whole(path, json.dumps(crate, indent=1, ensure_ascii=False))
    return path
