"""Write the report: a first page, a page for each section, and an archive of all pages.

    pages = build_report(Evidence(inputs=..., claims=..., ...))
    write_report("out", pages)
"""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path

from iapb.errors import ArgumentError
from reports.pages.builder import FIRST_PAGE

LARGEST_FIRST, LARGEST_ARCHIVE = 1_000_000, 4_000_000  # bytes: a report that cannot be mailed is not read
ARCHIVE_NAME = "report.zip"


def write_report(folder: str | Path, pages: Mapping[str, str]) -> Path:
    """Write each page and their archive atomically, the first page last; return the path of the first page.

    Raises
    ------
    ArgumentError
        The first page is larger than LARGEST_FIRST, or the archive is larger than LARGEST_ARCHIVE.
    """
    target, contents = Path(folder), {name: page.encode() for name, page in pages.items()}
    packed = _archive(contents)
    for what, content, largest in (("the first page", contents[FIRST_PAGE], LARGEST_FIRST),
                                   ("the archive", packed, LARGEST_ARCHIVE)):  # fmt: skip
        if len(content) > largest:
            raise ArgumentError(what, f"{len(content)} bytes", f"at most {largest} bytes")
    for name, content in sorted((contents | {ARCHIVE_NAME: packed}).items(), key=lambda item: item[0] == FIRST_PAGE):
        _write(target / name, content)
    return target / FIRST_PAGE


def _archive(contents: Mapping[str, bytes]) -> bytes:
    """Return a zip archive of files; equal files give equal bytes."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as file:
        for name in sorted(contents):
            file.writestr(zipfile.ZipInfo(name), contents[name], zipfile.ZIP_DEFLATED)
    return packed.getvalue()


def _write(target: Path, content: bytes) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    partial = target.with_name(target.name + ".partial")
    partial.write_bytes(content)
    os.replace(partial, target)
