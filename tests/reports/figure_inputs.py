"""Tables for every figure, and the README's second picture: rows of a real report, thinned and rounded, kept here.

Where a study's columns have changed and a figure no longer finds them, take them again from a new report:

    iapb reproduce && python -m tests.reports.figure_inputs out
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reports.figures import RECIPES, energy_gains
from reports.figures.figure import Figure, draw
from reports.figures.standalone import standalone
from verification.finding import Column, Table

FILE = Path(__file__).with_suffix(".json")
ENERGY_PICTURE = Path(__file__).parents[2] / "docs" / "pictures" / "energy_gains.svg"  # of the README
_LONG, _KEPT = 300, 12  # rows of a table that is thinned, and of those with the same texts in it


def tables() -> dict[str, Table]:
    """Return the kept tables by the names under which the figures ask for them."""
    kept = json.loads(FILE.read_text(encoding="utf-8"))
    return {name: Table(tuple(Column(key, unit, heading) for key, unit, heading in table["columns"]),
                        tuple(map(tuple, table["rows"]))) for name, table in kept.items()}  # fmt: skip


def write_tables(inputs: Mapping[str, Any]) -> None:
    """Write those of the inputs that are tables and that a figure asks for, thinned."""
    wanted = sorted({name for recipe in RECIPES for name in recipe.needs if isinstance(inputs.get(name), Table)})
    texts = (f"{json.dumps(name)}: {_text(inputs[name])}" for name in wanted)
    FILE.write_text("{" + ",\n".join(texts) + "}\n", encoding="utf-8")


def write_picture() -> None:
    """Draw the README's second picture from the kept tables."""
    figure = draw(energy_gains.energy_gains, tables())
    assert isinstance(figure, Figure)
    ENERGY_PICTURE.write_text(standalone(figure), encoding="utf-8")


def _text(table: Table) -> str:
    most = _KEPT if len(table.rows) > _LONG else len(table.rows)
    groups: dict[tuple[Any, ...], list[tuple[Any, ...]]] = {}
    for row in table.rows:
        groups.setdefault(tuple(cell for cell in row if isinstance(cell, str)), []).append(row)
    thinned = [row for group in groups.values() for row in group[:: -(-len(group) // most)]]
    columns = [[column.key, column.unit, column.heading] for column in table.columns]
    rows = ",\n".join(json.dumps([_rounded(cell) for cell in row], ensure_ascii=False) for row in thinned)
    return f'{{"columns": {json.dumps(columns, ensure_ascii=False)}, "rows": [\n{rows}]}}'


def _rounded(cell: Any) -> Any:
    value = cell.item() if hasattr(cell, "item") else cell
    return float(f"{value:.3g}") if isinstance(value, float) else value


if __name__ == "__main__":
    from reports.evidence.gather import gather
    from reports.pages.builder import figure_inputs

    write_tables(figure_inputs(gather(Path(sys.argv[1]), "quick", lambda *_: None)))
    write_picture()
