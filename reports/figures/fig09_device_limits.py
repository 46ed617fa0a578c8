"""Figure 9: IAPB when the device is limited: saturate, scale, or spread the impulse.

Limits of the scene: 15 N, 15 N, 1 N m.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.figure import Figure, Recipe
from reports.figures.trajectories import (
    penetration_panel,
    separation_panel,
    trajectory_numbers,
    trajectory_panels,
)
from reports.figures.worlds import STRATEGIES, legend_of, runs_of

KEY, NUMBER, TITLE = "fig09", "Figure 9", "Three ways to live with a weak device"
CAPTION = (
    "The device can apply 15 N and 1 N m only. Saturating clips what the device gets, so that tool and device come "
    "apart (fifth panel); scaling weakens the blow for both; spreading repeats the scaled blow in the next steps."
)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw the figure from the runs named in worlds.STRATEGIES."""
    runs = runs_of(STRATEGIES, inputs)
    panels = (*trajectory_panels(KEY, runs), separation_panel(KEY, runs), penetration_panel(KEY, runs))
    numbers = trajectory_numbers(runs)
    return Figure(KEY, NUMBER, TITLE, CAPTION, panels, numbers, legend_of(STRATEGIES), tuple(STRATEGIES.values()))


RECIPE = Recipe(KEY, NUMBER, TITLE, tuple(STRATEGIES.values()), draw)
