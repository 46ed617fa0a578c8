"""Figure 8: force along x and torque applied to the hand in the runs of Figure 7.

Large on new contact, balancing the hand afterwards.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.figure import Figure, Recipe
from reports.figures.forces import force_numbers, force_panels
from reports.figures.worlds import UNLIMITED, legend_of, runs_of

KEY, NUMBER, TITLE = "fig08", "Figure 8", "Forces that the hand feels"
CAPTION = (
    "In full: a new contact answers with one blow of one step in the worlds with impulses. Magnified: "
    "what remains between blows, to be compared with the 0.32 N that balances the hand."
)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw the figure from the runs named in worlds.UNLIMITED."""
    runs = runs_of(UNLIMITED, inputs)
    panels = force_panels(KEY, runs)
    numbers = force_numbers(runs)
    return Figure(KEY, NUMBER, TITLE, CAPTION, panels, numbers, legend_of(UNLIMITED), tuple(UNLIMITED.values()))


RECIPE = Recipe(KEY, NUMBER, TITLE, tuple(UNLIMITED.values()), draw)
