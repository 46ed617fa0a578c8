"""The numbers that the templates quote, by topic and key, and the filters that format them.

A template writes ``{{ numbers.energy.impacts | num }}``. A key that a topic does not have is an
error; a topic that was not computed prints "not computed in this run".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from reports.figures.numbers import format_cell, format_number
from reports.pages.records import Evidence
from verification.numbers import read_values
from verification.table import Table

ABSENT = "not computed in this run"
NARROW = "\N{NARROW NO-BREAK SPACE}"


class Absent:
    """The numbers of a topic that was not computed: each is false and prints ABSENT."""

    def __getitem__(self, key: str) -> Absent:
        return self

    def __str__(self) -> str:
        return ABSENT

    def __bool__(self) -> bool:
        return False

    def __lt__(self, other: object) -> bool:
        return False

    __le__ = __gt__ = __ge__ = __lt__


class Numbers:
    """The numbers of a topic by key, without names of its own that could hide a key.

    The key of a claim's number is "C10 ...": if C10 was not computed, its numbers are Absent.
    """

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = values

    def __getitem__(self, key: str) -> Any:
        claim, space, _ = key.partition(" ")
        if space and not any(name.startswith(claim + space) for name in self._values):
            return Absent()
        return self._values[key]


def numbers_of(evidence: Evidence, topics: tuple[str, ...]) -> dict[str, Numbers | Absent]:
    """Return the numbers of each topic by its name, in which hyphens are underscores."""
    tables = {topic.key: topic.tables for topic in evidence.topics} | dict(evidence.numbers)
    found: dict[str, Numbers | Absent] = {}
    for topic in (*topics, *tables):
        values = read_values(tables.get(topic, {}))
        found[topic.replace("-", "_")] = Numbers(values) if values else Absent()
    return found


def is_absent(value: object) -> bool:
    """Return whether the numbers were not computed."""
    return isinstance(value, Absent)


def _of_numbers(form: Callable[..., str]) -> Callable[..., str]:
    """Return a filter that formats numbers and passes on what was not computed."""

    def formatted(value: Any, *given: Any) -> str:
        return str(value) if is_absent(value) else form(value, *given)

    formatted.__doc__ = form.__doc__
    return formatted


@_of_numbers
def num(value: float, digits: int = 2) -> str:
    """Return a number with two digits: 32, 0.55, 1,300, 3 · 10⁻¹⁴; counts keep all."""
    count = -1e9 < value < 1e9 and value == int(value)
    return f"{int(value):,}" if count else format_number(value, digits)


@_of_numbers
def percent(share: float) -> str:
    """Return a share as "13 %"."""
    return f"{format_number(100.0 * share, 2)}{NARROW}%"


@_of_numbers
def times(ratio: float) -> str:
    """Return a ratio as "11×"."""
    return f"{format_number(ratio, 2)}×"


@_of_numbers
def time(microseconds: float) -> str:
    """Return a time given in µs: in µs below 1 ms, in ms below 1 s, else in s."""
    for unit, factor in (("µs", 1.0), ("ms", 1e3)):
        if abs(microseconds) < 1e3 * factor:
            return f"{format_cell(microseconds / factor, 3)}{NARROW}{unit}"
    return f"{format_cell(microseconds / 1e6, 3)}{NARROW}s"


def place(value: float, most: float) -> str:
    """Return the place of a value on an axis from 0 to `most`, in percent of its length."""
    return f"{100.0 * min(max(value / (most or 1.0), 0.0), 1.0):.1f}%"


def log_place(value: float, least: float, most: float) -> str:
    """Return the place of a value on a logarithmic axis, in percent of its length."""
    share = math.log(max(value, least) / least) / math.log(most / least)
    return f"{100.0 * min(share, 1.0):.1f}%"


def in_degrees(table: Table) -> Table:
    """Return a table with its angles in degrees."""
    turned = [column.unit in ("rad", "rad/s") for column in table.columns]
    columns = [
        replace(column, unit=column.unit.replace("rad", "°")) if turns else column
        for column, turns in zip(table.columns, turned, strict=True)
    ]
    rows = [
        tuple(
            math.degrees(value) if turns and value is not None else value
            for value, turns in zip(row, turned, strict=True)
        )
        for row in table.rows
    ]
    return replace(table, columns=tuple(columns), rows=tuple(rows))


FILTERS = {
    "in_degrees": in_degrees,
    "num": num,
    "percent": percent,
    "times": times,
    "time": time,
    "place": place,
    "log_place": log_place,
}
