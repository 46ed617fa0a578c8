"""Machine-readable metadata beside the report, as an RO-Crate (https://w3id.org/ro/crate/1.1)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from reports.pages.records import StoredFile

CRATE_NAME = "ro-crate-metadata.json"
PROFILE = "https://w3id.org/ro/crate/1.1"
LICENSE = "https://spdx.org/licenses/MIT"
_BLOCK = 1 << 20
PAPER_TITLE = "Haptic rendering of rigid contacts using impulsive and penalty forces"
PAPER_AUTHORS = "D. Constantinescu, S. E. Salcudean, E. A. Croft"
PAPER_PLACE = "IEEE Transactions on Robotics 21(3), 2005"
_ACTION, _SOFTWARE, _MACHINE, _PAPER, _AUTHORS = "#reproduce", "#iapb", "#machine", "#paper", "#authors"
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
    files = [_file(out / name, name, title, text) for name, (title, text) in _described(out, beside, manifest).items()]
    parts = [{"@id": file["@id"]} for file in files]
    graph = [_descriptor(), _root(parts, facts), *files, _action(parts, facts), _software(facts), _machine(facts)]
    path = out / CRATE_NAME
    context = [f"{PROFILE}/context", {"sha256": "https://schema.org/sha256"}]
    content = {"@context": context, "@graph": graph + _license_and_paper()}
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False), encoding="utf-8")
    return path


def _described(out: Path, beside: Mapping[str, str], manifest: Iterable[StoredFile]) -> dict[str, tuple[str, str]]:
    """Return the title and description of every existing file, by its path relative to `out`."""
    found = {name: (name, text) for name, text in beside.items()}
    for entry in manifest:
        if (out / entry.file).is_file():
            used = f"; used by {', '.join(entry.used_by)}" if entry.used_by else ""
            found[entry.file] = (entry.name, f"made again by: {entry.command}{used}")
    return found


def _file(path: Path, name: str, title: str, text: str) -> dict[str, Any]:
    return {
        "@id": name, "@type": "File", "name": title, "description": text, "contentSize": str(path.stat().st_size),
        "sha256": sha256(path), "encodingFormat": _FORMATS.get(path.suffix, "application/octet-stream"),
    }  # fmt: skip


def sha256(path: Path) -> str:
    """Return the SHA-256 of a file's bytes."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()


def _descriptor() -> dict[str, Any]:
    return {"@id": CRATE_NAME, "@type": "CreativeWork", "conformsTo": {"@id": PROFILE}, "about": {"@id": "./"}}


def _root(parts: list[dict[str, str]], facts: Mapping[str, str]) -> dict[str, Any]:
    return {
        "@id": "./", "@type": "Dataset", "name": "Rigid contact by impulses and penalties: the evidence",
        "description": "A report that judges each claim of the paper over a range of conditions, with every run and "
                       "table that it was made from.",
        "datePublished": datetime.now(UTC).date().isoformat(), "license": {"@id": LICENSE}, "hasPart": parts,
        "mentions": {"@id": _ACTION}, "isBasedOn": {"@id": _PAPER}, "version": facts.get("version", ""),
        "author": {"@id": _AUTHORS}, "publisher": {"@id": _AUTHORS},
    }  # fmt: skip


def _action(parts: list[dict[str, str]], facts: Mapping[str, str]) -> dict[str, Any]:
    """Return the entry for the action that made the files: the command, its seeds, the software and the machine."""
    return {
        "@id": _ACTION, "@type": "CreateAction", "name": facts.get("command", "iapb reproduce"),
        "description": f"seeds: {facts.get('seeds', 'none')}", "instrument": [{"@id": _SOFTWARE}, {"@id": _MACHINE}],
        "result": parts, "endTime": datetime.now(UTC).isoformat(timespec="seconds"),
    }  # fmt: skip


def _software(facts: Mapping[str, str]) -> dict[str, Any]:
    left_out = {"command", "seeds", *_MACHINE_FACTS}
    requirements = [f"{name} {value}" for name, value in facts.items() if name not in left_out]
    return {"@id": _SOFTWARE, "@type": "SoftwareApplication", "name": "iapb",
            "softwareVersion": facts.get("commit", ""), "softwareRequirements": requirements}  # fmt: skip


def _machine(facts: Mapping[str, str]) -> dict[str, Any]:
    text = "; ".join(f"{name}: {facts[name]}" for name in _MACHINE_FACTS if name in facts)
    return {"@id": _MACHINE, "@type": "Thing", "name": "the machine", "description": text}


def _license_and_paper() -> list[dict[str, Any]]:
    paper = f"{PAPER_AUTHORS}: {PAPER_TITLE}, {PAPER_PLACE}"
    return [{"@id": LICENSE, "@type": "CreativeWork", "name": "MIT License", "identifier": "MIT"},
            {"@id": _AUTHORS, "@type": "Organization", "name": "The iapb authors"},
            {"@id": _PAPER, "@type": "ScholarlyArticle", "name": paper}]
