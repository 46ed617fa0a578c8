"""Energy error, momentum error and overlap of each engine, scene by scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import Plot
from reports.figures.style import STYLES, LineStyle, looks_of
from verification.table import Table

Row = Mapping[str, Any]

ROUNDING = 1e-16  # smaller errors are drawn here
_PANELS = (("energy error", "error of the energy"), ("momentum error", "error of the momentum"),
           ("overlap / size", "deepest overlap / size of the body"))  # fmt: skip
_OURS = {"iapb (ours)": STYLES["IAPB"], "ideal world (ours)": replace(STYLES["ideal"], marker="s")}


@recipe("engine-errors", "engines/errors")
def engine_errors(numbers: Table) -> Drawn:
    """Draw a panel for each error: a row for each scene, and in it one for each engine that is installed."""
    rows = [row for row in numbers.records() if row["law"] != "not installed"]
    engines = dict.fromkeys(row["engine"] for row in rows)
    absent = dict.fromkeys(name for name in numbers.column("engine") if name not in engines)
    looks = {name: replace(look, name="", width=0.0)
             for name, look in {**looks_of(engines), **_OURS}.items() if name in engines}
    panels = [Panel(_errors(number, rows, column, looks), f"{label} by scene: {', '.join(engines)}.", label)
              for number, (column, label) in enumerate(_PANELS)]
    told = f" Not installed: {', '.join(absent)}." if absent else ""
    return Drawn(panels, numbers, looks, {"absent": told})


def _errors(number: int, rows: Sequence[Row], column: str, looks: Mapping[str, LineStyle]) -> str:
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    with Plot(f"engine-errors-{number}", (4.1, 0.42 * len(scenes) + 0.7)) as plot:
        for lane, (engine, look) in enumerate(looks.items()):
            for place, scene in enumerate(scenes):
                height = place + 0.19 * (lane - (len(looks) - 1) / 2)
                mine = {row["settings"]: row for row in rows if (row["engine"], row["scene"]) == (engine, scene)}
                if any(row["law"] == "failed" for row in mine.values()):
                    plot.axes.plot(0.98, height, "x", color=look.color, transform=plot.axes.get_yaxis_transform())
                found = [max(value, ROUNDING) for row in mine.values() if (value := _value(row, column)) is not None]
                if len(set(found)) > 1:
                    plot.axes.plot(found, [height] * len(found), color=look.color, linewidth=1.0)
                    plot.marks([(found[-1], height)], replace(look, filled=False), markersize=5)
                plot.marks([(value, height) for value in found[:1]], look, markersize=5)
        plot.log("relative error", "", "x", xlim=(ROUNDING / 3.0, 3.0), ylim=(len(scenes) - 0.5, -0.5))
        plot.axes.set_yticks(range(len(scenes)), scenes)
        plot.axes.set_yticks([place + 0.5 for place in range(len(scenes) - 1)], minor=True)
        plot.axes.grid(visible=False, axis="y")
        plot.axes.grid(visible=True, axis="y", which="minor")
        plot.axes.tick_params(axis="y", which="both", length=0)
    return plot.svg


def _value(row: Row, column: str) -> float | None:
    """Return the absolute value of an error; without an energy error, the largest rise of energy."""
    value = row["largest rise of energy"] if row[column] is None and column == "energy error" else row[column]
    return None if value is None else abs(value)
