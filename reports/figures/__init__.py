"""The figures of the report: texts and order are in figures.toml, recipes in the modules of their
topics."""

from __future__ import annotations

from reports.figures import (  # noqa: F401
    complementarity,
    corner,
    cost,
    energy,
    hard_cases,
    paper,
    port,
    tilts,
)
from reports.figures.figure import MADE, TEXTS, Recipe

RECIPES: tuple[Recipe, ...] = tuple(MADE[key] for key in TEXTS)
