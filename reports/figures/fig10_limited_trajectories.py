"""Figure 10: as Figure 7, impulses of IAPB spread over steps to stay within the device limits.

The last panels add what the paper only speaks of: tool against device, and penetration.
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
from reports.figures.worlds import LIMITED, legend_of, runs_of

KEY, NUMBER, TITLE = "fig10", "Figure 10", "Hand trajectories with a limited device"
CAPTION = (
    "As Figure 7, but IAPB spreads its impulses over as many steps as the 15 N and 1 N m of the device ask for. The "
    "last panel shows how deep the virtual peg sinks into the walls; rigid worlds do not."
)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw the figure from the runs named in worlds.LIMITED."""
    runs = runs_of(LIMITED, inputs)
    panels = (*trajectory_panels(KEY, runs), separation_panel(KEY, runs), penetration_panel(KEY, runs))
    numbers = trajectory_numbers(runs)
    return Figure(KEY, NUMBER, TITLE, CAPTION, panels, numbers, legend_of(LIMITED), tuple(LIMITED.values()))


RECIPE = Recipe(KEY, NUMBER, TITLE, tuple(LIMITED.values()), draw)
