"""Tables of coloured cells by engine and scene: energy error, momentum error and overlap."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import log10
from typing import Any

from markupsafe import Markup

from reports.figures.figure import Drawn, Panel, cell, grid, recipe
from reports.figures.numbers import MINUS
from reports.figures.style import AMBER, BLUE, RULE, SKY, VERMILION, LineStyle
from verification.table import Table

Row = Mapping[str, Any]

LEVELS = {"to 10⁻⁶": (1e-6, BLUE, 0.75), "to 10⁻²": (1e-2, SKY, 0.55), "to 10⁻¹": (1e-1, AMBER, 0.6),
          "above": (float("inf"), VERMILION, 0.75)}  # fmt: skip
ROUNDING = 1e-15
_PANELS = (("energy error", "energy error"), ("momentum error", "momentum error"), ("overlap / size", "overlap"))


@recipe("engine-errors", "engines/errors")
def engine_errors(numbers: Table) -> Drawn:
    """Draw the three tables."""
    rows = numbers.records()
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    panels = []
    for column, label in _PANELS:
        lines: dict[str, dict[str, Markup]] = {}
        for row in rows:
            lines.setdefault(f"{row['engine']}, {_at(row)}", {})[row["scene"]] = _cell(row, _value(row, column))
        cells = {line: [found.get(scene, cell()) for scene in scenes] for line, found in lines.items()}
        panels.append(Panel(grid(scenes, cells, "upright"), _words(rows, column), label))
    return Drawn(panels, numbers, {name: LineStyle(color, "s", (), 0.0) for name, (_, color, _) in LEVELS.items()})


def _value(row: Row, column: str) -> float | None:
    """Return the absolute value of a cell; without an energy error, the largest rise of energy."""
    value = row["largest rise of energy"] if row[column] is None and column == "energy error" else row[column]
    return None if value is None else abs(value)


def _cell(row: Row, value: float | None) -> Markup:
    if row["law"] == "not installed":
        return cell(kind="hatched")
    if row["law"] == "failed":
        return cell("✕", color=VERMILION)
    if value is None:
        return cell(color=RULE, strength=0.35)
    color, strength = next((color, strength) for most, color, strength in LEVELS.values() if value <= most)
    return cell("ε" if value < ROUNDING else f"{round(log10(value))}".replace("-", MINUS), "", color, strength)


def _at(row: Row) -> str:
    return "own" if row["settings"] == "own" else "1 ms"


def _words(rows: Sequence[Row], column: str) -> str:
    said = []
    for engine in dict.fromkeys(row["engine"] for row in rows):
        mine = [row for row in rows if row["engine"] == engine]
        known = [(value, row) for row in mine if (value := _value(row, column)) is not None]
        if known:
            worst, where = max(known, key=lambda pair: pair[0])
            said.append(f"{engine} at most {worst:.1e}, in {where['scene']} ({_at(where)})")
        else:
            said.append(f"{engine}: none, {mine[0]['law']}")
    return f"{column.capitalize()}: " + "; ".join(said) + "."
