"""Stage: the claims of the paper, a Finding for each claim, with runs from the store."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import replace

from iapb.run import Run
from iapb.scene import Scene
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

    with runner.crew(workers) if workers > 1 else nullcontext() as crew:

        def ahead(wanted: Sequence[tuple[Scene, str, str]]) -> Iterator[Run | None]:
            made_by_crew = crew(wanted) if crew else ()
            for (scene, world, rendering), made in zip(wanted, made_by_crew, strict=True):
                if made is not None:
                    files[id(scene), world, rendering] = runner.file_of(scene, world, rendering), scene
                yield made

        results = check_claims(run, depth, progress=begin, asked=asked, ahead=ahead if crew else None)
    failures += [replace(one, case=f"{result.key}, {one.case}") if one.case != result.key else one
                 for result in results for one in result.failures]  # fmt: skip
    return results
