"""Topic: does any impact gain energy in exact arithmetic? It checks the report's impacts and many adverse ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from iapb import Certificate, certify
from iapb.contact.laws import ENGINE_LAWS
from reports.runner import Runner
from reports.store.runs import read_run
from verification.finding import (
    HOLDS,
    NOT_TESTABLE,
    Column,
    Failure,
    Finding,
    Part,
    attempt,
    finding_of,
    table_of,
    verdict_of_law,
)
from verification.laws.exact_energy import FAMILIES, exact_energy

_DRAWN = {"quick": 20_000, "full": 1_000_000}  # impacts of each family
_RUNS = (Column("run"), Column("law"), Column("impacts"), Column("gains"), Column("largest gain"),
         Column("M Δv − impulse"), Column("Jᵀp − impulse"), Column("restitution"), Column(HOLDS))  # fmt: skip
_FAMILIES = (Column("family"), Column("impacts"), Column("gains"), Column("moved"), Column("cancelled"),
             Column("median energy cost"), Column("largest energy cost"), Column(HOLDS))  # fmt: skip
_NOTE = ("Moved: share of the impacts with v⁺ ≠ v⁻. Cancelled: impacts without any passive step, so v⁺ = v⁻. Energy "
         "cost: the loss at e = 1 beyond that of the same impact without clamp, in units of 10 d ε √κ(M).")


def compute(runner: Runner, depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Certify every engine run that the report uses, and adverse impacts of the compiled resolver.

    Rigid worlds are left out: they solve for the impulses and forces of a step together and record no separate impact.
    """
    failures: list[Failure] = []
    files, rows = runner.used_so_far(), []
    for done, name in enumerate(files):
        progress(done, len(files) + len(FAMILIES))
        row = attempt(name, lambda name=name: _certified(runner, name), failures)  # type: ignore[misc]
        if row:
            rows.append(row)
    drawn: list[dict[str, Any]] = []
    for done, family in enumerate(FAMILIES):
        progress(len(files) + done, len(files) + len(FAMILIES))
        one = exact_energy(family, _DRAWN[depth])
        drawn.append({"family": family, "impacts": one.impacts, "gains": one.gains, "moved": one.moved,
                      "cancelled": one.cancelled, "median energy cost": _known(one.price[0]),
                      "largest energy cost": _known(one.price[2]), HOLDS: one.holds})
    certified = ("impacts certified", f"{_sum(rows, 'impacts'):,}")
    provoked = ("adverse impacts certified", f"{_sum(drawn, 'impacts'):,}")
    recorded = (f"{_sum(rows, 'gains')} of {certified[1]} impacts in {len(rows):,} runs of the engine "
                "gained energy in exact arithmetic")  # fmt: skip
    least = min((one["moved"] for one in drawn), default=0.0)
    adverse = (f"nor did {provoked[1]} random impacts drawn to provoke a gain" if not _sum(drawn, "gains") else
               f"{_sum(drawn, 'gains')} of {provoked[1]} random impacts drawn to provoke a gain did")  # fmt: skip
    moved = f"in every family the impact changed the velocity in at least {least:.1%} of the cases"
    parts = (Part(recorded, verdict_of_law(row[HOLDS] for row in rows), quantities=(certified,)),
             Part(f"{adverse}; {moved}", verdict_of_families([one[HOLDS] for one in drawn]),
                  quantities=(provoked,)))  # fmt: skip
    tables = {"certified runs": table_of(_RUNS, rows), "adverse impacts": table_of(_FAMILIES, drawn, note=_NOTE)}
    question = "Does any impact gain energy, even in the last bit?"
    return finding_of("exact-energy", "Exact energy", question, f"{recorded}; {adverse}.", parts, tables, failures,
                      (certified, provoked))


def verdict_of_families(holds: list[bool | None]) -> str:
    """Return the verdict on all families; without a failing family, one that moved too rarely makes it NOT_TESTABLE."""
    return NOT_TESTABLE if None in holds and False not in holds else verdict_of_law(holds)


def _certified(runner: Runner, name: str) -> dict[str, Any]:
    """Return the table row of a run; it is empty if the run's law is not the engine's or the run has no impact."""
    run = read_run(runner.store.folder / name)
    if run.law not in ENGINE_LAWS or not len(run.impacts.step):
        return {}
    one: Certificate = certify(run)
    return {"run": name, "law": run.law, "impacts": one.impacts, "gains": one.gains, "largest gain": one.largest_gain,
            "M Δv − impulse": _known(one.momentum), "Jᵀp − impulse": _known(one.span),
            "restitution": _known(one.restitution), HOLDS: one.passed}  # fmt: skip


def _known(value: float) -> float | None:
    return None if np.isnan(value) else value


def _sum(rows: list[dict[str, Any]], column: str) -> int:
    return sum(row[column] for row in rows)
