"""`iapb verify --full` and `--recheck`: run the campaign and print what came of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from reports.campaign import KEPT_PER_LAW, Campaign, CampaignRequest

if TYPE_CHECKING:
    from verification.properties.tally import LawCount

ENGINE_CONDITION, ANY_CONDITION = 1e10, 1e8  # largest κ(M): of what the engine proves, of what the kit asks of anybody
_SHOWN = 20  # counterexamples listed; all are in their folder


def verify_full(resolver: str, impacts: int, trajectories: int, seed: int, workers: int, out: Path) -> bool:
    """Do what is missing, print a line per law; return whether all are kept. Another's resolver: impacts only."""
    from reports.commands.progress import stage_progress
    from reports.commands.verify import ENGINE
    from verification.properties.campaign import IMPACTS, PARTS, plan

    ours = resolver == ENGINE
    bounds, condition = ("FACTORED", ENGINE_CONDITION) if ours else ("KIT", ANY_CONDITION)
    request = CampaignRequest(resolver, bounds, condition, impacts, trajectories, seed, workers)
    request.subject()  # a name that cannot be imported is told here, not by a worker
    batches, campaign = plan(impacts, trajectories, PARTS if ours else (IMPACTS,)), Campaign(out, request)
    there = sum(campaign.path_of(batch).is_file() for batch in batches)
    print(f"{len(batches)} batches in {campaign.folder}, {there} of them done before.", flush=True)
    try:
        with stage_progress() as progress:
            campaign.run(batches, progress)
    except KeyboardInterrupt:
        print("Stopped; the same command goes on from here. So far:")
        _print_counts(campaign, batches)
        raise
    kept = _print_counts(campaign, batches)
    print(f"{campaign.seconds(batches) / 60.0:.1f} minutes of work in all.")
    found = campaign.counterexamples()
    if found:
        print(f"{len(found):,} files (of one law at most {KEPT_PER_LAW:,}) show what broke a law. Impacts and "
              "trajectories are runs, for iapb inspect FILE. Judged again by:")
    for path in found[:_SHOWN]:
        print(f"  iapb verify --recheck {path}")
    return kept


def _print_counts(campaign: Campaign, batches: tuple[object, ...]) -> bool:
    from verification.properties.campaign import OF_ONE_CALL, ONE_IN

    kept = True
    for part, laws in campaign.counts(batches).items():  # type: ignore[arg-type]
        print(f"{part}:")
        for count in laws.values():
            print(f"  {'BROKEN' if count.failures else 'kept  '} {count_in_words(count)}")
            kept = kept and not count.failures
    print(f"Of the laws of impacts, {', '.join(OF_ONE_CALL)} are put to every one; each other to one in {ONE_IN}.")
    return kept


def count_in_words(count: LawCount) -> str:
    """Return how many broke a law, of how many, and the worst as a share of its tolerance."""
    worst = count.worst
    nearest = "" if worst is None else f", worst {worst.value:.2e} of {worst.tolerance:.2e} ({worst.ratio:.3f} of it)"
    return f"{count.law}: {count.failures:,} of {count.checked:,} break it{nearest}"


def print_recheck(path: Path) -> bool:
    """Print every residual of a stored counterexample; return whether all laws are kept now."""
    from reports.campaign_counterexamples import recheck
    from reports.commands.progress import to_log
    from reports.compiling import compiling_told

    kept = True
    with compiling_told(to_log):
        judged = tuple(recheck(path))
    for law, residual in judged:
        print(f"  {'kept  ' if residual.passed else 'BROKEN'} {law}: {residual.value:.2e} of {residual.tolerance:.2e}")
        kept = kept and residual.passed
    return kept
