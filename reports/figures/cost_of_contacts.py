"""What one impact costs by each solver, over the number of contacts; and what one step costs in each world."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.energy_gains import plain_powers
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.style import (
    AMBER,
    BLUE,
    CYCLE,
    GREEN,
    INK,
    MUTED,
    SKY,
    VERMILION,
    LineStyle,
    line_arguments,
    styled,
)
from reports.figures.svg import to_svg
from verification.finding import Table

KEY, TITLE = "cost-of-contacts", "What an impact costs"
COSTS, STEPS = "complementarity/time per impact", "complementarity/time per step"
CAPTION = (
    "Median time of one impact over its number of contacts; the band reaches from the least to the largest "
    "sample. Full lines are called from Python, dashed ones from compiled code: compare like with like. A cross: "
    "the solver answered wrongly. A triangle at the top: it was left out, too slow for fewer contacts. On a patch "
    "all contacts beyond three are redundant, and IAPB drops them; in a pile none is, and a dense factor costs "
    "what it costs. Last picture: one step of each world."
)
FAMILY, CONTACTS, SOLVER, OUTCOME = "impacts", "contacts", "solver", "outcome"
MEDIAN, LEAST, LARGEST = "median", "least", "largest"
# What is compiled is dashed; IAPB is blue, the rest keeps the numbered styles.
COMPILED = {"IAPB kernel": LineStyle(BLUE, "o", (4, 1.6), 1.6, False),
            "Lemke kernel": LineStyle(VERMILION, "s", (4, 1.6), 1.6, False)}  # fmt: skip
CALLED = {"IAPB": LineStyle(BLUE, "o", (), 2.2), "IAPB printed formula": LineStyle(SKY, "D", (), 1.2),
          "lemke": LineStyle(VERMILION, "s", (), 1.4), "daqp": LineStyle(GREEN, "^", (), 1.4),
          "quadprog": LineStyle(AMBER, "v", (), 1.2), "gauss_seidel": LineStyle(MUTED, "P", (), 1.2),
          "proxqp": LineStyle(INK, "*", (), 1.0)}  # fmt: skip
_SIZE = (4.6, 3.9)


def looks(solvers: list[str]) -> dict[str, LineStyle]:
    """A style for each solver; those that have none of their own are numbered."""
    known = COMPILED | CALLED
    others = [name for name in solvers if name not in known]
    return {name: known[name] if name in known else CYCLE[(3 + others.index(name)) % len(CYCLE)] for name in solvers}


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw a panel for each family, and the steps."""
    numbers: Table = inputs[COSTS]
    rows = numbers.records()
    styles = looks(list(dict.fromkeys(row[SOLVER] for row in rows)))
    panels = [Panel(_curves(rows, styles, family), _words(rows, family), family)
              for family in dict.fromkeys(row[FAMILY] for row in rows)]  # fmt: skip
    panels.append(Panel(_steps(inputs[STEPS]), _step_words(inputs[STEPS]), "one step of a world"))
    return Figure(KEY, "", TITLE, CAPTION, tuple(panels), numbers, tuple(styles.items()), (COSTS, STEPS))


def _curves(every: list[dict[str, Any]], styles: dict[str, LineStyle], family: str) -> str:
    rows = [row for row in every if row[FAMILY] == family]
    top = 3.0 * max(row[LARGEST] for row in rows if row[LARGEST] is not None)
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE, layout="constrained")
        axes = drawing.add_subplot()
        for name, style in styles.items():
            timed = [row for row in rows if row[SOLVER] == name and row[MEDIAN] is not None]
            at = [row[CONTACTS] for row in timed]
            if len(at) > 1:
                axes.fill_between(at, [row[LEAST] for row in timed], [row[LARGEST] for row in timed], color=style.color,
                                  alpha=0.13, linewidth=0)  # fmt: skip
            axes.plot(at, [row[MEDIAN] for row in timed], **line_arguments(style))
            _unsolved(axes, [row for row in rows if row[SOLVER] == name], style, top)
        axes.set(xscale="log", yscale="log", xlabel="contacts", ylabel="time of one impact [µs]")
        plain_powers(axes)
        _contact_ticks(axes, sorted({row[CONTACTS] for row in rows}))
        return to_svg(drawing, f"{KEY}-{family}")


def _unsolved(axes: Any, rows: list[dict[str, Any]], style: LineStyle, top: float) -> None:
    """Crosses over wrong answers, triangles where nothing was asked."""
    for row in rows:
        if row[OUTCOME] == "failed" and row[MEDIAN] is not None:
            axes.plot(row[CONTACTS], row[MEDIAN], "x", color=style.color, markersize=10, markeredgewidth=1.8, zorder=5)
        elif row[MEDIAN] is None:
            axes.plot(row[CONTACTS], top, "^", color=style.color, markersize=6, zorder=5)


def _contact_ticks(axes: Any, contacts: list[int]) -> None:
    from matplotlib.ticker import NullLocator

    axes.set_xticks(contacts, [str(count) for count in contacts])
    axes.xaxis.set_minor_locator(NullLocator())


def _steps(numbers: Table) -> str:
    rows = numbers.records()
    ways, scenes = (list(dict.fromkeys(row[name] for row in rows)) for name in ("world", "scene"))
    with styled() as new_figure:
        drawing = new_figure(figsize=(4.6, 2.4), layout="constrained")
        axes = drawing.add_subplot()
        for number, scene in enumerate(scenes):
            style = CYCLE[number % len(CYCLE)]
            for row in rows:
                if row["scene"] == scene:
                    y = ways.index(row["world"]) + 0.24 * (number - (len(scenes) - 1) / 2)
                    axes.plot([row[LEAST], row[LARGEST]], [y, y], color=style.color, linewidth=1.2)
                    axes.plot(row[MEDIAN], y, style.marker, color=style.color, markersize=5)
            axes.plot([], [], style.marker, color=style.color, label=scene)
        axes.set_yticks(range(len(ways)), ways)
        axes.set(xscale="log", xlabel="time of one step [µs]", ylim=(len(ways) - 0.4, -0.6))
        plain_powers(axes)
        axes.set_yticks(range(len(ways)), ways)
        axes.legend(loc="upper right", fontsize=8)
        return to_svg(drawing, f"{KEY}-steps")


def _words(rows: list[dict[str, Any]], family: str) -> str:
    most = max(row[CONTACTS] for row in rows)
    texts = [f"{row[SOLVER]} {row[MEDIAN]:.3g}" for row in rows
             if row[FAMILY] == family and row[CONTACTS] == most and row[MEDIAN] is not None]  # fmt: skip
    return f"Median times of a {family} of {most} contacts in microseconds: {', '.join(texts)}."


def _step_words(numbers: Table) -> str:
    return "Median times of one step in microseconds: " + ", ".join(
        f"{scene} {way} {median:.3g}" for scene, way, median, *_ in numbers.rows) + "."  # fmt: skip


RECIPE = Recipe(KEY, "", TITLE, (COSTS, STEPS), draw, section="complementarity")
