"""Figure 11: as Figure 8, impulses of IAPB spread over steps to stay within the device limits.

Paper's caption: though limited, they exceed the penalty forces on contact.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.figure import Figure, Recipe
from reports.figures.forces import force_numbers, force_panels
from reports.figures.worlds import LIMITED, legend_of, runs_of

KEY, NUMBER, TITLE = "fig11", "Figure 11", "Forces with a limited device"
CAPTION = (
    "As Figure 8 with spread impulses. Compare the first contact of IAPB, now spread over steps, with "
    "the slow rise of the penalty force."
)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw the figure from the runs named in worlds.LIMITED."""
    runs = runs_of(LIMITED, inputs)
    panels = force_panels(KEY, runs)
    numbers = force_numbers(runs)
    return Figure(KEY, NUMBER, TITLE, CAPTION, panels, numbers, legend_of(LIMITED), tuple(LIMITED.values()))


RECIPE = Recipe(KEY, NUMBER, TITLE, tuple(LIMITED.values()), draw)
