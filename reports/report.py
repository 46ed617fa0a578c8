"""Write the report: its first page, a page for each section beside it, and all of them in one archive.

    pages = build_report(Evidence(inputs=..., claims=..., ...))
    write_report("out", pages)
"""

from __future__ import annotations

import os
import zipfile
from collections.abc import Mapping
from pathlib import Path

from iapb.errors import ArgumentError
from reports.pages.builder import FIRST_PAGE

LARGEST_FIRST, LARGEST_REPORT = 1_000_000, 8_000_000  # bytes: a report that cannot be mailed is not read
ARCHIVE_NAME = "report.zip"


def write_report(folder: str | Path, pages: Mapping[str, str]) -> Path:
    """Write the pages and their archive, each in one step and the first page last; return the first page's path.

    Raises
    ------
    ArgumentError
        If the first page is larger than LARGEST_FIRST, or all pages together than LARGEST_REPORT.
    """
    contents = {name: page.encode() for name, page in pages.items()}
    for what, size, largest in (("first page", len(contents[FIRST_PAGE]), LARGEST_FIRST),
                                ("pages", sum(map(len, contents.values())), LARGEST_REPORT)):  # fmt: skip
        if size > largest:
            raise ArgumentError(what, f"{size} bytes", f"at most {largest} bytes")
    target = Path(folder)
    for name in sorted(contents, key=lambda name: name == FIRST_PAGE):
        _write(target / name, contents[name])
    archive = target / f"{ARCHIVE_NAME}.partial"
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for name in sorted(contents):
            file.writestr(zipfile.ZipInfo(name), contents[name], zipfile.ZIP_DEFLATED)
    os.replace(archive, target / ARCHIVE_NAME)
    return target / FIRST_PAGE


def _write(target: Path, content: bytes) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    partial = target.with_name(target.name + ".partial")
    partial.write_bytes(content)
    os.replace(partial, target)
