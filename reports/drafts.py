"""Drafts of the files for a CODECHECK (https://codecheck.org.uk/spec/config/1.0/) and for the journal ReScience C."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from reports.crate import PAPER_AUTHORS, PAPER_PLACE, PAPER_TITLE
from reports.numbers_file import NUMBERS_NAME

CODECHECK_NAME, RESCIENCE_NAME = "codecheck.yml", "rescience.yaml"
SPECIFICATION = "https://codecheck.org.uk/spec/config/1.0/"
_HEAD = """\
# A draft: whoever checks fills in what is empty. To check: make reproduce, then
#   iapb reproduce --check REPORT      with the report that came with the paper
---
"""


def write_codecheck(out: Path, outputs: Mapping[str, str], command: str) -> Path:
    """Write the draft: the files that a checker reproduces, each with a description; the certificate is left empty."""
    authors = "".join(f"    - name: {_text(name)}\n" for name in PAPER_AUTHORS.split(", "))
    manifest = "".join(f"  - file: {_text(name)}\n    comment: {_text(text)}\n" for name, text in outputs.items())
    path = out / CODECHECK_NAME
    path.write_text(
        f"{_HEAD}version: {SPECIFICATION}\n"
        f"paper:\n  title: {_text(PAPER_TITLE)}\n  authors:\n{authors}  reference: {_text(PAPER_PLACE)}\n"
        f"manifest:\n{manifest}"
        "codechecker:\n  - name: \"\"\n    ORCID: \"\"\n"
        f"summary: {_text(f'made by: {command}')}\n"
        "repository: \"\"\ncheck_time: \"\"\ncertificate: \"\"\nreport: \"\"\n",
        encoding="utf-8",
    )  # fmt: skip
    return path


def write_rescience(out: Path, verdicts: Mapping[str, str], command: str) -> Path:
    """Write the metadata of a replication, with the verdict of each claim (claim -> outcome)."""
    counts = ", ".join(f"{number} {outcome}" for outcome, number in Counter(verdicts.values()).most_common())
    path = out / RESCIENCE_NAME
    path.write_text(
        "# A draft: the authors fill in what is empty. [Re] marks a replication that succeeds, [¬Re] one that fails;\n"
        "# the authors choose.\n"
        f"title: {_text(f'[Re] {PAPER_TITLE}')}\n"
        "authors:\n  - name: \"\"\n    orcid: \"\"\n    email: \"\"\n    affiliations: 1,*\n"
        "affiliations:\n  - code: 1\n    name: \"\"\n    address: \"\"\n"
        "keywords: haptic rendering, rigid contact, impulses, passivity, Python\n"
        "code:\n  - url: \"\"\n  - doi: \"\"\n  - swh: \"\"\n"
        f"data:\n  - url: {_text(NUMBERS_NAME)}\n  - doi: \"\"\n"
        "replication:\n"
        f"  - cite: {_text(f'{PAPER_AUTHORS}. {PAPER_TITLE}. {PAPER_PLACE}.')}\n"
        "  - bib: constantinescu2005\n  - url: \"\"\n  - doi: \"\"\n"
        f"abstract: {_text(f'Claims of the paper: {counts}. Made by: {command}')}\n"
        "language: en\ndomain: Haptics\ntype: article\n"
        "verdicts:\n" + "".join(f"  {claim}: {_text(outcome)}\n" for claim, outcome in verdicts.items()),
        encoding="utf-8",
    )  # fmt: skip
    return path


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)  # a JSON text is a YAML text
