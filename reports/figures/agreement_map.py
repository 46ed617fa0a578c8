"""Where IAPB and the Newton LCP move alike: share and distance over families, and the exact border of two contacts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.style import BLUE, INK, MUTED, PAPER, STYLES, VERMILION, line_arguments, styled
from reports.figures.svg import to_svg
from verification.finding import Table

KEY, TITLE = "agreement-map", "Where IAPB and complementarity move alike"
MAP, BORDER = "complementarity/map", "complementarity/two contacts"
CAPTION = (
    "First picture: a row for each kind of impact and number of redundant rows; the blue bar is the share of "
    "impacts in which both laws give one motion, the ticks are those of e = 0, 0.5 and 1, which lie on one "
    "another. Second picture: by how much the others differ, median and largest, for e = 0, 0.5 and 1: the "
    "distance grows as 1 + e. Third picture: two contacts alone, whose rows have the cosine c in the kinetic "
    "metric and which close at speeds 1 and r. They agree on and above the line r = c, and nowhere below."
)
FAMILY, RESTITUTION, REDUNDANT, SHARE = "impacts", "e", "redundant rows", "share that agrees"
TYPICAL, FARTHEST = "median distance where they differ", "largest distance"
_BORDER = ("cosine", "speed ratio", "agreement predicted", "agreement found")
_SIZES = {0.0: 3.4, 0.5: 4.6, 1.0: 5.8}  # marker by restitution


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw share and distance of the map, and the border."""
    numbers: Table = inputs[MAP]
    rows = numbers.records()
    families = [row for row in rows if not row[FAMILY].startswith("scene ")]
    kinds = list(dict.fromkeys((row[FAMILY], row[REDUNDANT]) for row in families))
    panels = (
        Panel(_shares(families, kinds), _share_words(families), "share of impacts that agree"),
        Panel(_distances(families, kinds), "Distances of the motions, by kind.", "distance where they differ"),
        Panel(_border(inputs[BORDER]), _border_words(inputs[BORDER]), "two contacts"),
    )
    legend = (("agree", STYLES["holds"]), ("differ", STYLES["fails"]), ("r = c", STYLES["bound"]))
    return Figure(KEY, "", TITLE, CAPTION, panels, numbers, legend, (MAP, BORDER))


def _shares(rows: list[dict[str, Any]], kinds: list[tuple[str, int]]) -> str:
    with styled() as new_figure:
        axes, drawing = _rows_of(new_figure, kinds)
        for y, kind in enumerate(kinds):
            shares = [row[SHARE] for row in rows if (row[FAMILY], row[REDUNDANT]) == kind]
            axes.barh(y, 1.0, height=0.62, color=VERMILION, alpha=0.18, linewidth=0)
            axes.barh(y, sum(shares) / len(shares), height=0.62, color=BLUE, linewidth=0)
            axes.plot(shares, [y] * len(shares), "|", color=INK, markersize=7)
        axes.set(xlim=(0.0, 1.005), xlabel="share of impacts with one motion")
        return to_svg(drawing, f"{KEY}-share")


def _distances(rows: list[dict[str, Any]], kinds: list[tuple[str, int]]) -> str:
    with styled() as new_figure:
        axes, drawing = _rows_of(new_figure, kinds)
        for y, kind in enumerate(kinds):
            members = [row for row in rows if (row[FAMILY], row[REDUNDANT]) == kind and row[TYPICAL] is not None]
            if not members:
                axes.plot(0.0, y, "o", markersize=4, markerfacecolor=PAPER, markeredgecolor=MUTED)
            for row in members:
                shift = y + 0.22 * (2.0 * row[RESTITUTION] - 1.0)
                axes.plot([row[TYPICAL], row[FARTHEST]], [shift, shift], "-", color=VERMILION, linewidth=1.1)
                axes.plot(row[TYPICAL], shift, "X", color=VERMILION, markeredgecolor=PAPER, markeredgewidth=0.4,
                          markersize=_SIZES.get(row[RESTITUTION], 4.6))  # fmt: skip
        axes.set(xlim=(-0.03, 2.05), xlabel="distance of v⁺, of |v⁻| (ring: none differ)")
        return to_svg(drawing, f"{KEY}-distance")


def _rows_of(new_figure: Any, kinds: list[tuple[str, int]]) -> tuple[Any, Any]:
    drawing = new_figure(figsize=(4.6, 0.24 * len(kinds) + 0.7), layout="constrained")
    axes = drawing.add_subplot()
    axes.set_yticks(range(len(kinds)), [f"{family}, {redundant}" for family, redundant in kinds])
    axes.set_ylim(len(kinds) - 0.5, -0.5)
    axes.grid(False, axis="y")
    return axes, drawing


def _border(numbers: Table) -> str:
    with styled() as new_figure:
        drawing = new_figure(figsize=(4.1, 3.4), layout="constrained")
        axes = drawing.add_subplot()
        axes.plot([0.0, 1.0], [0.0, 1.0], **line_arguments(STYLES["bound"], marked=False))
        for cosine, ratio, predicted, found in numbers.select(_BORDER).rows:
            axes.plot(cosine, ratio, "o" if found else "x", color=BLUE if found else VERMILION, markersize=6,
                      markeredgewidth=1.4)  # fmt: skip
            if predicted != found:
                axes.plot(cosine, ratio, "s", markersize=12, markerfacecolor="none", markeredgecolor=INK)
        axes.set(xlim=(-1.02, 1.02), ylim=(0.0, 1.06), xlabel="cosine c of the two rows", ylabel="speed ratio r")
        return to_svg(drawing, f"{KEY}-border")


def _share_words(rows: list[dict[str, Any]]) -> str:
    whole = sorted({row[FAMILY] for row in rows} - {row[FAMILY] for row in rows if row[SHARE] < 1.0})
    return f"Shares of impacts with one motion, by kind; all of them for {', '.join(whole)}."


def _border_words(numbers: Table) -> str:
    right = sum(predicted == found for predicted, found in numbers.select(_BORDER[2:]).rows)
    return f"Agreement of two contacts is as predicted by r >= c at {right} of {len(numbers.rows)} points."


RECIPE = Recipe(KEY, "", TITLE, (MAP, BORDER), draw, section="complementarity")
