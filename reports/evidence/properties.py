"""Stage: the laws on random and nasty impacts, the planted faults, and the bulk study of energy gains."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from reports.figures.figure import Numbers
from reports.pages.records import Property

IMPACTS = {"quick": 100_000, "full": 1_000_000}
COMPARED_IMPACTS = {"quick": 10_000, "full": 100_000}  # of the variants shown beside it
SEED = 20050601
Progress = Callable[[int, int], None]


def compute(progress: Progress) -> tuple[Property, ...]:
    """Every law of the kit on our resolver, each with a planted fault that must break it."""
    from iapb import resolve_impact
    from verification.properties import LAWS, PLANTED_BUGS, check_passivity

    report = check_passivity(resolve_impact, impacts=1500, search=0)
    first: dict[str, tuple[str, Any]] = {}
    for name, bug in PLANTED_BUGS.items():
        first.setdefault(bug.caught_by, (name, bug))
    records = []
    for done, verdict in enumerate(report.verdicts):
        progress(done, len(LAWS))
        fault, caught = "", None
        if verdict.law in first:
            fault, bug = first[verdict.law]
            broken = check_passivity(bug.make(), impacts=400, search=0)
            caught = verdict.law in broken.broken_laws
        worst = verdict.worst
        records.append(Property(
            verdict.statement, verdict.checked, f"{worst.value:.1e}" if worst else "does not apply",
            f"{worst.tolerance:.1e}" if worst else "", verdict.passed, fault.replace("_", " "), caught))
    progress(len(LAWS), len(LAWS))
    return tuple(records)


def bulk(depth: str, progress: Progress) -> Numbers:
    """100,000 random impacts: energy gain against 10 d ε √κ(M), with and without the clamp, and the printed formula."""
    from verification.properties import bulk_impacts

    studies: tuple[tuple[str, str, bool | None, int], ...] = (
        ("factored", "factored", None, IMPACTS[depth]),
        ("factored, no clamp", "factored", False, COMPARED_IMPACTS[depth]),
        ("gram_pinv, as printed", "gram_pinv", None, COMPARED_IMPACTS[depth]),
    )
    total, before = sum(study[3] for study in studies), 0
    rows: list[tuple[Any, ...]] = []
    for label, method, clamp, count in studies:
        def report(done: int, _: int, base: int = before) -> None:
            progress(base + done, total)

        result = bulk_impacts(count, SEED, method, clamp, progress=report)
        before += count
        for row in result.by_condition():
            rows.append((label, f"1e{row.decade}", row.impacts, row.worst_gain, row.worst_gain_over_bound,
                         row.worst_gain_over_cholesky_bound, row.above_bound, row.worst_residual))
        rows.append((label, "all", count, float(result.gain.max()), result.worst_ratio,
                     float((result.gain / result.cholesky_bound).max()), result.above_bound,
                     float(result.residual.max())))
    return Numbers(
        ("method", "condition of M from", "impacts", "largest relative energy gain", "gain / (10 d ε √κ)",
         "gain / (d ε κ)", "above 10 d ε √κ", "largest restitution residual"), tuple(rows), 3,
        "d 1 to 30, c 0 to 100, rank deficient, e in [−1, 1]; velocities N(0, I) in v and in Lᵀv; energies in "
        "double-double.")
