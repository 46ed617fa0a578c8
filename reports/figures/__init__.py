"""The figures of the report: one file each, and one line here."""

from __future__ import annotations

from reports.figures import fig03_energy_loss
from reports.figures.figure import Recipe

RECIPES: tuple[Recipe, ...] = (
    fig03_energy_loss.RECIPE,
)
