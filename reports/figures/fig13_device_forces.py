"""Figure 13: forces of an emulated 512 Hz device (the paper: an experiment).

Emulated: quantised, delayed and damped as the scene says; no hardware took part.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.figure import Figure, Recipe
from reports.figures.forces import force_numbers, force_panels
from reports.figures.worlds import DEVICE, legend_of, runs_of

KEY, NUMBER, TITLE = "fig13", "Figure 13", "Emulated device at 512 Hz: forces"
CAPTION = (
    "Forces of the emulated device in the runs of Figure 12. IAPB LM spreads its impulses so that each stays within "
    "the limits of the device. The fine chatter is the resolution "
    "of the encoders, felt through the damping of the position channel."
)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw the figure from the runs named in worlds.DEVICE."""
    runs = runs_of(DEVICE, inputs)
    panels = force_panels(KEY, runs)
    numbers = force_numbers(runs)
    return Figure(KEY, NUMBER, TITLE, CAPTION, panels, numbers, legend_of(DEVICE), tuple(DEVICE.values()))


RECIPE = Recipe(KEY, NUMBER, TITLE, tuple(DEVICE.values()), draw)
