"""The style of the figures: one colour, line and marker per world, the same in every figure.

Colours are those of Okabe and Ito (safe for colour-blind readers); line styles and markers differ
as well, so that a grey print can be read. The page maps each colour to a variable, so that dark
mode can use other colours.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import count
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
    name: str = ""  # name of the curve, in the drawing and in its legend


# One row per method, world or quantity: the names that figures give it, and its style. All styles
# differ, and each method, world or quantity has the same style in every figure. No other row has
# the colour and marker of a world.
LOOKS: tuple[tuple[tuple[str, ...], LineStyle], ...] = (
    # the worlds of the paper and of this project
    (("ideal",), LineStyle(INK, "", (), 2.4)),
    (("IAPB", "pfull", "factored"), LineStyle(BLUE, "o", (), 1.6)),
    (("PB", "stiff springs only"), LineStyle(VERMILION, "s", (5, 1.6), 1.5)),
    (("CBuc",), LineStyle(PURPLE, "^", (1.4, 1.4), 1.6)),
    (("ideal-friction",), LineStyle(INK, "D", (4, 1.6), 1.6)),
    (("IAPB-friction",), LineStyle(SKY, "v", (6, 1.6, 1.4, 1.6), 1.5)),
    (("IAPB-push",), LineStyle(AMBER, "P", (3, 1.2), 1.5)),
    # IAPB with a limited device
    (("psaturated",), LineStyle(LINK, "X", (5, 1.6), 1.5)),
    (("pscaled",), LineStyle(SKY, "D", (1.4, 1.4), 1.6)),
    (("pspread", "IAPB LM"), LineStyle(NAVY, "D", (6, 1.6, 1.4, 1.6), 1.6)),
    # walls as stiff as the step allows
    (("IAPB, stiff springs",), LineStyle(SKY, "P", (3, 1.2), 1.4)),
    # methods for an impact
    (("factored, no clamp",), LineStyle(SKY, "s", (5, 1.6))),
    (("printed, numpy", "gram_pinv", "gram_pinv, as printed"), LineStyle(PURPLE, "s", (4, 2), 1.4)),
    # other people's engines, called from Python
    (("MuJoCo", "MuJoCo, from Python"), LineStyle(AMBER, "D", (6, 1.6, 1.4, 1.6), filled=False)),
    # worlds called from Python
    (("rigid wall, from Python",), LineStyle(INK, "o", (), 1.6, filled=False)),
    # rows of an impact
    (("relative rows (12)",), LineStyle(BLUE, "D")),
    (("per-body rows (13)-(14)",), LineStyle(VERMILION, "X", (5, 1.6))),
    (("event by event",), LineStyle(GREEN, ">", (1.4, 1.4))),
    # Figure 3
    (("uniform rods",), LineStyle(SKY, "o", (), 1.8)),
    (("point masses",), LineStyle(PURPLE, "o", (5, 1.6), 1.5, filled=False)),
)
STYLES: dict[str, LineStyle] = {
    name: replace(look, name=name) for names, look in LOOKS for name in names
}

BOUND = LineStyle(INK, "", (4, 2), 1.2)  # what is measured against: a bound, the value before

# marks of maps and tables: the outcome of a trial
OUTCOMES: dict[str, LineStyle] = {
    "holds": LineStyle(BLUE, "o", (), 0.0),
    "fails": LineStyle(VERMILION, "X", (), 0.0),
    "cannot tell": LineStyle(MUTED, "o", (), 0.0, filled=False),
}

# series that are ours to number: sizes, scenes, filters; none looks like a world
CYCLE = (
    LineStyle(SKY, "o"),
    LineStyle(AMBER, "s", (5, 1.6)),
    LineStyle(GREEN, "^", (1.4, 1.4)),
    LineStyle(MUTED, "D", (6, 1.6, 1.4, 1.6)),
    LineStyle(BLUE, "v"),
    LineStyle(VERMILION, "P", (3, 1.2)),
    LineStyle(INK, "X", (1, 1)),
    LineStyle(GREEN, "*", (4, 1, 1, 1)),
    LineStyle(AMBER, "<", (8, 2)),
    LineStyle(PURPLE, ">", (8, 2, 1, 2)),
)

PARAMETERS: Any = {
    "svg.hashsalt": "iapb",
    "svg.fonttype": "none",
    "path.simplify": True,
    "path.simplify_threshold": 0.15,
    "font.family": ["DejaVu Sans"],
    "font.size": 9.0,
    "axes.labelsize": 9.0,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "axes.titlesize": 9.5,
    "axes.titleweight": "normal",
    "axes.titlelocation": "left",
    "text.color": INK,
    "axes.labelcolor": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.7,
    "axes.facecolor": "none",
    "figure.facecolor": "none",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": RULE,
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "xtick.major.size": 3,
    "ytick.major.size": 3,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "lines.solid_capstyle": "round",
    "lines.solid_joinstyle": "round",
    "legend.frameon": False,
    "axes.unicode_minus": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 5),
    "axes.formatter.use_mathtext": False,
    "axes.xmargin": 0.02,
    "axes.ymargin": 0.06,
    "hatch.linewidth": 0.6,
    "hatch.color": MUTED,
}

PANEL = (4.1, 3.0)  # inches: two or three of them stand beside each other on a desk, one on a phone


def looks_of(names: Iterable[str]) -> dict[str, LineStyle]:
    """Return the style of each name: its own style if it has one, else the next numbered style."""
    numbers = count()
    return {
        name: STYLES[name] if name in STYLES else numbered(next(numbers), name)
        for name in dict.fromkeys(names)
    }


def numbered(number: int, name: str = "") -> LineStyle:
    """Return the style of a numbered series; when the colours repeat, markers are hollow."""
    return replace(CYCLE[number % len(CYCLE)], filled=number < len(CYCLE), name=name)


def line_arguments(style: LineStyle, *, marked: bool = True) -> dict[str, Any]:
    """Return the keyword arguments with which matplotlib draws a curve of this style."""
    return {
        **({"gid": f"curve={style.name}"} if style.name else {}),
        "color": style.color,
        "linewidth": style.width,
        "linestyle": (0, style.dash) if style.dash else "-",
        "marker": style.marker if marked else "",
        "markersize": 4.2,
        "markerfacecolor": style.color if style.filled else PAPER,
        "markeredgecolor": style.color if not style.filled else PAPER,
        "markeredgewidth": 0.6 if style.filled else 1.2,
    }
