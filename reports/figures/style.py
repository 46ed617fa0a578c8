"""How the figures look: one colour, line and marker per world, the same in every figure.

Colours are Okabe and Ito's (safe for colour-blind readers); line styles and markers differ as well, so that a
grey print can be read. The page maps each colour to a variable, so that dark mode is not a negative.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

INK, MUTED, RULE, PAPER = "#1b1f24", "#66707b", "#d9dde2", "#fffefc"
WALL, PEG, FORCE, LINK = "#c9cdd2", "#dbe7f1", "#b3261e", "#8fa3b5"
BLUE, VERMILION, GREEN, PURPLE, AMBER, SKY = "#0072b2", "#d55e00", "#00896a", "#a5508a", "#b07d00", "#3a97cf"

# hex value -> name of the page's variable; the hex value itself stays the fallback outside of the page
VARIABLES = {
    INK: "ink", MUTED: "muted", RULE: "rule", PAPER: "paper", WALL: "wall", PEG: "peg", FORCE: "force",
    LINK: "link-body", BLUE: "blue", VERMILION: "vermilion", GREEN: "green", PURPLE: "purple", AMBER: "amber",
    SKY: "sky",
}


@dataclass(frozen=True)
class LineStyle:
    """Colour, dash pattern, marker and width of one curve; `dash` is in points, () = solid."""

    color: str
    marker: str = ""
    dash: tuple[float, ...] = ()
    width: float = 1.5
    filled: bool = True


STYLES: dict[str, LineStyle] = {
    # worlds of Figures 7, 8, 10, 11
    "ideal": LineStyle(INK, "", (), 2.4),
    "IAPB": LineStyle(BLUE, "o", (), 1.6),
    "PB": LineStyle(VERMILION, "s", (5, 1.6), 1.5),
    "CBuc": LineStyle(GREEN, "^", (1.4, 1.4), 1.6),
    # device limits, Figure 9
    "pfull": LineStyle(BLUE, "o", (), 1.6),
    "psaturated": LineStyle(VERMILION, "s", (5, 1.6), 1.5),
    "pscaled": LineStyle(PURPLE, "D", (1.4, 1.4), 1.6),
    "pspread": LineStyle(GREEN, "^", (6, 1.6, 1.4, 1.6), 1.6),
    # emulated device, Figures 12, 13
    "IAPB LM": LineStyle(PURPLE, "D", (6, 1.6, 1.4, 1.6), 1.5),
    # Figure 3
    "KE₀": LineStyle(INK, "", (4, 2), 1.2),
    "uniform rods": LineStyle(BLUE, "o", (), 1.8),
    "point masses": LineStyle(VERMILION, "s", (5, 1.6), 1.5, filled=False),
    "bound": LineStyle(INK, "", (4, 2), 1.2),
    # maps of conditions
    "holds": LineStyle(BLUE, "o", (), 0.0),
    "fails": LineStyle(VERMILION, "X", (), 0.0),
    "cannot tell": LineStyle(MUTED, "o", (), 0.0, filled=False),
}

# series that are ours to number: methods, tolerances, ...
CYCLE = (
    LineStyle(BLUE, "o"), LineStyle(VERMILION, "s", (5, 1.6)), LineStyle(GREEN, "^", (1.4, 1.4)),
    LineStyle(PURPLE, "D", (6, 1.6, 1.4, 1.6)), LineStyle(AMBER, "v"), LineStyle(SKY, "P", (3, 1.2)),
    LineStyle(INK, "X", (1, 1)), LineStyle(MUTED, "*", (4, 1, 1, 1)), LineStyle(GREEN, "<", (8, 2)),
    LineStyle(PURPLE, ">", (8, 2, 1, 2)),
)

_PARAMETERS: Any = {
    "svg.hashsalt": "iapb", "svg.fonttype": "none", "path.simplify": True, "path.simplify_threshold": 0.15,
    "font.family": ["DejaVu Sans"], "font.size": 9.0, "axes.labelsize": 9.0, "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5, "axes.titlesize": 9.5, "axes.titleweight": "normal", "axes.titlelocation": "left",
    "text.color": INK, "axes.labelcolor": INK, "xtick.color": MUTED, "ytick.color": MUTED,
    "xtick.labelcolor": INK, "ytick.labelcolor": INK,
    "axes.edgecolor": MUTED, "axes.linewidth": 0.7, "axes.facecolor": "none", "figure.facecolor": "none",
    "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.color": RULE,
    "grid.linewidth": 0.6, "axes.axisbelow": True, "xtick.major.size": 3, "ytick.major.size": 3,
    "xtick.major.width": 0.7, "ytick.major.width": 0.7, "lines.solid_capstyle": "round",
    "lines.solid_joinstyle": "round", "legend.frameon": False, "axes.unicode_minus": True,
    "axes.formatter.useoffset": False, "axes.formatter.limits": (-4, 5), "axes.formatter.use_mathtext": False,
    "axes.xmargin": 0.02, "axes.ymargin": 0.06, "hatch.linewidth": 0.6, "hatch.color": MUTED,
}

PANEL = (4.1, 3.0)  # inches: two or three of them stand beside each other on a desk, one on a phone


def series_legend(names: Sequence[str], *, line: bool = True) -> tuple[tuple[str, LineStyle], ...]:
    """Return the legend of series that are numbered in the order of `names`; without `line`, markers only."""
    looks = (CYCLE[number % len(CYCLE)] for number in range(len(names)))
    return tuple((name, look if line else replace(look, width=0.0)) for name, look in zip(names, looks, strict=True))


def numbered(number: int) -> LineStyle:
    """Return the style of a numbered series; from the second round on with empty markers."""
    return replace(CYCLE[number % len(CYCLE)], filled=number < len(CYCLE))


@contextmanager
def styled() -> Iterator[Any]:
    """Give matplotlib's pyplot-free figure module under our parameters, leaving the caller's untouched."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_PARAMETERS):
        yield Figure


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
