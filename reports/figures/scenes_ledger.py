"""Overview of all scenes: the parts of the energy over time, and the deepest overlap of bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.numbers import format_number
from reports.figures.style import (
    AMBER,
    BLUE,
    FORCE,
    INK,
    LINK,
    MUTED,
    PURPLE,
    SKY,
    VERMILION,
    LineStyle,
    styled,
)
from reports.figures.svg import to_svg
from verification.finding import Table

# heading of the table -> (text of the legend, colour), from the bottom of the stack
LAYERS = (
    (("kinetic",), "in motion", BLUE),
    (("potential", "springs"), "in height and contact springs", SKY),
    (("lost impacts",), "lost in impacts", VERMILION),
    (("lost damping",), "lost in contact damping", AMBER),
    (("lost friction",), "lost in friction", PURPLE),
)
LEGEND = (*((text, LineStyle(color, "s", width=0.0)) for _, text, color in LAYERS),
          ("all energy so far", LineStyle(INK, width=1.2)), ("impact", LineStyle(FORCE, "|", width=0.0)))  # fmt: skip
_WIDTH, _ROW, _HEAD, _FOOT = 9.2, 0.46, 0.34, 0.12  # inches
_COLUMNS = {"energy": (0.235, 0.52), "depth": (0.785, 0.15)}  # left edge, width
_THIN = 3e-3  # share of a strip's height under which a layer cannot be seen and is not drawn
_STILL = 1e-9  # share of the heights' energy under which all motion is rounding, and is said and not drawn
_NO_DEPTH, _DEEPEST = 1e-3, 5.0  # [mm] ends of the logarithmic scale


@dataclass(frozen=True)
class Strip:
    """One scene: `layers` (5, n) and `line` (n,) [J] over `time` (n,) [s].

    struck : whether an impact occurred since the previous instant; at_rest : whether all motion is within rounding
    """

    scene: str
    time: NDArray[np.float64]
    layers: NDArray[np.float64]
    line: NDArray[np.float64]
    struck: NDArray[np.bool_]
    at_rest: bool


def strips(numbers: Table) -> tuple[Strip, ...]:
    """Return the strips of all scenes from the table of energies over time."""
    names = tuple(dict.fromkeys(numbers.column("scene")))
    return tuple(_strip(name, numbers) for name in names)


def _strip(name: str, numbers: Table) -> Strip:
    mine = numbers.where(scene=name)
    column = {key: np.array(mine.column(key), dtype=float) for key in numbers.keys[1:]}
    stored = column["potential"] + column["springs"]
    at_rest = np.ptp(column["given"]) + column["kinetic"].max() <= _STILL * np.abs(stored).max()
    lowest = stored.min()  # heights count from the lowest: only changes of a potential mean anything
    layers = np.array([sum(column[heading] for heading in headings) for headings, _, _ in LAYERS])
    layers[1] -= lowest
    line = column["kinetic"][0] + stored[0] - lowest + column["given"]
    return Strip(name, column["time"], layers, line, column["impacts"] > 0, bool(at_rest))


@recipe(
    "every-scene", "Every scene at a glance", "scene-ledger/contact", "scene-ledger/books over time",
    section="scene-ledger",
    caption="One row per scene, time from left to right. The outline is the energy at the start plus the work of hand "
    "and coupling so far. The colours show where this energy is: kinetic, potential and in springs, or lost in "
    "impacts, contact damping and friction. Where the colours stay below the outline, time stepping lost energy; where "
    "they exceed it, time stepping created energy. Ticks under a strip are impacts. Right: the deepest overlap, on a "
    "logarithmic scale.",
)  # fmt: skip
def scenes_ledger(contacts: Table, over_time: Table) -> Drawn:
    """Draw a row for every scene."""
    shown, facts = strips(over_time), {row["scene"]: row for row in contacts.records()}
    with styled() as new_figure:
        height = _HEAD + _ROW * len(shown) + _FOOT
        drawing = new_figure(figsize=(_WIDTH, height))
        for place, strip in enumerate(shown):
            bottom = (height - _HEAD - (place + 1) * _ROW) / height
            _row(drawing, bottom, _ROW / height, strip, facts)
        _headings(drawing, 1.0 - 0.55 * _HEAD / height)
        svg = to_svg(drawing, "every-scene")
    return Drawn((Panel(svg, _words(shown, facts), wide=True),), contacts, LEGEND)


def _row(drawing: Any, bottom: float, height: float, strip: Strip, facts: Mapping[str, Mapping[str, Any]]) -> None:
    fact = facts[strip.scene]
    middle = bottom + 0.55 * height
    drawing.text(0.006, middle, strip.scene.replace("_", " "), va="bottom", fontsize=9)
    drawing.text(0.006, middle, _facts_in_words(fact), va="top", fontsize=7.5, color=MUTED)
    left, width = _COLUMNS["energy"]
    _energy(drawing.add_axes((left, bottom + 0.14 * height, width, 0.78 * height)), strip)
    depth = fact["most penetration"]
    _bar(drawing, "depth", bottom, height, depth, (_NO_DEPTH, _DEEPEST), LINK,
         f"{format_number(depth, 2)} mm" if depth else "touches nothing")  # fmt: skip


def _facts_in_words(fact: Mapping[str, Any]) -> str:
    space = "in space, " if fact["dimensions"] == 3 else ""
    return f"{format_number(fact['energy exchanged'], 2)} J, {space}{fact['how it ends']}"


def _energy(axes: Any, strip: Strip) -> None:
    """Fill the layers upwards, losses on top, and draw the line over them."""
    axes.set_axis_off()
    if strip.at_rest:
        axes.text(0.0, 0.5, "nothing moves", va="center", fontsize=8, color=MUTED)
        return
    top = max(strip.line.max(), strip.layers.sum(axis=0).max())
    edge = np.zeros_like(strip.time)
    for layer, (_, _, color) in zip(strip.layers, LAYERS, strict=True):
        if np.abs(layer).max() > _THIN * top:
            axes.fill_between(strip.time, edge, edge + layer, facecolor=color, edgecolor="none", alpha=0.75)
            edge = edge + layer
    axes.plot(strip.time, strip.line, color=INK, linewidth=1.2)
    axes.plot(strip.time[strip.struck], np.full(strip.struck.sum(), -0.1 * top), "|", color=FORCE, markersize=4.5)
    axes.axhline(0.0, color=MUTED, linewidth=0.5)
    axes.set(xlim=(0.0, strip.time[-1]), ylim=(-0.2 * top, 1.08 * top))


def _bar(drawing: Any, column: str, bottom: float, height: float, value: float, scale: tuple[float, float],
         color: str, text: str) -> None:  # fmt: skip
    """Draw a value as a bar on a logarithmic scale, with its number to the right."""
    left, width = _COLUMNS[column]
    axes = drawing.add_axes((left, bottom + 0.14 * height, width, 0.78 * height))
    axes.set_axis_off()
    low, high = np.log10(scale)
    length = max(np.log10(value) - low, 0.0) / (high - low) if value > 0.0 else 0.0
    axes.barh(0.0, length, height=0.42, color=color)
    axes.text(length + 0.03, 0.0, text, va="center", fontsize=8)
    axes.set(xlim=(0.0, 1.0), ylim=(-0.5, 0.5))


def _headings(drawing: Any, height: float) -> None:
    texts = {"energy": "energy over time, each scene to its own scale", "depth": "deepest overlap"}
    for column, text in texts.items():
        drawing.text(_COLUMNS[column][0], height, text, va="center", fontsize=9)


def _words(shown: Sequence[Strip], facts: Mapping[str, Mapping[str, Any]]) -> str:
    deepest = max(facts.values(), key=lambda fact: fact["most penetration"])
    return (
        f"{len(shown)} strips of energy over time. Deepest overlap {deepest['most penetration']:.2g} mm in "
        f"{deepest['scene']}."
    )
