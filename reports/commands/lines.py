"""Tables and sentences as plain lines that fit a terminal of 80 columns."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Sequence
from typing import Any

from verification.table import Table

WIDTH = 80
_WIDEST = 26  # of a column; longer texts go on in the next line
_BETWEEN = "  "


def sentence(text: str, mark: str = "") -> str:
    """Return a wrapped sentence after its mark; the following lines are indented by the length of the mark."""
    return textwrap.fill(text, WIDTH, initial_indent=mark, subsequent_indent=" " * len(mark), break_on_hyphens=False,
                         break_long_words=False)  # fmt: skip


def table_lines(table: Table, keys: int = 1) -> list[str]:
    """Return a table as lines. A table that is too wide continues below, with its first `keys` columns repeated."""
    columns = [[_unit_whole(title), *(_text(row[k], table.digits) for row in table.cells)]
               for k, title in enumerate(table.titles)]  # fmt: skip
    kept = [column for k, column in enumerate(columns) if k < keys or any(cell != "-" for cell in column[1:])]
    wrapped = [_wrapped(column) for column in kept]
    lines: list[str] = []
    for block in _blocks(wrapped, keys):
        lines += ([""] if lines else []) + _printed(block)
    return lines


def _unit_whole(title: str) -> str:
    """Return a heading whose unit cannot be split by a line break."""
    return re.sub(r"\[[^]]*\]$", lambda unit: unit[0].replace(" ", "\N{NO-BREAK SPACE}"), title)


def _text(value: Any, digits: int) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def _wrapped(column: Sequence[str]) -> list[list[str]]:
    """Return each cell as lines; a heading is at most as wide as its longest word or the widest cell."""
    cells = [textwrap.wrap(cell, _WIDEST) or [""] for cell in column[1:]]
    widest = max([len(line) for cell in cells for line in cell] + [len(word) for word in column[0].split()], default=1)
    return [textwrap.wrap(column[0], max(widest, 1)), *cells]


def _blocks(columns: list[list[list[str]]], keys: int) -> Iterable[list[list[list[str]]]]:
    block, used = columns[:keys], sum(map(_width, columns[:keys]))
    start = used
    for column in columns[keys:]:
        if used + _width(column) > WIDTH + len(_BETWEEN) and len(block) > keys:
            yield block
            block, used = columns[:keys], start
        block, used = [*block, column], used + _width(column)
    yield block


def _width(column: list[list[str]]) -> int:
    return max(len(line) for cell in column for line in cell) + len(_BETWEEN)


def _printed(block: list[list[list[str]]]) -> list[str]:
    widths = [_width(column) - len(_BETWEEN) for column in block]
    lines = []
    for number, row in enumerate(zip(*block, strict=True)):
        height = max(len(cell) for cell in row)
        for k in range(height):
            at = [k - (height - len(cell)) if number == 0 else k for cell in row]  # headings stand on the rule
            cells = [cell[i] if 0 <= i < len(cell) else "" for cell, i in zip(row, at, strict=True)]
            placed = [cell.rjust(width) for cell, width in zip(cells[1:], widths[1:], strict=True)]
            placed.insert(0, cells[0].ljust(widths[0]))
            lines.append(_BETWEEN.join(placed).replace("\N{NO-BREAK SPACE}", " ").rstrip())
        if number == 0:
            lines.append("-" * min(WIDTH, sum(widths) + len(_BETWEEN) * (len(widths) - 1)))
    return lines
