"""All pages of a report as one text, for tests that ask what is said and not where."""

from __future__ import annotations

from collections.abc import Sequence

from reports.figures import RECIPES
from reports.figures.figure import Recipe
from reports.pages.builder import build_report
from reports.pages.records import Evidence


def joined(evidence: Evidence, recipes: Sequence[Recipe] = RECIPES) -> str:
    """Every page, the first page first."""
    return "\n".join(build_report(evidence, recipes).values())
