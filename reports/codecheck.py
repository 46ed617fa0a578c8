"""A draft of the configuration that a CODECHECK asks for (https://codecheck.org.uk/spec/config/1.0/)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from reports.crate import PAPER_AUTHORS, PAPER_PLACE, PAPER_TITLE

CODECHECK_NAME = "codecheck.yml"
SPECIFICATION = "https://codecheck.org.uk/spec/config/1.0/"
_HEAD = """\
# A draft: whoever checks fills in what is empty. To check: make reproduce, then
#   iapb reproduce --check REPORT      with the report that came with the paper
---
"""


def write_codecheck(out: Path, outputs: Mapping[str, str], command: str) -> Path:
    """Write the draft: the files that a checker makes again, each with what it holds, and nobody's certificate."""
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


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)  # a JSON text is a YAML text
