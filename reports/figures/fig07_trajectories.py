"""Figure 7: hand trajectories of the four worlds, device without limits.

Paper's caption: IAPB is closest to ideal.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.figure import Figure, Recipe
from reports.figures.trajectories import trajectory_numbers, trajectory_panels
from reports.figures.worlds import UNLIMITED, legend_of, runs_of

KEY, NUMBER, TITLE = "fig07", "Figure 7", "Hand trajectories of the four worlds"
CAPTION = (
    "The peg starts from rest, tilted, and a constant force pushes it into the lower right corner. The thick line "
    "(“ideal”) is the rigid world. Look at which curve leaves it at the first contact, and which come back to it. The "
    "device can apply any force here."
)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw the figure from the runs named in worlds.UNLIMITED."""
    runs = runs_of(UNLIMITED, inputs)
    panels = trajectory_panels(KEY, runs)
    numbers = trajectory_numbers(runs)
    return Figure(KEY, NUMBER, TITLE, CAPTION, panels, numbers, legend_of(UNLIMITED), tuple(UNLIMITED.values()))


RECIPE = Recipe(KEY, NUMBER, TITLE, tuple(UNLIMITED.values()), draw)
