"""C18: false collisions of a ball that rolls in a faceted socket, in time, with and without the filters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.canvas import note
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.style import CYCLE, PANEL, line_arguments, styled
from reports.figures.svg import to_svg
from verification.finding import Table

KEY, TITLE = "socket-collisions", "A ball rolls in a faceted socket"
TIMES, COUNTS = "mechanics/false collisions in time", "mechanics/false collisions"
SETTINGS = ("no filter", "coherence alone", "clustering alone", "both filters")
DAMPING = 40.0  # [N s/m] of the panels in time: the scene's own
DURATION = 2.0  # [s]
CAPTION = (
    "In the round socket that the facets stand for, the ball touches once and never collides again: every further "
    "collision is false. Coherence keeps the contact of the next facet from being new; clustering alone leaves one "
    "contact that jumps, new each time. Last panel: at low damping the ball bounces off the edges, and what comes back "
    "is new to both filters."
)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw counts and losses in time, and the counts over damping."""
    times, counts = inputs[TIMES], inputs[COUNTS]
    panels = (
        Panel(_in_time(times, "false collisions so far", "false collisions so far"), _words(counts),
              f"False collisions, {DAMPING:g} N s/m"),
        Panel(_in_time(times, "lost so far, of the fall", "lost in them, share of the fall"),
              "Energy lost in false collisions, cumulative.", "Energy that they take"),
        Panel(_bars(counts), _words(counts), "By damping of the contact"),
    )  # fmt: skip
    return Figure(KEY, "", TITLE, CAPTION, panels, counts, tuple(zip(SETTINGS, CYCLE, strict=False)), (TIMES, COUNTS))


def _in_time(numbers: Table, column: str, label: str) -> str:
    with styled() as new_figure:
        drawing = new_figure(figsize=PANEL, layout="constrained")
        axes = drawing.add_subplot()
        for number, setting in enumerate(SETTINGS):
            mine = numbers.where(filters=setting, damping=DAMPING)
            time, value = [0.0, *mine.column("time"), DURATION], [0.0, *mine.column(column)]
            look = line_arguments(CYCLE[number], marked=bool(mine.rows))
            axes.step(time, [*value, value[-1]], where="post", **look | {"markevery": 4, "clip_on": False})
        axes.set(xlabel="time [s]", ylabel=label, xlim=(0.0, DURATION))
        axes.set_ylim(bottom=0.0)
        shown = set(numbers.where(damping=DAMPING).column("filters"))
        none = " and ".join(setting for setting in SETTINGS if setting not in shown)
        note(axes, (DURATION, 0.0), f"{none}: none" if none else "", (-2, 8), ha="right", fontsize=8.5)
        return to_svg(drawing, f"{KEY}-{numbers.keys.index(column)}")


def _bars(numbers: Table) -> str:
    dampings = sorted(set(numbers.column("damping")))
    with styled() as new_figure:
        drawing = new_figure(figsize=PANEL, layout="constrained")
        axes = drawing.add_subplot()
        for number, setting in enumerate(SETTINGS):
            heights = [numbers.where(filters=setting, damping=b).column("false collisions")[0] for b in dampings]
            places = [k + 0.2 * (number - 1.5) for k in range(len(dampings))]
            axes.bar(places, heights, width=0.17, color=CYCLE[number].color)
            for place, height in zip(places, heights, strict=True):
                note(axes, (place, height), str(height), (0, 6), fontsize=8)
        axes.set_xticks(range(len(dampings)), [f"{b:g}" for b in dampings])
        axes.grid(visible=False, axis="x")
        axes.set(xlabel="damping of the contact [N s/m]", ylabel="false collisions in 2 s")
        return to_svg(drawing, f"{KEY}-damping")


def _words(numbers: Table) -> str:
    found = (f"{row['filters']} {row['false collisions']}" for row in numbers.where(damping=DAMPING).records())
    return f"False collisions in two seconds at {DAMPING:g} N s/m: {', '.join(found)}."


RECIPE = Recipe(KEY, "", TITLE, (TIMES, COUNTS), draw, section="mechanics")
