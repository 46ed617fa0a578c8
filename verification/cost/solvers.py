"""Time of one impact with each complementarity solver, compared with IAPB in the same run.

It is the whole time from M, J, v to v⁺: it includes forming W or its factor for the references, and
the checks of `resolve_impact` for IAPB. The kernels of IAPB and of Lemke's method are called from
compiled code, as in the engine's step. Only methods that are called in the same way are compared.
The common interface of the references takes time for its checks; DAQP is timed without it, too.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from iapb.errors import MissingDependencyError
from reference.one_thread import one_thread
from verification.check import Check, Study
from verification.clock import LEAST_ROUNDS, sampler, take_turns, target
from verification.cost import calls
from verification.cost.calls import PRINTED, Call
from verification.cost.problems import patch, pile
from verification.finding import NOT_COMPUTED, Part, failure_of
from verification.table import Row, Table

FAMILIES = {"patch": patch, "pile": pile}
CONTACTS = (1, 2, 4, 8, 16, 32, 64, 128, 300)
SOLVERS = ("daqp", "quadprog", "lemke", "gauss_seidel", "proxqp", "cvxpy_clarabel")
IAPB, KERNEL, LEMKE_KERNEL, DAQP = "IAPB", "IAPB kernel", "Lemke kernel", "daqp, direct call"
ROUNDS = {"quick": LEAST_ROUNDS, "full": 7}
LONGEST = {
    "quick": 0.4,
    "full": 60.0,
}  # [s] a solver that needs more time for an impact skips larger impacts
# An impact counts as solved if |v⁺ − v⁺_reference| in the kinetic metric is below this; first-order
# solvers reach 1e-6.
_SOLVED = 1e-5
SEED = 22


class Size(NamedTuple):
    """An impact of a family."""

    family: str
    contacts: int


def time_impact(study: Study, size: Size) -> Iterator[Row]:
    """Yield the times of every solver and of IAPB on one impact."""
    case = FAMILIES[size.family](size.contacts, np.random.default_rng([SEED, size.contacts]))
    too_slow: dict[tuple[str, str], float] = study.once("too slow", dict)
    own: dict[str, Any] = {
        KERNEL: calls.kernel_call,
        IAPB: calls.engine_call,
        PRINTED: calls.printed_call,
    }
    others = {
        LEMKE_KERNEL: calls.lemke_call,
        DAQP: calls.daqp_call,
        **{name: partial(calls.solver_call, name=name) for name in SOLVERS},
    }
    timed, answers, notes = dict[str, Call](), dict[str, Any](), dict[str, str]()
    with one_thread():
        for name, make in (own | others).items():
            if name in others and (size.family, name) in too_slow:
                notes[name] = f"left out: {too_slow[size.family, name]:.3g} s for fewer contacts"
                continue
            try:
                call = make(case)
                answers[name], timed[name] = call(), call
            except MissingDependencyError as error:
                notes[name] = f"missing: {error}"
            except Exception as error:
                if study.failures is None:
                    raise
                study.failures.append(
                    failure_of(f"{name} on a {size.family} of {size.contacts} contacts", error)
                )
                notes[name] = f"failed: {error}"
        samples = take_turns(
            {name: sampler(call) for name, call in timed.items()}, ROUNDS[study.depth], warm=False
        )
    limit = LONGEST[study.depth]
    too_slow.update(
        {(size.family, name): one.median for name, one in samples.items() if one.median > limit}
    )
    for name in (*timed, *notes):
        row: dict[str, Any] = {
            "impacts": size.family,
            "contacts": size.contacts,
            "coordinates": case.coordinates,
            "solver": name,
            "outcome": notes.get(name, "").split(":")[0],
            **dict.fromkeys(MEASURED),
            "samples": 0,
            "distance": None,
            "note": notes.get(name, ""),
        }
        if name in samples:
            one = samples[name]
            reference = answers[IAPB] if name in own else answers.get("daqp", answers[name])
            away = case.distance(answers[name], reference)
            row |= {
                "outcome": "solved" if away <= _SOLVED else "failed",
                "samples": one.rounds,
                "distance": away if np.isfinite(away) else None,
            }
            row |= zip(
                MEASURED, (1e6 * one.median, 1e6 * one.least, 1e6 * one.largest), strict=True
            )
        yield row


def costs_more(theirs: Row, ours: Row) -> bool | None:
    """Return whether `theirs` takes longer; None if the ranges of the two samples overlap."""
    if theirs["least"] <= ours["largest"] and ours["least"] <= theirs["largest"]:
        return None
    return bool(theirs["median"] > ours["median"])


def solvers_say(table: Table) -> tuple[Part, Part]:
    """Say where IAPB is faster than the solvers called from Python: through their common interface,
    and DAQP directly."""
    rows = table.records()
    ours = {(row["impacts"], row["contacts"]): row for row in rows if row["solver"] == IAPB}

    def part(how: str, rival: str, what: str, solvers: Collection[str]) -> Part:
        pairs = [
            (row, costs_more(row, ours[row["impacts"], row["contacts"]]))
            for row in rows
            if row["solver"] in solvers and row["outcome"] == "solved"
        ]
        lost: dict[tuple[str, str], list[int]] = {}  # solver and family -> numbers of contacts
        for row in (row for row, more in pairs if more is False):
            lost.setdefault((row["solver"], row["impacts"]), []).append(row["contacts"])
        groups: dict[str, list[str]] = {}  # impacts -> solvers that are faster
        for (solver, family), found in lost.items():
            ends = " to ".join(map(str, sorted({min(found), max(found)})))
            groups.setdefault(f"on a {family} of {ends} contacts", []).append(solver)
        where = "; ".join(
            f"than {', '.join(names)} " * (len(solvers) > 1) + size
            for size, names in groups.items()
        )
        return faster(how, rival, what, [more for _, more in pairs], where)

    common = part(
        "both methods called from Python (the solvers through a common interface)",
        "the complementarity solver",
        "pairs of solver and size",
        SOLVERS,
    )
    said = printed_faster(table)
    return (
        replace(common, measured=f"{common.measured}. {said}") if said else common,
        part(
            "both methods called from Python (DAQP directly, without checks)",
            "DAQP",
            "impacts",
            (DAQP,),
        ),
    )


def printed_faster(table: Table) -> str:
    """Say on which piles the printed formula is clearly faster than IAPB from Python; "" if on
    none."""
    piles = table.where(impacts="pile", outcome="solved")
    ours, theirs = (
        {row["contacts"]: row for row in piles.where(solver=name).records()}
        for name in (IAPB, PRINTED)
    )
    lost = [
        size
        for size in ours.keys() & theirs.keys()
        if costs_more(theirs[size], ours[size]) is False
    ]
    most = max((ours[size]["median"] / theirs[size]["median"] for size in lost), default=0.0)
    sizes = " to ".join(map(str, sorted({min(lost), max(lost)}))) if lost else ""
    return (
        (
            f"On piles of {sizes} independent contacts the printed formula is up to {most:.2g} "
            f"times as fast as "
            "IAPB"
        )
        if lost
        else ""
    )


def faster(how: str, rival: str, what: str, outcomes: Sequence[bool | None], where: str) -> Part:
    """Say in how many cases IAPB is faster than a rival, and where it is slower; None is a
    difference within noise."""
    more, slower, count = (
        outcomes.count(None),
        outcomes.count(False),
        sum(one is not None for one in outcomes),
    )
    if not count:
        return Part(
            f"Time of one impact, {how}: nothing was timed that differs clearly from IAPB.",
            NOT_COMPUTED,
            timed=True,
        )
    return target(
        f"Time of one impact, from M, J and v to v⁺ (equal to {_SOLVED:g}); {how}",
        f"IAPB is faster than {rival} in {count - slower} of the {count} {what} whose times "
        f"differ clearly"
        f"{f' ({more} more are undecided)' * bool(more)}{where and f'. IAPB is slower {where}'}",
        "IAPB is faster in all",
        not slower,
        f"with {how}, IAPB is slower than {rival} in {slower} of {count} {what}",
    )


MEASURED = ("median [µs]", "least [µs]", "largest [µs]")
# outcome : "solved", "failed", "missing" or "left out" (slower than LONGEST on a smaller impact)
IMPACT_TIMES = Check(
    key="time per impact",
    question="",
    row=time_impact,
    timed=(*MEASURED, "note"),
    digits=3,
    cases=lambda _: [Size(family, contacts) for contacts in CONTACTS for family in FAMILIES],
    note="Time from M, J and v to v⁺ on one thread; methods are timed in turns. The two kernels are called from "
    "compiled code, all others from Python. The common interface of the solvers checks arguments "
    "and results and "
    "forms W; “daqp, direct call” does without it. Distance: of v⁺ from that of IAPB (rows of "
    "IAPB and the printed "
    f"formula) or of DAQP (complementarity solvers), over |v⁻|; above {_SOLVED:g} the outcome is "
    f"“failed”.",
)
