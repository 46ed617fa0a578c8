"""Write the report: a first page, a page for each section, an archive of all pages, and the files beside them.

    pages = build_report(Evidence(inputs=..., claims=..., ...))
    write_report("out", pages)
"""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from iapb.errors import ArgumentError
from reports.crate import write_crate
from reports.figures.figure import Figure, NotComputed, Recipe
from reports.numbers_file import NUMBERS_NAME, collect_numbers, write_numbers
from reports.pages.builder import FIRST_PAGE
from reports.pages.records import Evidence
from reports.pages.sections import SECTIONS
from reports.provenance import uncommitted_changes
from verification.finding import Failure, attempt

LARGEST_FIRST, LARGEST_ARCHIVE = 1_000_000, 4_000_000  # bytes: a report that cannot be mailed is not read
ARCHIVE_NAME, DIRTY_NAME = "report.zip", "dirty.diff"
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
        target = Path(folder) / name
        target.parent.mkdir(parents=True, exist_ok=True)
        aside = target.with_name(target.name + ".partial")
        aside.write_bytes(contents[name])
        os.replace(aside, target)
    return Path(folder) / FIRST_PAGE


def remembering(
    recipes: tuple[Recipe, ...], failures: list[Failure] | None = None
) -> tuple[tuple[Recipe, ...], dict[str, Figure]]:
    """Return the recipes, and a mapping that receives each drawn figure by its key.

    A figure that raises is appended to `failures`, and the page says that it was not computed.
    """
    drawn: dict[str, Figure] = {}
    failed: list[Failure] = [] if failures is None else failures

    def draw(recipe: Recipe, inputs: Mapping[str, Any]) -> Figure | NotComputed:
        figure = attempt(recipe.key, partial(recipe.draw, inputs), failed)
        if isinstance(figure, Figure):
            drawn[recipe.key] = figure
        return NotComputed(recipe.key, recipe.number, recipe.title) if figure is None else figure

    return tuple(replace(recipe, draw=partial(draw, recipe)) for recipe in recipes), drawn


def write_companions(out: Path, evidence: Evidence, figures: Mapping[str, Figure], depth: str) -> tuple[Path, ...]:
    """Write the numbers, the uncommitted changes if there are any, and last the RO-Crate metadata; return the files."""
    written, changed = [write_numbers(out / NUMBERS_NAME, collect_numbers(evidence, figures, depth))], out / DIRTY_NAME
    changed.unlink(missing_ok=True)
    if changes := uncommitted_changes():
        changed.write_text(changes + "\n", encoding="utf-8")
        written.append(changed)
    beside = {name: text for name, text in _TEXTS.items() if (out / name).is_file()}
    return (*written, write_crate(out, beside, evidence.manifest, evidence.provenance))
