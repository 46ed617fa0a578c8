"""Machine-readable metadata beside the report, as an RO-Crate (https://w3id.org/ro/crate/1.1)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from pathlib import Path

from reports.store.io import write_whole
from reports.uses import StoredFile

CRATE_NAME = "ro-crate-metadata.json"
PROFILE = "https://w3id.org/ro/crate/1.1"
LICENSE = "https://spdx.org/licenses/MIT"
PAPER_TITLE = "Haptic rendering of rigid contacts using impulsive and penalty forces"
PAPER_AUTHORS = "D. Constantinescu, S. E. Salcudean, E. A. Croft"
PAPER_PLACE = "IEEE Transactions on Robotics 21(3), 2005"
_FORMATS = {".html": "text/html", ".json": "application/json", ".diff": "text/x-diff", ".yml": "application/yaml",
            ".yaml": "application/yaml", ".h5": "application/x-hdf5", ".zip": "application/zip"}  # fmt: skip
_MACHINE_FACTS = ("system", "cpu", "blas", "python")


def write_crate(out: Path, beside: Mapping[str, str], manifest: Iterable[StoredFile], facts: Mapping[str, str]) -> Path:
    """Write the metadata of everything in `out` that belongs to the report.

    Parameters
    ----------
    out : folder of the report.
    beside : descriptions, by name, of the files that are neither runs nor tables.
    manifest : the runs and tables; missing files are left out.
    facts : the provenance of the report.
    """
    described = {name: (name, text) for name, text in beside.items()}
    for entry in manifest:
        used = f"; used by {', '.join(entry.used_by)}" if entry.used_by else ""
        described[entry.file] = entry.name, f"made again by: {entry.command}{used}"
    files = [{"@id": name, "@type": "File", "name": title, "description": text,
              "contentSize": str((out / name).stat().st_size), "sha256": sha256(out / name),
              "encodingFormat": _FORMATS.get(Path(name).suffix, "application/octet-stream")}
             for name, (title, text) in described.items() if (out / name).is_file()]  # fmt: skip
    parts, now = [{"@id": file["@id"]} for file in files], datetime.now(UTC)
    needs = [f"{name} {fact}" for name, fact in facts.items() if name not in ("command", "seeds", *_MACHINE_FACTS)]
    graph = [
        {"@id": CRATE_NAME, "@type": "CreativeWork", "conformsTo": {"@id": PROFILE}, "about": {"@id": "./"}},
        {"@id": "./", "@type": "Dataset", "name": "Rigid contact by impulses and penalties: the evidence",
         "description": "A report that judges each claim of the paper over a range of conditions, with every run and "
                        "table that it was made from.",
         "datePublished": now.date().isoformat(), "license": {"@id": LICENSE}, "hasPart": parts,
         "mentions": {"@id": "#reproduce"}, "isBasedOn": {"@id": "#paper"}, "version": facts.get("version", ""),
         "author": {"@id": "#authors"}, "publisher": {"@id": "#authors"}},
        *files,
        {"@id": "#reproduce", "@type": "CreateAction", "name": facts.get("command", "iapb reproduce"),
         "description": f"seeds: {facts.get('seeds', 'none')}", "instrument": [{"@id": "#iapb"}, {"@id": "#machine"}],
         "result": parts, "endTime": now.isoformat(timespec="seconds")},
        {"@id": "#iapb", "@type": "SoftwareApplication", "name": "iapb", "softwareVersion": facts.get("commit", ""),
         "softwareRequirements": needs},
        {"@id": "#machine", "@type": "Thing", "name": "the machine",
         "description": "; ".join(f"{name}: {facts[name]}" for name in _MACHINE_FACTS if name in facts)},
        {"@id": LICENSE, "@type": "CreativeWork", "name": "MIT License", "identifier": "MIT"},
        {"@id": "#authors", "@type": "Organization", "name": "The iapb authors"},
        {"@id": "#paper", "@type": "ScholarlyArticle", "name": f"{PAPER_AUTHORS}: {PAPER_TITLE}, {PAPER_PLACE}"},
    ]  # fmt: skip
    path = out / CRATE_NAME
    content = {"@context": [f"{PROFILE}/context", {"sha256": "https://schema.org/sha256"}], "@graph": graph}
    write_whole(path, json.dumps(content, indent=1, ensure_ascii=False))
    return path


def sha256(path: Path) -> str:
    """Return the SHA-256 of a file's bytes."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
