"""The style of the figures: one colour, line and marker per world, the same in every figure.

Colours are those of Okabe and Ito (safe for colour-blind readers); line styles and markers differ
as well, so that a grey print can be read. The page maps each colour to a variable, so that dark
mode can use other colours.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import cycle
from typing import Any

INK = "#1b1f24"
MUTED = "#66707b"
RULE = "#d9dde2"
PAPER = "#fffefc"
WALL = "#c9cdd2"
PEG = "#dbe7f1"
FORCE = "#b3261e"
LINK = "#8fa3b5"
BLUE = "#0072b2"
VERMILION = "#d55e00"
GREEN = "#00896a"
PURPLE = "#a5508a"
AMBER = "#b07d00"
SKY = "#3a97cf"
NAVY = "#0b3f7d"

# hex value -> name of the page's variable; the hex value itself stays the fallback outside of the
# page
VARIABLES = {
    INK: "ink",
    MUTED: "muted",
    RULE: "rule",
    PAPER: "paper",
    WALL: "wall",
    PEG: "peg",
    FORCE: "force",
    LINK: "link-body",
    BLUE: "blue",
    VERMILION: "vermilion",
    GREEN: "green",
    PURPLE: "purple",
    AMBER: "amber",
    SKY: "sky",
    NAVY: "navy",
}


def css(color: str) -> str:
    """Return a colour of this table as CSS: the page's variable, with the colour itself as
    fallback."""
    return f"var(--{VARIABLES[color]}, {color})"


@dataclass(frozen=True)
class LineStyle:
    """Colour, dash pattern, marker and width of one curve; `dash` is in points, () = solid."""

    color: str
    marker: str = ""
    dash: tuple[float, ...] = ()
    width: float = 1.5
    filled: bool = True


# All styles differ, and each method, world or quantity has the same style in every figure. No other
# one has the colour and marker of a world.
STYLES: dict[str, LineStyle] = {
    # the worlds of the paper and of this project
    "ideal": LineStyle(INK, "", (), 2.4),
    "IAPB": LineStyle(BLUE, "o", (), 1.6),
    "PB": LineStyle(VERMILION, "s", (5, 1.6), 1.5),
    "CBuc": LineStyle(PURPLE, "^", (1.4, 1.4), 1.6),
    "ideal-friction": LineStyle(INK, "D", (4, 1.6), 1.6),
    "IAPB-friction": LineStyle(SKY, "v", (6, 1.6, 1.4, 1.6), 1.5),
    "IAPB-push": LineStyle(AMBER, "P", (3, 1.2), 1.5),
    # IAPB with a limited device
    "psaturated": LineStyle(LINK, "X", (5, 1.6), 1.5),
    "pscaled": LineStyle(SKY, "D", (1.4, 1.4), 1.6),
    "pspread": LineStyle(NAVY, "D", (6, 1.6, 1.4, 1.6), 1.6),
    # walls as stiff as the step allows
    "IAPB, stiff springs": LineStyle(SKY, "P", (3, 1.2), 1.4),
    # other people's engines, and worlds called from Python
    "MuJoCo": LineStyle(AMBER, "D", (6, 1.6, 1.4, 1.6), filled=False),
    "rigid wall, from Python": LineStyle(INK, "o", (), 1.6, filled=False),
    # Figure 3
    "uniform rods": LineStyle(SKY, "o", (), 1.8),
    "point masses": LineStyle(PURPLE, "o", (5, 1.6), 1.5, filled=False),
}
_SAME = {
    "pfull": "IAPB",
    "stiff springs only": "PB",
    "IAPB LM": "pspread",
    "MuJoCo, from Python": "MuJoCo",
}
STYLES |= {name: STYLES[same] for name, same in _SAME.items()}

BOUND = LineStyle(INK, "", (4, 2), 1.2)  # what is measured against: a bound, the value before

# marks of maps and tables: the outcome of a trial
OUTCOMES: dict[str, LineStyle] = {
    "holds": LineStyle(BLUE, "o", (), 0.0),
    "fails": LineStyle(VERMILION, "X", (), 0.0),
    "cannot tell": LineStyle(MUTED, "o", (), 0.0, filled=False),
}

# worlds and laws of one's own, in this order; none looks like a world above
OTHERS = (
    LineStyle(SKY, "o"),
    LineStyle(AMBER, "s", (5, 1.6)),
    LineStyle(GREEN, "^", (1.4, 1.4)),
    LineStyle(MUTED, "D", (6, 1.6, 1.4, 1.6)),
    LineStyle(BLUE, "v"),
    LineStyle(VERMILION, "P", (3, 1.2)),
)

PANEL = (4.1, 3.0)  # inches: two or three of them stand beside each other on a desk, one on a phone


def looks_of(names: Iterable[str]) -> dict[str, LineStyle]:
    """Return the style of each name: its own style if it has one, else the next of OTHERS."""
    others = cycle(OTHERS)
    return {name: STYLES.get(name) or next(others) for name in dict.fromkeys(names)}


def line_arguments(style: LineStyle, *, marked: bool = True) -> dict[str, Any]:
    """Return the keyword arguments with which matplotlib draws a curve of this style."""
    return {
        "color": style.color,
        "linewidth": style.width,
        "linestyle": (0, style.dash) if style.dash else "-",
        "marker": style.marker if marked else "",
        "markersize": 4.2,
        "markerfacecolor": style.color if style.filled else PAPER,
        "markeredgecolor": style.color if not style.filled else PAPER,
        "markeredgewidth": 0.6 if style.filled else 1.2,
    }
