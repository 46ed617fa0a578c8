"""Write the report: a first page, a page for each section, and the files beside them.

evidence = Evidence(inputs=..., claims=..., ...)
pages = build_report(evidence, draw_all(evidence))
write_report("out", pages)
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from iapb.errors import ArgumentError
from reports.figures.figure import Figure
from reports.pages.crate import write_crate
from reports.pages.numbers_file import NUMBERS_NAME, collect_numbers, write_numbers
from reports.pages.page import FIRST_PAGE
from reports.pages.records import Evidence
from reports.store.io import write_whole

LARGEST_FIRST = 300_000  # bytes: a first page that cannot be mailed is not read


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
