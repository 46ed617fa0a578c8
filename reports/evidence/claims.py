"""Stage: the claims of the paper, a Finding for each claim, with runs from the store."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from functools import partial

from reports.runner import Runner
from verification.claims import check_claims
from verification.finding import Failure, Finding

MOST_WORKERS = 4  # a worker holds some 400 MB


def cores() -> int:
    """Return the number of worker processes that are worth starting on this machine."""
    return min(MOST_WORKERS, len(os.sched_getaffinity(0)))


def compute(
    runner: Runner, depth: str, progress: Callable[[int, int], None], failures: list[Failure], workers: int = 1
) -> tuple[Finding, ...]:
    """Check every claim with runs from the store; each run is listed under every claim that uses it.

    workers : processes that simulate runs in advance; 1: all runs are simulated in this process
    """
    def begin(done: int, total: int, claim: str) -> None:
        runner.user = claim
        progress(done, total)

    with runner.crew(workers) if workers > 1 else nullcontext() as ahead:
        results = check_claims(partial(runner, keep=False), depth, progress=begin, asked=runner.use_again, ahead=ahead)
    failures += [replace(one, case=f"{result.key}, {one.case}") if one.case != result.key else one
                 for result in results for one in result.failures]  # fmt: skip
    return results
