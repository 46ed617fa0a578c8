"""Two tables in the order in which pages show them as coloured cells and bars."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

from reports.figures.numbers import power_of_ten
from verification.hard_cases.topic import ENGINE
from verification.table import Table

Outcomes = Mapping[str, str]  # of one case, by method
NOT_FAILED = ("stable", "not tried")


class MethodMap(NamedTuple):
    """The outcomes of every method in the cases of one kind.

    Attributes
    ----------
    methods : the engine's own first.
    cases : number of all cases.
    hard : the cases in which a method fails: the engine's failures first, then those of most others.
    easy : number of the other cases.
    tried : methods that were tried in one of these.
    right : "right/tried" of each method in all cases.
    """

    methods: list[str]
    cases: int
    hard: dict[str, Outcomes]
    easy: int
    tried: set[str]
    right: dict[str, str]


def method_map(table: Table, kind: str) -> MethodMap:
    """Return the map of the cases of one kind."""
    found: dict[str, dict[str, str]] = {}
    outcomes: dict[str, list[str]] = {name: [] for name in ENGINE}
    for row in table.where(kind=kind).records():
        found.setdefault(row["case"], {})[row["method"]] = row["outcome"]
        outcomes.setdefault(row["method"], []).append(row["outcome"])
    methods = [name for name in outcomes if outcomes[name]]
    hard = [case for case in found if _failed(found[case])]
    hard.sort(key=lambda case: (not _engine_failed(found[case]), -len(_failed(found[case]))))
    easy = [found[case] for case in found if case not in hard]
    right = {}
    for name in methods:
        tried = [outcome for outcome in outcomes[name] if outcome != "not tried"]
        right[name] = f"{tried.count('stable')}/{len(tried)}"
    return MethodMap(
        methods,
        len(found),
        {_in_powers(case): found[case] for case in hard},
        len(easy),
        {name for case in easy for name in case},
        right,
    )


def _failed(case: Outcomes) -> list[str]:
    """Return the methods that were tried and are not right."""
    return [method for method, outcome in case.items() if outcome not in NOT_FAILED]


def _engine_failed(case: Outcomes) -> bool:
    return any(method in ENGINE for method in _failed(case))


def _in_powers(words: str) -> str:
    """Return the words with 1e-6 as 10⁻⁶."""
    return re.sub(r"\b1e-?\d+", lambda found: power_of_ten(float(found[0])), words)


def by_agreement(table: Table, kind: str) -> list[dict[str, Any]]:
    """Return the rows of one kind of impacts with the share that agrees, the largest first."""
    rows = table.where(kind=kind).records()
    shares = [row | {"share": row["agree"] / row["cases"]} for row in rows]
    return sorted(shares, key=lambda row: -row["share"])
