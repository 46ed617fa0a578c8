"""Hard cases at a glance: a row per case, a column per method or world, a mark per verdict, the decade of the error.

A full dot is stable and the number in it is the decade of its error; every other mark is a failure with a shape of its
own. The input is a `Table` with the columns named below, one row per case and method.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import Plot
from reports.figures.style import AMBER, BLUE, INK, MUTED, PAPER, PURPLE, RULE, VERMILION, LineStyle
from verification.finding import Table

INPUT = "hard-cases/every method"
CASE, KIND, METHOD, OUTCOME, GAIN, ERROR = "case", "kind", "method", "outcome", "energy gain", "forward error"
STABLE = "stable"
MARKS: dict[str, LineStyle] = {
    STABLE: LineStyle(BLUE, "o", (), 0.0),
    "gains energy": LineStyle(VERMILION, "X", (), 0.0),
    "restitution unmet": LineStyle(PURPLE, "s", (), 0.0, filled=False),
    "hangs on rounding": LineStyle(MUTED, "s", (), 0.0, filled=False),
    "wrong motion": LineStyle(AMBER, "^", (), 0.0, filled=False),
    "refused": LineStyle(MUTED, "o", (), 0.0, filled=False),
    "timed out": LineStyle(INK, "D", (), 0.0, filled=False),
    "out of memory": LineStyle(INK, "D", (), 0.0),
    "failed": LineStyle(INK, "*", (), 0.0),
}
_KINDS = (("impact", "Impacts, by method"), ("motion", "Motions, by world"))
_ROW, _COLUMN, _LABELS, _HEAD = 0.23, 0.74, 4.0, 0.6  # inches
_COLUMNS = 7  # of either matrix, filled or not: so both are drawn to one scale
_LONGEST = 58  # characters of a case's name that fit beside the matrix


@recipe(
    "hard-cases-matrix", "Who survives what", INPUT, section="hard-cases",
    caption="A row is a case, a column a method; where there is no mark the method does not apply. A dot is stable, "
    "with the decade of its error against the truth (−16: the last digit); without a number its error is zero, or "
    "energy is the only law. A cross made energy, with the decade of the gain. Squares and triangles made none and are "
    "wrong, with the decade of the error; what a grey square gets wrong is noise, and another BLAS would make other "
    "noise. A ring refused the input, a diamond was cut at its limit of time.",
)  # fmt: skip
def hard_cases(numbers: Table) -> Drawn:
    """Draw one matrix for the impacts and one for the motions."""
    panels = tuple(_panel(numbers, kind, label) for kind, label in _KINDS if kind in numbers.column(KIND))
    seen = set(numbers.column(OUTCOME))
    return Drawn(panels, numbers, tuple((outcome, style) for outcome, style in MARKS.items() if outcome in seen))


def decade(value: float | None) -> str:
    """The power of ten of an error or gain, as text; a zero or none at all is no number."""
    if value is None or value <= 0.0:
        return ""
    return str(math.floor(math.log10(value))).replace("-", "−")


def _panel(numbers: Table, kind: str, label: str) -> Panel:
    rows = numbers.where(kind=kind).records()
    cases = tuple(dict.fromkeys(row[CASE] for row in rows))
    methods = tuple(sorted({row[METHOD] for row in rows}, key=_first))
    svg = _matrix(f"hard-cases-matrix-{kind}", rows, cases, methods)
    return Panel(svg, _words(rows, methods), label, wide=True)


def _matrix(key: str, rows: Sequence[Mapping[str, Any]], cases: tuple[str, ...], methods: tuple[str, ...]) -> str:
    columns = max(_COLUMNS, len(methods))
    size = (_LABELS + _COLUMN * columns, _HEAD + _ROW * len(cases))
    frame = (_LABELS / size[0], 0.02, 1.0 - _LABELS / size[0], (_ROW * len(cases)) / size[1])
    with Plot(key, size, frame=frame) as plot:
        axes = plot.axes
        for row in rows:
            _mark(axes, methods.index(row[METHOD]), cases.index(row[CASE]), row)
        axes.set(xlim=(-0.5, columns - 0.5), ylim=(len(cases) - 0.5, -0.5))
        axes.set_yticks(range(len(cases)), [_short(case) for case in cases])
        axes.set_xticks(range(len(methods)), [method.replace(" ", "\n").replace("_", "\n") for method in methods])
        axes.tick_params(length=0, labeltop=True, labelbottom=False, top=False, bottom=False)
        plot.without_lines()
        axes.hlines(range(len(cases)), -0.5, len(methods) - 0.5, color=RULE, linewidth=0.6, zorder=1)
    return plot.svg


def _mark(axes: Any, x: int, y: int, row: Mapping[str, Any]) -> None:
    style = MARKS[row[OUTCOME]]
    face = style.color if style.filled else PAPER
    axes.plot(x - 0.16, y, style.marker, color=style.color, markersize=7.0, markerfacecolor=face,
              markeredgecolor=style.color, markeredgewidth=1.3, linestyle="none", zorder=3)  # fmt: skip
    value = row[GAIN] if row[OUTCOME] == "gains energy" else row[ERROR]
    axes.text(x + 0.04, y, decade(value), fontsize=8.0, color=INK, ha="left", va="center")


def _first(method: str) -> tuple[int, str]:
    """Ours first, then the others in the order of their names."""
    ours = ("factored", "factored, no clamp", "IAPB", "PB", "ideal")
    return (ours.index(method) if method in ours else len(ours), method)


def _short(name: str) -> str:
    return name if len(name) <= _LONGEST else name[: _LONGEST - 1].rstrip() + "…"


def _words(rows: Sequence[Mapping[str, Any]], methods: tuple[str, ...]) -> str:
    counts = []
    for method in methods:
        own = [row[OUTCOME] for row in rows if row[METHOD] == method]
        counts.append(f"{method} is stable on {own.count(STABLE)} of {len(own)}")
    return "Verdicts by case: " + ", ".join(counts) + "."
