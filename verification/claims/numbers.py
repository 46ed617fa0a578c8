"""The numbers of the claims that pages quote, and the table of what the paper leaves open.

Each is a function of the tables of the findings; a claim that was not computed leaves its numbers
out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from math import degrees, isfinite
from typing import Any

import numpy as np

from verification.claims import peg, walls
from verification.claims.conditions import TILTS, Condition
from verification.data import data_of
from verification.finding import DECIDING, REFUTED, WHERE, Failure, Finding, attempt
from verification.numbers import Values, quote, quoted, value_tables
from verification.table import Table, table_from

MILLI = 1e3
LEFT_OPEN = "left open"  # name of the table
QUOTES = data_of(__file__, "numbers.yaml")  # by claim
Claims = Mapping[str, Finding]


def claim_tables(findings: Iterable[Finding], failures: list[Failure]) -> dict[str, Table]:
    """Return the tables of numbers of the claims, and of what the paper leaves open."""
    claims = {one.key: one for one in findings if one.computed}
    values: dict[str, Any] = {}
    for key, one in claims.items():
        computing = partial(_numbers_of, key, one.tables[key])
        values |= attempt(f"numbers of {key}", computing, failures) or {}
    values |= attempt("limits of C10", partial(_limits, claims), failures) or {}
    values |= attempt("numbers of impacts", partial(_counts, claims), failures) or {}
    tables = value_tables(values)
    rows: list[dict[str, Any]] | None = attempt(
        LEFT_OPEN, lambda: list(left_open(claims)), failures
    )
    return tables | {LEFT_OPEN: table_from(rows or ())}


def _numbers_of(key: str, table: Table) -> Values:
    """Return the numbers of one claim."""
    found = quoted({key: QUOTES.get(key, {})}, {key: table})
    return {**found, **NUMBERS_OF[key](table)} if key in NUMBERS_OF else found


def _counts(claims: Claims) -> dict[str, float]:
    """Return the largest error of each claim on impacts, and the impacts of its largest part, over
    the parts that decide."""
    found = dict[str, float]()
    for key, one in claims.items():
        table = one.tables[key]
        if {"error", "impacts", "bound"} <= set(table.keys):
            named = {part.name for part in one.parts if part.role in DECIDING}
            drawn = [row for row in table.records() if row["impacts"] and row["part"] in named]
            found[f"{key} error"] = max((row["error"] for row in drawn), default=0.0)
            counts = dict.fromkeys(named, 0)
            for row in drawn:
                counts[row["part"]] += row["impacts"]
            found[f"{key} impacts"] = max(counts.values(), default=0)
    return found


def _limits(claims: Claims) -> dict[str, Any]:
    """Return the largest tilt [degrees] up to which C10 holds in x and in y."""
    if "C10" not in claims:
        return {}
    parts = {part.name: part for part in claims["C10"].parts}
    regions = [parts[name].region for name in ("x", "y") if parts[name].verdict == WHERE]
    ends = [region.ends("tilt", TILTS["full"])[1] for region in regions if region is not None]
    return {
        "C10 tilt limit deg": degrees(min(ends)) if len(ends) == 2 else None,
        "C10 fails": sum(parts[name].verdict == REFUTED for name in ("x", "y", "rotation")),
    }


def _bouncing(table: Table) -> Values:
    """Return the sums of bounces at each collision threshold from the same starts."""
    found = dict[str, int]()
    for speed, rows in by_threshold(table, peg.FEWER).items():
        name = f"{MILLI * speed:g} mm/s"
        found[f"C15 bounces at {name}"] = int(sum(rows["IAPB"]))
        found[f"C15 bounces of the spring at {name}"] = int(sum(rows["PB"]))
        found[f"C15 starts at {name}"] = len(rows.rows)
    return found


def by_threshold(table: Table, part: str) -> dict[float, Table]:
    """Return the rows of C15 by collision threshold, of the starts that were tried at each."""
    same = table.where(friction=0.0, travel=Condition().travel)
    rows = same.only(name.startswith(part) for name in same["part"])
    thresholds = sorted(set(rows["collision_threshold"]))
    return {one: rows.where(collision_threshold=one) for one in thresholds}


def _ratio(table: Table) -> float | None:
    """Return the median ratio of IAPB's peak forces to those of the spring, in x and y."""
    found = [
        row["IAPB"] / row["PB"]
        for row in table.records()
        if row["coordinate"] != "rotation" and row["PB"]
    ]
    return float(np.median(found)) if found else None


def _walls(table: Table) -> Values:
    """Return how many walls each law settles."""
    same, best = (_settled(table, against) for against in (walls.SAME_DAMPING, walls.BOTH))
    return {
        f"C21 {walls.SAME_DAMPING} impulses only": sum(a and not b for a, b in same),
        f"C21 {walls.BOTH} impulses": sum(ours for ours, _ in best),
        f"C21 {walls.BOTH} springs": sum(theirs for _, theirs in best),
    }


def _settled(table: Table, against: str) -> list[tuple[bool, bool]]:
    """Return for each wall whether impulses settle it, and whether springs do."""
    rows = table.where(against=against, test=walls.SETTLES)
    return [
        (isfinite(ours), isfinite(theirs))
        for ours, theirs in zip(
            rows["impulses settle after"], rows["penalty settles after"], strict=True
        )
    ]


# Numbers that need more than a quote.
NUMBERS_OF: dict[str, Callable[[Table], Values]] = {
    "C11": lambda table: {"C11 ratio": _ratio(table.where(part=peg.LARGE))},
    "C14": lambda table: {"C14 ratio": _ratio(table.where(force_limit=1.0))},
    "C15": _bouncing,
    "C21": _walls,
}


def left_open(claims: Claims) -> Iterator[dict[str, Any]]:
    """Yield what changes with a value that the paper does not give: IAPB beside the spring."""
    if "C15" in claims:
        yield from _by_threshold(claims["C15"].tables["C15"])
    if "C10" in claims:
        yield from _by_tilt(claims["C10"].tables["C10"])
    if "C21" in claims:
        yield from _by_damping(claims["C21"].tables["C21"])


def _by_threshold(table: Table) -> Iterator[dict[str, Any]]:
    settles = by_threshold(table, peg.SETTLES)
    for speed, rows in by_threshold(table, peg.FEWER).items():
        value = {"left open": "collision threshold", "value": MILLI * speed, "unit": "mm/s"}
        yield value | {
            "measured": f"bounces in {len(rows.rows)} runs",
            "IAPB": sum(rows["IAPB"]),
            "spring": sum(rows["PB"]),
        }
        rests = settles.get(speed, rows.only(()))
        yield value | {
            "measured": "median time to rest [s]",
            "IAPB": quote(rests, "median", "IAPB"),
            "spring": quote(rests, "median", "PB"),
        }


def _by_tilt(table: Table) -> Iterator[dict[str, Any]]:
    pushing = table.where(part=f"{peg.NEARER}, {peg.ALL_THREE}")
    for tilt in TILTS["quick"]:
        rows = pushing.where(tilt=tilt)
        if rows.rows:
            yield {
                "left open": "tilt of the start",
                "value": degrees(tilt),
                "unit": "°",
                "measured": "median distance from the rigid wall [mm]",
                "IAPB": quote(rows, "median", "IAPB", times=MILLI),
                "spring": quote(rows, "median", "PB", times=MILLI),
                "IAPB, pushing only": quote(rows, "median", peg.PUSHING, times=MILLI),
            }


def _by_damping(table: Table) -> Iterator[dict[str, Any]]:
    for against in (walls.SAME_DAMPING, walls.EQUAL_GAIN, walls.BOTH):
        settled = _settled(table, against)
        yield {
            "left open": f"damping of the spring: {against}",
            "measured": f"walls that settle, of {len(settled)}",
            "IAPB": sum(ours for ours, _ in settled),
            "spring": sum(theirs for _, theirs in settled),
        }
