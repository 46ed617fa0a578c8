"""Overview of all scenes: the parts of the energy over time, and the deepest overlap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.numbers import format_number
from reports.figures.plot import Plot
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
)
from verification.table import Table

# heading of the table -> (text of the legend, colour), from the bottom of the stack
LAYERS = (
    (("kinetic",), "in motion", BLUE),
    (("potential", "springs"), "in height and contact springs", SKY),
    (("lost impacts",), "lost in impacts", VERMILION),
    (("lost damping",), "lost in contact damping", AMBER),
    (("lost friction",), "lost in friction", PURPLE),
)
LEGEND = {
    **{text: LineStyle(color, "s", width=0.0) for _, text, color in LAYERS},
    "initial energy + work": LineStyle(INK, width=1.2),
    "impact": LineStyle(FORCE, "|", width=0.0),
}
_WIDTH, _ROW, _HEAD, _FOOT = 9.2, 0.46, 0.34, 0.12  # inches
# heading -> left edge and width
_COLUMNS = {
    "energy over time, each scene to its own scale": (0.235, 0.52),
    "deepest overlap": (0.785, 0.15),
}
_THIN = 3e-3  # share of a strip's height under which a layer cannot be seen and is not drawn
# share of the heights' energy under which all motion is rounding, and is said and not drawn
_STILL = 1e-9
_DEPTHS = (1e-3, 5.0)  # [mm] ends of the logarithmic scale


@dataclass(frozen=True)
class Strip:
    """One scene: `layers` (5, n) and `line` (n,) [J] over `time` (n,) [s].

    struck : whether an impact occurred since the previous instant; at_rest : whether all motion is
        within rounding
    """

    scene: str
    time: NDArray[np.float64]
    layers: NDArray[np.float64]
    line: NDArray[np.float64]
    struck: NDArray[np.bool_]
    at_rest: bool


def strips(numbers: Table) -> tuple[Strip, ...]:
    """Return the strips of all scenes from the table of energies over time."""
    found = []
    for name in dict.fromkeys(numbers.column("scene")):
        mine = numbers.where(scene=name)
        column = {key: np.array(mine.column(key), dtype=float) for key in numbers.keys[1:]}
        stored = column["potential"] + column["springs"]
        at_rest = np.ptp(column["given"]) + column["kinetic"].max() <= _STILL * np.abs(stored).max()
        lowest = (
            stored.min()
        )  # heights count from the lowest: only changes of a potential mean anything
        layers = np.array(
            [sum(column[heading] for heading in headings) for headings, _, _ in LAYERS]
        )
        layers[1] -= lowest
        line = column["kinetic"][0] + stored[0] - lowest + column["given"]
        found.append(
            Strip(name, column["time"], layers, line, column["impacts"] > 0, bool(at_rest))
        )
    return tuple(found)


@recipe("every-scene", "scene-ledger/contact", "scene-ledger/books over time")
def scenes_ledger(contacts: Table, over_time: Table) -> Drawn:
    """Draw a row for every scene: its name, the energy over time, and the deepest overlap as a
    bar."""
    shown, facts = strips(over_time), {row["scene"]: row for row in contacts.records()}
    height = _HEAD + _ROW * len(shown) + _FOOT
    row = _ROW / height
    bottoms = [1.0 - _HEAD / height - (place + 1) * row for place in range(len(shown))]
    frames = [
        (left, bottom + 0.14 * row, width, 0.78 * row)
        for bottom in bottoms
        for left, width in _COLUMNS.values()
    ]
    with Plot("every-scene", (_WIDTH, height), bare=True, frames=frames) as plot:
        for text, (left, _) in _COLUMNS.items():
            plot.drawing.text(left, 1.0 - 0.55 * _HEAD / height, text, va="center", fontsize=9)
        for bottom, strip, energy, depth in zip(
            bottoms, shown, plot.each[::2], plot.each[1::2], strict=True
        ):
            fact, place = facts[strip.scene], bottom + 0.55 * row
            space = "in space, " if fact["dimensions"] == 3 else ""
            told = f"{format_number(fact['energy exchanged'], 2)} J, {space}{fact['how it ends']}"
            plot.drawing.text(
                0.006, place + 0.06 * row, strip.scene.replace("_", " "), va="bottom", fontsize=9
            )
            plot.drawing.text(0.006, place - 0.04 * row, told, va="top", fontsize=7.5, color=MUTED)
            _energy(energy, strip)
            value, (low, high) = fact["most penetration"], np.log10(_DEPTHS)
            length = max(np.log10(value) - low, 0.0) / (high - low) if value > 0.0 else 0.0
            depth.barh(0.0, length, height=0.42, color=LINK)
            depth.text(
                length + 0.03,
                0.0,
                f"{format_number(value, 2)} mm" if value else "touches nothing",
                va="center",
                fontsize=8,
            )
            depth.set(xlim=(0.0, 1.0), ylim=(-0.5, 0.5))
    deepest = max(facts.values(), key=lambda fact: float(fact["most penetration"]))
    words = (
        f"{len(shown)} strips of energy over time. Deepest overlap "
        f"{deepest['most penetration']:.2g} mm in "
        f"{deepest['scene']}."
    )
    return Drawn([Panel(plot.svg, words, wide=True)], contacts, LEGEND)


def _energy(axes: Any, strip: Strip) -> None:
    """Fill the layers upwards, losses on top, and draw the line over them."""
    if strip.at_rest:
        axes.text(0.0, 0.5, "nothing moves", va="center", fontsize=8, color=MUTED)
        return
    top = max(strip.line.max(), strip.layers.sum(axis=0).max())
    edge = np.zeros_like(strip.time)
    for layer, (_, _, color) in zip(strip.layers, LAYERS, strict=True):
        if np.abs(layer).max() > _THIN * top:
            axes.fill_between(
                strip.time, edge, edge + layer, facecolor=color, edgecolor="none", alpha=0.75
            )
            edge = edge + layer
    axes.plot(strip.time, strip.line, color=INK, linewidth=1.2)
    axes.plot(
        strip.time[strip.struck],
        np.full(strip.struck.sum(), -0.1 * top),
        "|",
        color=FORCE,
        markersize=4.5,
    )
    axes.axhline(0.0, color=MUTED, linewidth=0.5)
    axes.set(xlim=(0.0, strip.time[-1]), ylim=(-0.2 * top, 1.08 * top))
