"""Stage: the claims ledger, its trials as tables, and the maps of where a claim holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from iapb.run import Run
from iapb.scene import Scene
from reports.figures.condition_map import condition_map
from reports.figures.figure import Figure
from reports.pages.records import Claim
from reports.runner import Runner
from verification.finding import NOT_COMPUTED, REPRODUCED, Failure


def compute(
    runner: Runner, depth: str, progress: Callable[[int, int], None], failures: list[Failure]
) -> tuple[Claim, ...]:
    """Check every claim with runs from the store; each run is listed under every claim that uses it."""
    from verification.claims import check_claims

    files: dict[tuple[int, str, str], tuple[str, Scene]] = {}  # holds the scenes, so that their ids stay theirs

    def run(scene: Scene, world: str, rendering: str) -> Run:
        made = runner(scene, world, rendering, keep=False)
        files[id(scene), world, rendering] = runner.file_of(scene, world, rendering), scene
        return made

    def asked(scene: Scene, world: str, rendering: str) -> None:
        if (id(scene), world, rendering) in files:
            runner.use_again(files[id(scene), world, rendering][0])

    def begin(done: int, total: int, claim: str) -> None:
        runner.user = claim
        progress(done, total)

    results = check_claims(run, depth, progress=begin, asked=asked)
    failures += [replace(one, case=f"{result.id}, {one.case}") if one.case != result.id else one
                 for result in results for one in result.failures]  # fmt: skip
    return tuple(as_record(result) for result in results)


def as_record(result: Any) -> Claim:
    """A ClaimResult as the page shows it."""
    headline, table = "", result.table
    if result.decided:
        headline = f"holds in {result.held} of {result.decided} trials"
    outcome = NOT_COMPUTED if result.failures and result.verdict == REPRODUCED else result.verdict
    return Claim(
        id=result.id, statement=result.statement, place=result.place, outcome=outcome,
        headline=f"{result.finding} ({headline})" if headline else result.finding, quantity=result.quantity,
        conditions=result.conditions, tolerance=result.tolerance, fails=result.fails,
        numbers=replace(table, timed_rows=bool(table.timed)),
        figure=_map(result),
    )  # fmt: skip


def _map(result: Any) -> Figure | None:
    """Where the claim holds, over its two telling conditions; none where it holds everywhere."""
    if result.map_axes is None or result.verdict == "reproduced" or not result.table.rows:
        return None
    units = {column.key: column.title for column in result.table.columns}
    x, y = result.map_axes
    panels = _panel_names(result, units) if result.map_panels else None
    return condition_map(
        f"map-{result.id}", f"Where {result.id} holds", f"Each mark is one simulated condition of {result.id}.",
        (units[x], result.table.column(x)), (units[y], result.table.column(y)), result.table.holds, panels,
    )  # fmt: skip


def _panel_names(result: Any, headings: dict[str, str]) -> list[str]:
    """The value by which maps are split; a number with the name of what it is."""
    values = result.table.column(result.map_panels)
    return [value if isinstance(value, str) else f"{headings[result.map_panels]}: {value:g}" for value in values]
