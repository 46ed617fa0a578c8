"""Topic: does any impact gain energy in exact arithmetic? It checks the report's impacts and many
adverse ones."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from math import floor
from pathlib import Path
from typing import Any

import numpy as np

from iapb import certify
from iapb.contact.laws import ENGINE_LAWS
from reports.store.runs import read_run
from reports.workers import REPORT_WORKERS, executor
from verification.check import Check, Study, Topic
from verification.finding import NOT_TESTABLE, Part, attempt, verdict_of_law
from verification.impacts import ADVERSE_FAMILIES
from verification.laws.bulk import exact_energy
from verification.table import HOLDS, Row, Table

_DRAWN = {"quick": 20_000, "full": 1_000_000}  # impacts of each family
_SLOW = (
    "subnormal velocities",
)  # takes 2 ms an impact, the others some µs: a quarter of the impacts
CERTIFIED_RUNS = "certified runs"  # the check that needs the runs of all other stages
WITHOUT_IMPACTS = re.compile(
    r"-(PB|CBuc|ideal|ideal-friction)-[0-9a-f]+\.h5$"
)  # names of files that are not even read
FEW = 100  # runs that are certified in this process, which is faster than to start others
_RUNS = (
    "Gains: impacts that gain energy; the largest gain is relative to KE⁻. The three errors are "
    "relative, of M Δv "
    "= impulse, Jᵀp = impulse and Jv⁺ = −e Jv⁻, with Δv = v⁺ − v⁻ and recorded impulses. –: does "
    "not apply."
)
_NOTE = (
    "A family is one kind of random impacts, with up to 8 coordinates and contacts. Light "
    "directions: v⁻ along "
    "the lightest axis of M. 600 decades: masses and speeds of nearly all sizes of doubles. "
    "Moved: share of the "
    "impacts with v⁺ ≠ v⁻. Cancelled: number with v⁺ = v⁻ for want of a passive step. Energy "
    "cost, at e = 1: "
    "the energy lost, less that lost without clamp and refinement (which corrects the rounding of "
    "M's Cholesky "
    "factor). It is relative to KE⁻, in units of 10 d ε √κ(M) for d coordinates. Rounding v⁺ to "
    "doubles changes "
    "the energy by at most one unit. –: not computed."
)


def _certified(study: Study, name: str) -> list[Row]:
    folder = study.run.store.folder  # type: ignore[attr-defined]
    return study.once(name, lambda: _rows(folder, name))


def _rows(folder: Path, name: str) -> list[Row]:
    """Return the row of a run; none if the run's law is not the engine's or the run has no impact.

    Rigid worlds are left out: they solve for the impulses and forces of a step together and record
    no separate impact.
    """
    if WITHOUT_IMPACTS.search(name):
        return []
    run = read_run(folder / name)
    if run.law not in ENGINE_LAWS or not len(run.impacts.step):
        return []
    one = certify(run)
    return [
        {
            "run": name,
            "law": run.law,
            "impacts": one.impacts,
            "gains": one.gains,
            "largest gain": one.largest_gain,
            "M Δv − impulse": _known(one.momentum),
            "Jᵀp − impulse": _known(one.span),
            "error of restitution": _known(one.restitution),
            HOLDS: one.passed,
        }
    ]


def _certify_beside(study: Study, names: Sequence[str]) -> None:
    """Certify the runs in processes; a run that raises there is tried again, and named, without
    them."""
    if len(names) > FEW:
        rows = partial(_rows, study.run.store.folder)  # type: ignore[attr-defined]
        with executor(REPORT_WORKERS) as pool:
            found = zip(names, pool.map(partial(attempted, rows), names), strict=True)
            study.results.update((name, given) for name, given in found if given is not None)


def _drawn(study: Study, family: str) -> Row:
    return exact_energy(family, _DRAWN[study.depth] // (4 if family in _SLOW else 1))


def attempted(compute: Callable[[Any], Any], part: Any) -> Any:
    """Return the result of a part, or None if it raises."""
    return attempt("", partial(compute, part), [])


def _known(value: float) -> float | None:
    return None if np.isnan(value) else value


def verdict_of_families(holds: Iterable[bool | None]) -> str:
    """Return the verdict on all families; without a failing family, one that moved too rarely makes
    it NOT_TESTABLE."""
    outcomes = list(holds)
    return NOT_TESTABLE if None in outcomes and False not in outcomes else verdict_of_law(outcomes)


def _recorded_says(table: Table) -> Part:
    gains, impacts = _sums(table)
    return Part(
        f"In {len(table.rows):,} simulations with our engine iapb, {gains or 'none'} of "
        f"{impacts:,} impacts gained energy; the energies are computed exactly",
        "",
        target="none",
        asked="Impacts that gain energy, in all runs",
        measured=f"{gains or 'none'} of {impacts:,}",
    )


def _drawn_says(table: Table) -> Part:
    least = floor(1000.0 * min(table.column("moved"), default=0.0)) / 1000.0  # never rounded up
    moved = f"at least {least:.1%} of the impacts of each family changed the velocity"
    whole = f"{moved}, and so could have gained energy"
    return Part(
        f"{_adverse(table)}; {moved}",
        "",
        target="none",
        asked="Random impacts, drawn to provoke a gain, that gain energy",
        measured="{} of {:,}; {}".format(*_sums(table), whole),
    )


def _adverse(table: Table) -> str:
    gains, impacts = _sums(table)
    return f"Of {impacts:,} random impacts drawn to provoke a gain, {gains or 'none'} gained energy"


def _sums(table: Table) -> tuple[int, int]:
    return (sum(table.column("gains")), sum(table.column("impacts"))) if table.rows else (0, 0)


def _answer(tables: Mapping[str, Table], parts: Sequence[Part]) -> str:
    return f"{parts[0].sentence}. {_adverse(tables['adverse impacts'])}."


def _runs(study: Study) -> Any:
    return sorted(study.run.files)  # type: ignore[attr-defined]


TOPIC = Topic(
    key="exact-energy",
    title="Exact energy",
    question="Does any impact gain energy, even in the last bit?",
    checks=(
        Check(
            key=CERTIFIED_RUNS,
            question="",
            cases=_runs,
            prepare=_certify_beside,
            row=_certified,
            says=_recorded_says,
            note=_RUNS,
        ),
        Check(
            key="adverse impacts",
            question="",
            cases=lambda study: ADVERSE_FAMILIES,
            row=_drawn,
            says=_drawn_says,
            rule=verdict_of_families,
            note=_NOTE,
        ),
    ),
    says=_answer,
)
