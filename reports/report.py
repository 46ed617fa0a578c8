"""Write the report: a first page, a page for each section, and the files beside them.

    evidence = Evidence(inputs=..., claims=..., ...)
    pages = build_report(evidence, draw_all(evidence))
    write_report("out", pages)

A report whose sources, results and files have not changed is not made again: its answer is kept
beside its tables.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from iapb.errors import ArgumentError
from reports.crate import CRATE_NAME, write_crate
from reports.evidence.depends import FOLDERS, PACKAGES, depends_of, folder_hash
from reports.figures.figure import Figure
from reports.numbers_file import NUMBERS_NAME, collect_numbers, write_numbers
from reports.pages.page import FIRST_PAGE, PAGES
from reports.pages.records import Evidence
from reports.provenance import PEERS, collect_provenance
from reports.store.io import write_whole
from reports.store.keys import evidence_version, hash_of, plain, sources_hash
from verification.proofs.coq import checked

LARGEST_FIRST = 300_000  # bytes: a first page that cannot be mailed is not read
_WRITTEN = (*(page.file for page in PAGES), NUMBERS_NAME, CRATE_NAME)
ANSWER = "tables/answer.json"  # what the command said of the finished report


def write_report(folder: str | Path, pages: Mapping[str, str]) -> Path:
    """Write each page atomically, the first page last; return the path of the first page.

    Raises
    ------
    ArgumentError
        The first page is larger than LARGEST_FIRST.
    """
    size = len(pages[FIRST_PAGE].encode())
    if size > LARGEST_FIRST:
        raise ArgumentError("the first page", f"{size} bytes", f"at most {LARGEST_FIRST} bytes")
    for name in sorted(pages, key=FIRST_PAGE.__eq__):
        write_whole(Path(folder) / name, pages[name])
    return Path(folder) / FIRST_PAGE


def write_companions(
    out: Path, evidence: Evidence, figures: Iterable[Figure], depth: str
) -> tuple[Path, ...]:
    """Write the numbers and the RO-Crate metadata; return the files."""
    numbers = write_numbers(out / NUMBERS_NAME, collect_numbers(evidence, figures, depth))
    return numbers, write_crate(out, evidence.provenance)


def report_key(out: Path, depth: str) -> str:
    """Return a hash of what a report in `out` is made from, besides its files: code, machine,
    packages, command."""
    folder = Path(__file__).parent / "pages"
    return hash_of(
        {
            "folder": str(out.absolute()),
            "depth": depth,
            "code": [evidence_version(), sources_hash("reports")],
            "pages": [folder_hash(folder / part) for part in ("templates", "scripts")],
            "depends": {stage: depends_of(stage) for stage in (*FOLDERS, *PACKAGES, "proofs")},
            "facts": collect_provenance(packages=PEERS),
            "coq": checked.read(),
        }
    )


def keep_answer(
    out: Path, key: str, facts: Mapping[str, Any], lines: Sequence[str], made_from: Iterable[str]
) -> None:
    """Keep the answer of a finished report and the state of its files; paths are relative to
    `out`."""
    kept = {
        "key": key,
        "facts": facts,
        "lines": lines,
        "files": _states(out, (*made_from, *_WRITTEN)),
    }
    write_whole(out / ANSWER, json.dumps(plain(kept)))


def kept_answer(out: Path, key: str) -> tuple[dict[str, Any], list[str]] | None:
    """Return the facts and lines that were kept with this key, or None if a file of the report has
    changed since."""
    with suppress(OSError, ValueError, KeyError, TypeError):
        kept = json.loads((out / ANSWER).read_text(encoding="utf-8"))
        if kept["key"] == key and kept["files"] == _states(out, kept["files"]):
            return kept["facts"], kept["lines"]
    return None


def _states(out: Path, names: Iterable[str]) -> dict[str, list[int]]:
    """Return size and time of the last change of each file that exists; [] for the others."""
    paths = {name: out / name for name in names}
    found = {name: path.stat() for name, path in paths.items() if path.exists()}
    return {
        name: [found[name].st_size, found[name].st_mtime_ns] if name in found else []
        for name in paths
    }
