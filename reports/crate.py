"""Machine-readable metadata beside the report, as an RO-Crate (https://w3id.org/ro/crate/1.1)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

from reports.numbers_file import NUMBERS_NAME
from reports.pages.page import FIRST_PAGE
from reports.store.io import write_whole

CRATE_NAME = "ro-crate-metadata.json"
PROFILE = "https://w3id.org/ro/crate/1.1"
LICENSE = "https://spdx.org/licenses/MIT"
PAPER = (
    "D. Constantinescu, S. E. Salcudean, E. A. Croft: Haptic rendering of rigid contacts using "
    "impulsive and penalty "
    "forces, IEEE Transactions on Robotics 21(3), 2005"
)
PARTS = {
    FIRST_PAGE: ("File", "the first page of the report"),
    "report/": ("Dataset", "its other pages"),
    NUMBERS_NAME: (
        "File",
        "every number of the report, and the content hash of each run by its command",
    ),
    "runs/": ("Dataset", "the runs that the numbers were computed from"),
}


def write_crate(out: Path, facts: Mapping[str, str]) -> Path:
    """Write the metadata of a report in `out`, given its provenance."""
    parts = [{"@id": name, "@type": kind, "name": text} for name, (kind, text) in PARTS.items()]
    graph = [
        {
            "@id": CRATE_NAME,
            "@type": "CreativeWork",
            "conformsTo": {"@id": PROFILE},
            "about": {"@id": "./"},
        },
        {
            "@id": "./",
            "@type": "Dataset",
            "name": "Rigid contact by impulses and penalties: the evidence",
            "description": "A report that judges each claim of the paper over a range of conditions.",
            "datePublished": datetime.now(UTC).date().isoformat(),
            "license": {"@id": LICENSE},
            "author": {"@id": "#authors"},
            "isBasedOn": {"@id": "#paper"},
            "version": facts.get("commit", ""),
            "hasPart": [{"@id": name} for name in PARTS],
        },
        *parts,
        {"@id": LICENSE, "@type": "CreativeWork", "name": "MIT License", "identifier": "MIT"},
        {"@id": "#authors", "@type": "Organization", "name": "The iapb authors"},
        {"@id": "#paper", "@type": "ScholarlyArticle", "name": PAPER},
    ]
    content = {"@context": f"{PROFILE}/context", "@graph": graph}
    path = out / CRATE_NAME
    write_whole(path, json.dumps(content, indent=1, ensure_ascii=False))
    return path
