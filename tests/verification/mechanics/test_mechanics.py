"""The topic of the mechanics: its figures are drawn from its tables."""

from __future__ import annotations

import numpy as np

from reports.figures import RECIPES
from reports.figures.figure import TEXTS, draw
from reports.figures.mechanics import BERNOULLI, CRADLE, outcomes
from verification.check import Study
from verification.mechanics import linked_impacts
from verification.mechanics.mechanics import mechanics

SHOWN = ("linked impacts", "coordinate invariance", "tumbling", "false collisions in time", "false collisions")


def test_every_figure_of_the_topic_is_drawn_from_its_tables() -> None:
    study = Study()
    tables = {check.key: check.table(study) for check in mechanics.checks if check.key in SHOWN}
    inputs = {f"mechanics/{key}": table for key, table in tables.items()}
    drawn = [draw(recipe, inputs) for recipe in RECIPES if TEXTS[recipe.key].get("section") == "mechanics"]
    assert len(drawn) >= 4 and all(figure.panels for figure in drawn)
    assert all(panel.svg.startswith("<svg") and panel.alt for figure in drawn for panel in figure.panels)
    for problem, balls in ((CRADLE, linked_impacts.cradle()), (BERNOULLI, linked_impacts.bernoulli())):
        read = outcomes(tables["linked impacts"], problem)
        for ours, (treatment, rows, velocity) in zip(read, linked_impacts.outcomes(balls), strict=True):
            assert (ours.treatment, ours.rows) == (treatment, rows)
            np.testing.assert_array_equal(ours.velocity, velocity)
