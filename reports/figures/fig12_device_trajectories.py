"""Figure 12: device trajectories of an emulated 512 Hz device (the paper: an experiment).

Emulated: quantised, delayed and damped as the scene says; no hardware took part.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.figure import Figure, Recipe
from reports.figures.trajectories import trajectory_numbers, trajectory_panels
from reports.figures.worlds import DEVICE, legend_of, runs_of

KEY, NUMBER, TITLE = "fig12", "Figure 12", "Emulated device at 512 Hz: trajectories"
CAPTION = (
    "The paper measured these on hardware; here the device is emulated at 512 Hz with the delay, quantisation and "
    "damping that the scene states. Look at how often each curve bounces, and when it comes to rest."
)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw the figure from the runs named in worlds.DEVICE."""
    runs = runs_of(DEVICE, inputs)
    panels = trajectory_panels(KEY, runs)
    numbers = trajectory_numbers(runs, None)
    return Figure(KEY, NUMBER, TITLE, CAPTION, panels, numbers, legend_of(DEVICE), tuple(DEVICE.values()))


RECIPE = Recipe(KEY, NUMBER, TITLE, tuple(DEVICE.values()), draw)
