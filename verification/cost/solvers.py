"""Time of one impact with each complementarity solver, compared with IAPB in the same run.

It is the whole time from M, J, v to v⁺: it includes forming W or its factor for the references, and the checks of
`resolve_impact` for IAPB. The kernels of IAPB and of Lemke's method are called from compiled code, as in the engine's
step. Only methods that are called in the same way are compared.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from iapb.errors import MissingDependencyError
from reference.one_thread import one_thread
from verification.check import Check, Study
from verification.clock import LEAST_ROUNDS, sampler, take_turns, target
from verification.cost.calls import (
    PRINTED,
    Call,
    engine_call,
    kernel_call,
    lemke_call,
    printed_call,
    solver_call,
)
from verification.cost.problems import patch, pile
from verification.finding import NOT_COMPUTED, Part, failure_of
from verification.impacts import ImpactCase
from verification.table import Row, Table

FAMILIES = {"patch": patch, "pile": pile}
CONTACTS = (1, 2, 4, 8, 16, 32, 64, 128, 300)
SOLVERS = ("daqp", "quadprog", "lemke", "gauss_seidel", "proxqp", "cvxpy_clarabel")
IAPB, KERNEL, LEMKE_KERNEL = "IAPB", "IAPB kernel", "Lemke kernel"
ROUNDS = {"quick": LEAST_ROUNDS, "full": 7}
LONGEST = {"quick": 0.4, "full": 60.0}  # [s] a solver that needs more time for an impact skips larger impacts
# An impact counts as solved if |v⁺ − v⁺_reference| in the kinetic metric is below this; first-order solvers reach 1e-6.
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
    calls: dict[str, Call] = {KERNEL: kernel_call(case), IAPB: engine_call(case), PRINTED: printed_call(case)}
    notes: dict[str, str] = {}
    with one_thread():
        answers = {name: call() for name, call in calls.items()}
        for name in (LEMKE_KERNEL, *SOLVERS):
            if (size.family, name) in too_slow:
                notes[name] = f"left out: {too_slow[size.family, name]:.3g} s for fewer contacts"
                continue
            try:
                call = lemke_call(case) if name == LEMKE_KERNEL else solver_call(case, name)
                answers[name] = call()
            except MissingDependencyError as error:
                notes[name] = f"missing: {error}"
            except Exception as error:
                if study.failures is None:
                    raise
                study.failures.append(failure_of(f"{name} on a {size.family} of {size.contacts} contacts", error))
                notes[name] = f"failed: {error}"
            else:
                calls[name] = call
        samples = take_turns({name: sampler(call) for name, call in calls.items()}, ROUNDS[study.depth], warm=False)
    limit = LONGEST[study.depth]
    too_slow.update({(size.family, name): one.median for name, one in samples.items() if one.median > limit})
    for name in (*calls, *notes):
        row: dict[str, Any] = {"impacts": size.family, "contacts": size.contacts, "coordinates": case.coordinates,
                               "solver": name, "outcome": notes.get(name, "").split(":")[0],
                               **dict.fromkeys(MEASURED), "samples": 0, "distance": None,
                               "note": notes.get(name, "")}  # fmt: skip
        if name in samples:
            one, away = samples[name], _distance(case, name, answers)
            row |= {"outcome": "solved" if away <= _SOLVED else "failed", "samples": one.rounds,
                    "distance": away if np.isfinite(away) else None}  # fmt: skip
            row |= zip(MEASURED, (1e6 * one.median, 1e6 * one.least, 1e6 * one.largest), strict=True)
        yield row


def _distance(case: ImpactCase, name: str, answers: dict[str, Any]) -> float:
    """Return the relative distance of v⁺ from daqp's (for IAPB's own methods from IAPB's), in the kinetic metric."""
    reference = answers[IAPB] if name in (IAPB, KERNEL, PRINTED) else answers.get("daqp", answers[name])
    upper = case.lower.T
    return float(np.linalg.norm(upper @ (answers[name] - reference)) / np.linalg.norm(upper @ case.velocity))


def costs_more(theirs: Row, ours: Row) -> bool | None:
    """Return whether `theirs` takes longer; None if the ranges of the two samples overlap."""
    if theirs["least"] <= ours["largest"] and ours["least"] <= theirs["largest"]:
        return None
    return bool(theirs["median"] > ours["median"])


def solvers_say(table: Table) -> Part:
    """Say where IAPB is faster than the solvers called from Python, and how much of its call is the impact itself."""
    by = {(row["impacts"], row["contacts"], row["solver"]): row for row in table.records()}
    ours = {key[:2]: row for key, row in by.items() if key[2] == IAPB}
    pairs = [(row, costs_more(row, ours[key[:2]])) for key, row in by.items()
             if key[2] not in (IAPB, KERNEL, PRINTED, LEMKE_KERNEL) and row["outcome"] == "solved"]  # fmt: skip
    decided = [more for _, more in pairs if more is not None]
    if not decided:
        return Part("Times of complementarity solvers: none called from Python was timed that differs clearly from "
                    "IAPB's.", NOT_COMPUTED, timed=True)  # fmt: skip
    at: dict[str, list[int]] = {}
    for row in (row for row, more in pairs if more is False):
        at.setdefault(f"{row['solver']} on the {row['impacts']}", []).append(row["contacts"])
    texts = ", ".join(f"{where} at {', '.join(map(str, contacts))} contacts" for where, contacts in at.items())
    slower = decided.count(False)
    shares = [100 * by[(*size, KERNEL)]["median"] / row["median"] for size, row in ours.items()]
    return target(
        f"One impact, from M, J and v to v⁺ at the same accuracy, from Python on both sides: IAPB is faster in "
        f"{len(decided) - slower} of the {len(decided)} pairs of solver and size whose times differ clearly "
        f"({len(pairs) - len(decided)} do not){texts and f'; slower than {texts}'}. The impact "
        f"itself takes {min(shares):.0f} to {max(shares):.0f} % of a call of IAPB from Python; checks of the input and "
        "conversion of the result take the rest. The solvers' times include our adapter, which checks the input and "
        "forms W. Without it DAQP is several times as fast.", not slower,
        f"from Python, IAPB is slower than a solver in {slower} of {len(decided)} pairs of solver and size"
    )  # fmt: skip


MEASURED = ("median [µs]", "least [µs]", "largest [µs]")
# outcome : "solved", "failed", "missing" or "left out" (slower than LONGEST on a smaller impact)
IMPACT_TIMES = Check(
    key="time per impact", question="", row=time_impact, timed=(*MEASURED, "note"), digits=3,
    cases=lambda _: [Size(family, contacts) for contacts in CONTACTS for family in FAMILIES],
    note="Time from M, J and v to v⁺ on one thread; methods are timed in turns. Kernels are called from compiled code, "
    "all others from Python, checks included.",
)  # fmt: skip
