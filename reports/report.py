"""Write the report: a first page, a page for each section, an archive of all pages, and the files beside them.

    evidence = Evidence(inputs=..., claims=..., ...)
    pages = build_report(evidence, draw_all(evidence))
    write_report("out", pages)

A report whose sources, results and files have not changed is not made again: its answer is kept beside its tables.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from iapb.errors import ArgumentError
from reports.crate import write_crate
from reports.evidence.depends import FOLDERS, PACKAGES, depends_of, folder_hash
from reports.figures.figure import Figure
from reports.numbers_file import NUMBERS_NAME, collect_numbers, write_numbers
from reports.pages.builder import FIRST_PAGE
from reports.pages.records import Evidence
from reports.pages.sections import SECTIONS
from reports.provenance import PEERS, collect_provenance, uncommitted_changes
from reports.store.io import write_whole
from reports.store.keys import evidence_version, hash_of, plain, sources_hash

LARGEST_FIRST, LARGEST_ARCHIVE = 1_000_000, 4_000_000  # bytes: a report that cannot be mailed is not read
ARCHIVE_NAME, DIRTY_NAME = "report.zip", "dirty.diff"
ANSWER = "tables/answer.json"  # what the command said of the finished report
_TEXTS = {
    FIRST_PAGE: "the report's first page",
    **{section.page: f"the report: {section.title}" for section in SECTIONS},
    ARCHIVE_NAME: "all pages of the report",
    NUMBERS_NAME: "every number of the report, for iapb report diff and iapb reproduce --check",
    DIRTY_NAME: "how the sources differed from the commit",
}


def write_report(folder: str | Path, pages: Mapping[str, str]) -> Path:
    """Write each page and their archive atomically, the first page last; return the path of the first page.

    Raises
    ------
    ArgumentError
        The first page is larger than LARGEST_FIRST, or the archive is larger than LARGEST_ARCHIVE.
    """
    contents, packed = {name: page.encode() for name, page in pages.items()}, io.BytesIO()
    with zipfile.ZipFile(packed, "w") as file:
        for name in sorted(contents):  # without times: equal pages give equal bytes
            file.writestr(zipfile.ZipInfo(name), contents[name], zipfile.ZIP_DEFLATED)
    contents = {ARCHIVE_NAME: packed.getvalue(), **contents}
    for what, name, largest in (("the first page", FIRST_PAGE, LARGEST_FIRST),
                                ("the archive", ARCHIVE_NAME, LARGEST_ARCHIVE)):  # fmt: skip
        if len(contents[name]) > largest:
            raise ArgumentError(what, f"{len(contents[name])} bytes", f"at most {largest} bytes")
    for name in sorted(contents, key=FIRST_PAGE.__eq__):
        write_whole(Path(folder) / name, contents[name])
    return Path(folder) / FIRST_PAGE


def write_companions(out: Path, evidence: Evidence, figures: Iterable[Figure], depth: str) -> tuple[Path, ...]:
    """Write the numbers, the uncommitted changes if there are any, and last the RO-Crate metadata; return the files."""
    written, changed = [write_numbers(out / NUMBERS_NAME, collect_numbers(evidence, figures, depth))], out / DIRTY_NAME
    changed.unlink(missing_ok=True)
    if changes := uncommitted_changes():
        write_whole(changed, changes + "\n")
        written.append(changed)
    beside = {name: text for name, text in _TEXTS.items() if (out / name).is_file()}
    return (*written, write_crate(out, beside, evidence.manifest, evidence.provenance))


def report_key(out: Path, depth: str) -> str:
    """Return a hash of what a report in `out` is made from, besides its files: code, machine, packages, command."""
    folder = Path(__file__).parent / "pages"
    return hash_of({
        "folder": str(out.absolute()), "depth": depth, "code": [evidence_version(), sources_hash("reports")],
        "pages": [folder_hash(folder / part) for part in ("templates", "scripts")], "changes": uncommitted_changes(),
        "depends": {stage: depends_of(stage) for stage in (*FOLDERS, *PACKAGES, "proofs")},
        "facts": collect_provenance(packages=PEERS),
    })  # fmt: skip


def keep_answer(out: Path, key: str, facts: Mapping[str, Any], lines: Sequence[str], made_from: Iterable[str]) -> None:
    """Keep the answer of a finished report and the state of its files; paths are relative to `out`."""
    kept = {"key": key, "facts": facts, "lines": lines, "files": _states(out, (*made_from, *_TEXTS))}
    write_whole(out / ANSWER, json.dumps(plain(kept)))


def kept_answer(out: Path, key: str) -> tuple[dict[str, Any], list[str]] | None:
    """Return the facts and lines that were kept with this key, or None if a file of the report has changed since."""
    with suppress(OSError, ValueError, KeyError, TypeError):
        kept = json.loads((out / ANSWER).read_text(encoding="utf-8"))
        if kept["key"] == key and kept["files"] == _states(out, kept["files"]):
            return kept["facts"], kept["lines"]
    return None


def _states(out: Path, names: Iterable[str]) -> dict[str, list[int]]:
    """Return size and time of the last change of each file that exists; [] for the others."""
    paths = {name: out / name for name in names}
    found = {name: path.stat() for name, path in paths.items() if path.exists()}
    return {name: [found[name].st_size, found[name].st_mtime_ns] if name in found else [] for name in paths}
