"""Write the files beside the report: its numbers, uncommitted changes, and machine-readable metadata."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from reports.crate import write_crate
from reports.figures.figure import Figure, NotComputed, Recipe
from reports.numbers_file import NUMBERS_NAME, collect_numbers, write_numbers
from reports.pages.builder import FIRST_PAGE
from reports.pages.records import Evidence
from reports.pages.sections import SECTIONS
from reports.provenance import uncommitted_changes
from reports.report import ARCHIVE_NAME
from verification.finding import Failure, attempt

DIRTY_NAME = "dirty.diff"
_TEXTS = {
    FIRST_PAGE: "the report's first page",
    **{section.page: f"the report: {section.title}" for section in SECTIONS},
    ARCHIVE_NAME: "all pages of the report",
    NUMBERS_NAME: "every number of the report, for iapb report diff and iapb reproduce --check",
    DIRTY_NAME: "how the sources differed from the commit",
}


def remembering(
    recipes: tuple[Recipe, ...], failures: list[Failure] | None = None
) -> tuple[tuple[Recipe, ...], dict[str, Figure]]:
    """Return the recipes, and a mapping that receives each drawn figure by its key.

    A figure that raises is appended to `failures`, and the page says that it was not computed.
    """
    drawn: dict[str, Figure] = {}
    failed: list[Failure] = [] if failures is None else failures

    def kept(recipe: Recipe) -> Recipe:
        def draw(inputs: Mapping[str, Any]) -> Figure | NotComputed:
            figure = attempt(recipe.key, partial(recipe.draw, inputs), failed)
            if figure is None:
                return NotComputed(recipe.key, recipe.number, recipe.title)
            if isinstance(figure, Figure):
                drawn[recipe.key] = figure
            return figure

        return replace(recipe, draw=draw)

    return tuple(kept(recipe) for recipe in recipes), drawn


def write_companions(out: Path, evidence: Evidence, figures: Mapping[str, Figure], depth: str) -> tuple[Path, ...]:
    """Write all files that accompany the report in `out`, the RO-Crate metadata last; return the files."""
    numbers = write_numbers(out / NUMBERS_NAME, collect_numbers(evidence, figures, depth))
    changed = _write_changes(out / DIRTY_NAME)
    beside = {name: text for name, text in _TEXTS.items() if (out / name).is_file()}
    crate = write_crate(out, beside, evidence.manifest, evidence.provenance)
    return tuple(path for path in (numbers, changed, crate) if path)


def _write_changes(path: Path) -> Path | None:
    """Write the uncommitted changes and return the file; without any, remove an older file and return None."""
    path.unlink(missing_ok=True)
    changes = uncommitted_changes()
    if not changes:
        return None
    path.write_text(changes + "\n", encoding="utf-8")
    return path
