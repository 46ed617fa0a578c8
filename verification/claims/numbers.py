"""The numbers of the claims that pages quote, and the table of what the paper leaves open.

Each is a function of the tables of the findings; a claim that was not computed leaves its numbers
out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from math import degrees, isfinite
from typing import Any

import numpy as np

from verification.claims import algebraic, peg, socket, walls
from verification.claims.conditions import TILTS, Condition
from verification.finding import DECIDING, REFUTED, WHERE, Failure, Finding, attempt
from verification.numbers import Values, value_tables
from verification.table import Table, table_from

MILLI = 1e3
LEFT_OPEN = "left open"  # name of the table
Claims = Mapping[str, Finding]


def claim_tables(findings: Iterable[Finding], failures: list[Failure]) -> dict[str, Table]:
    """Return the tables of numbers of the claims, and of what the paper leaves open."""
    claims = {one.key: one for one in findings if one.computed}
    values: dict[str, Any] = {}
    for key, function in NUMBERS_OF.items():
        if key in claims:
            table = claims[key].tables[key]
            values |= attempt(f"numbers of {key}", partial(function, table), failures) or {}
    values |= attempt("limits of C10", partial(_limits, claims), failures) or {}
    counts = attempt("numbers of impacts", lambda: list(_counts(claims)), failures) or []
    values |= {f"{key} {kind}": count for key, kind, count in counts}
    tables = value_tables(values)
    rows: list[dict[str, Any]] | None = attempt(
        LEFT_OPEN, lambda: list(left_open(claims)), failures
    )
    return tables | {LEFT_OPEN: table_from(rows or ())}


def _counts(claims: Claims) -> Iterator[tuple[str, str, float]]:
    """Yield the largest error of each claim on impacts, and the impacts of its largest part, over
    the parts that decide."""
    for key, one in claims.items():
        table = one.tables[key]
        if {"error", "impacts", "bound"} <= set(table.keys):
            named = {part.name for part in one.parts if part.role in DECIDING}
            drawn = [row for row in table.records() if row["impacts"] and row["part"] in named]
            yield key, "error", max((row["error"] for row in drawn), default=0.0)
            counts = dict.fromkeys(named, 0)
            for row in drawn:
                counts[row["part"]] += row["impacts"]
            yield key, "impacts", max(counts.values(), default=0)


def _limits(claims: Claims) -> dict[str, Any]:
    """Return the largest tilt [degrees] up to which C10 holds in x and in y, in words of numbers."""
    if "C10" not in claims:
        return {}
    parts = {part.name: part for part in claims["C10"].parts}
    regions = [parts[name].region for name in ("x", "y") if parts[name].verdict == WHERE]
    ends = [region.ends("tilt", TILTS["full"])[1] for region in regions if region is not None]
    return {
        "C10 tilt limit deg": degrees(min(ends)) if len(ends) == 2 else None,
        "C10 fails": sum(parts[name].verdict == REFUTED for name in ("x", "y", "rotation")),
    }


def _mean_of(rows: Sequence[Mapping[str, Any]], key: str) -> float | None:
    return float(np.median([row[key] for row in rows])) if rows else None


def _bouncing(table: Table) -> Values:
    """Return the sums of bounces at each collision threshold from the same starts."""
    found: dict[str, Any] = {}
    for speed_, rows in by_threshold(table, peg.FEWER).items():
        name = f"{MILLI * speed_:g} mm/s"
        found[f"C15 bounces at {name}"] = int(sum(row["IAPB"] for row in rows))
        found[f"C15 bounces of the spring at {name}"] = int(sum(row["PB"] for row in rows))
        found[f"C15 starts at {name}"] = len(rows)
    return found


def by_threshold(table: Table, part: str) -> dict[float, list[dict[str, Any]]]:
    """Return the rows of C15 by collision threshold, of the starts that were tried at each."""
    rows = [
        row
        for row in table.records()
        if row["part"].startswith(part)
        and row["friction"] == 0.0
        and row["travel"] == Condition().travel
    ]
    thresholds = sorted({row["collision_threshold"] for row in rows})
    grid: dict[float, list[dict[str, Any]]] = {one: [] for one in thresholds}
    for row in rows:
        grid[row["collision_threshold"]].append(row)
    return grid


def _path(table: Table) -> Values:
    """Return what C10 says at our start, at small tilts, and of pushing only."""
    start = Condition()
    ours = table.where(tilt=start.tilt, clearance=start.clearance, travel=start.travel)
    pushing = table.where(part=f"{peg.NEARER}, {peg.ALL_THREE}")
    moving = [row for row in pushing.records() if not row["ideal settles"]]
    tilted = [row for row in pushing.records() if row["tilt"] > 0.05]
    found: dict[str, Any] = {
        f"C10 {world} {name} at our start": MILLI * ours.where(part=name).records()[0][world]
        for world in peg.WORLDS
        for name in ("x", "y")
    }
    found |= {
        "C10 pushing nearer": pushing.holds.count(True),
        "C10 pushing told": len(pushing.decided),
        "C10 starts": len(pushing.rows),
        "C10 rigid peg moves on": len(moving),
        "C10 IAPB moves on": sum(not row["IAPB settles"] for row in moving),
        "C10 spring moves on": sum(not row["PB settles"] for row in moving),
        "C10 pushing moves on": sum(not row[f"{peg.PUSHING} settles"] for row in moving),
        "C10 tilted IAPB mm": _mean_of(tilted, "IAPB"),
        "C10 tilted pushing mm": _mean_of(tilted, peg.PUSHING),
        "C10 tilted spring mm": _mean_of(tilted, "PB"),
    }
    for key in [key for key in found if key.startswith("C10 tilted") and found[key] is not None]:
        found[key] *= MILLI
    for threshold in (False, True):
        for name in ("x", "y"):
            rows = table.where(part=f"{name}, {peg.LARGER}" if threshold else name)
            kind = "larger threshold" if threshold else "paper's threshold"
            found[f"C10 {name} {kind} held"] = sum(rows.decided)
            found[f"C10 {name} {kind} told"] = len(rows.decided)
    return found


def _forces(table: Table) -> Values:
    """Return the median ratio of first pushes, in x and y, and how often torques are nearest."""
    ratio = _ratios(table.where(part=peg.LARGE).records())
    turned = table.where(part=f"{peg.CLOSEST}, {peg.LARGER}", coordinate="rotation")
    return {
        "C11 ratio": ratio,
        "C11 rotation larger threshold held": sum(turned.decided),
        "C11 rotation larger threshold told": len(turned.decided),
    }


def _ratios(rows: Iterable[Mapping[str, Any]]) -> float | None:
    found = [
        row["IAPB"] / row["PB"] for row in rows if row["coordinate"] != "rotation" and row["PB"]
    ]
    return float(np.median(found)) if found else None


def _depths(table: Table) -> Values:
    rows = table.where(coordinate=peg.PENETRATION, force_limit=1.0).records()
    small = table.only(tilt <= Condition().tilt for tilt in table["tilt"])
    return {
        "C13 IAPB mm": MILLI * float(np.median([row["IAPB"] for row in rows])),
        "C13 spring mm": MILLI * float(np.median([row["PB"] for row in rows])),
        "C13 small tilts x": sum(small.where(coordinate="x").decided),
        "C13 small tilts y": sum(small.where(coordinate="y").decided),
        "C13 small tilts": len(small.where(coordinate="x").rows),
    }


def _limited(table: Table) -> Values:
    tight = table.only(row["force_limit"] < 1.0 for row in table.records())
    return {
        "C14 ratio": _ratios(table.where(force_limit=1.0).records()),
        "C14 tight limit open": tight.holds.count(None),
        "C14 tight limit trials": len(tight.rows),
    }


def _separation(table: Table) -> Values:
    return {
        f"C16 {rendering} mm": MILLI * max(table.where(rendering=rendering)["distance"])
        for rendering in peg.RENDERINGS
    }


def _losses(table: Table) -> Values:
    return {
        "C17 error": max(table["error"]),
        "C17 impacts": sum(table["impacts"]),
        "C17 runs": len(table.rows),
    }


def _sockets(table: Table) -> Values:
    both = table.where(part=socket.BOTH)
    found: dict[str, Any] = {}
    for name, far in (("covering", True), ("short", False)):
        rows = both.only((reach >= 1.0) is far for reach in both[socket.REACH])
        found[f"C18 {name} held"] = sum(rows.decided)
        found[f"C18 {name} told"] = len(rows.decided)
    return found


def _leaks(table: Table) -> Values:
    undamped = table.where(**{"device damping": 0.0})
    return {
        "C20 undamped walls": len(undamped.rows),
        "C20 undamped walls that leak": sum(undamped.column("hand draws energy")),
    }


def _walls(table: Table) -> Values:
    """Return how many walls each law settles, at its best damping, and how many one law alone."""
    found: dict[str, Any] = {}
    for against in (walls.SAME_DAMPING, walls.EQUAL_GAIN, walls.BOTH):
        rows = table.where(against=against, test=walls.SETTLES).records()
        ours, theirs = (
            [isfinite(row[f"{law} after"]) for row in rows]
            for law in ("impulses settle", "penalty settles")
        )
        found |= {
            f"C21 {against} impulses": sum(ours),
            f"C21 {against} springs": sum(theirs),
            f"C21 {against} impulses only": sum(
                a and not b for a, b in zip(ours, theirs, strict=True)
            ),
            f"C21 {against} springs only": sum(
                b and not a for a, b in zip(ours, theirs, strict=True)
            ),
        }
    sooner = table.where(against=walls.BOTH, test=walls.SOONER)
    found |= {
        "C21 walls": len(sooner.rows),
        "C21 sooner impulses": sum(sooner.decided),
        "C21 sooner springs": len(sooner.decided) - sum(sooner.decided),
    }
    return found


def _almost(table: Table) -> Values:
    rows = table.where(part=algebraic.ALMOST)
    return {
        "C09 just above mm": MILLI * max(rows["apart"]),
        "C09 starts": len(rows.rows),
        "C09 impacts": sum(count or 0 for count in table.where(part=algebraic.RESOLVER)["impacts"]),
    }


def _scaled(table: Table) -> Values:
    return {
        f"C08 {rendering} impacts": sum(table.where(part=parts[0])["impacts of a run"])
        for rendering, parts in algebraic.RENDERED.items()
    }


def _shares(table: Table) -> Values:
    shares = table["share lost"]
    return {"C07 least share": min(shares), "C07 most share": max(shares)}


def _clipping(table: Table) -> Values:
    rows = table.where(measure=peg.SETTLING, part=peg.MOST)
    return {"C12 settling held": sum(rows.decided), "C12 settling told": len(rows.decided)}


NUMBERS_OF: dict[str, Callable[[Table], Values]] = {
    "C07": _shares,
    "C08": _scaled,
    "C09": _almost,
    "C10": _path,
    "C11": _forces,
    "C12": _clipping,
    "C13": _depths,
    "C14": _limited,
    "C15": _bouncing,
    "C16": _separation,
    "C17": _losses,
    "C18": _sockets,
    "C20": _leaks,
    "C21": _walls,
}


def left_open(claims: Claims) -> Iterator[dict[str, Any]]:
    """Yield what changes with a value that the paper does not give: IAPB beside the spring."""
    if "C15" in claims:
        table = claims["C15"].tables["C15"]
        settles = by_threshold(table, peg.SETTLES)
        for speed_, rows in by_threshold(table, peg.FEWER).items():
            yield {
                "left open": "collision threshold",
                "value": MILLI * speed_,
                "unit": "mm/s",
                "measured": f"bounces in {len(rows)} runs",
                "IAPB": sum(row["IAPB"] for row in rows),
                "spring": sum(row["PB"] for row in rows),
            }
            yield {
                "left open": "collision threshold",
                "value": MILLI * speed_,
                "unit": "mm/s",
                "measured": "median time to rest [s]",
                "IAPB": _mean_of(settles.get(speed_, []), "IAPB"),
                "spring": _mean_of(settles.get(speed_, []), "PB"),
            }
    if "C10" in claims:
        table = claims["C10"].tables["C10"].where(part=f"{peg.NEARER}, {peg.ALL_THREE}")
        for tilt in TILTS["quick"]:
            rows = table.where(tilt=tilt).records()
            if not rows:
                continue
            yield {
                "left open": "tilt of the start",
                "value": degrees(tilt),
                "unit": "°",
                "measured": "median distance from the rigid wall [mm]",
                "IAPB": MILLI * float(np.median([row["IAPB"] for row in rows])),
                "spring": MILLI * float(np.median([row["PB"] for row in rows])),
                "IAPB, pushing only": MILLI * float(np.median([row[peg.PUSHING] for row in rows])),
            }
    if "C21" in claims:
        table = claims["C21"].tables["C21"]
        for against in (walls.SAME_DAMPING, walls.EQUAL_GAIN, walls.BOTH):
            rows = table.where(against=against, test=walls.SETTLES).records()
            yield {
                "left open": f"damping of the spring: {against}",
                "measured": f"walls that settle, of {len(rows)}",
                "IAPB": sum(isfinite(row["impulses settle after"]) for row in rows),
                "spring": sum(isfinite(row["penalty settles after"]) for row in rows),
            }
