"""Stage: the claims ledger, a Finding for each claim, with runs from the store."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from iapb.run import Run
from iapb.scene import Scene
from reports.runner import Runner
from verification.claims import check_claims
from verification.finding import Failure, Finding


def compute(
    runner: Runner, depth: str, progress: Callable[[int, int], None], failures: list[Failure]
) -> tuple[Finding, ...]:
    """Check every claim with runs from the store; each run is listed under every claim that uses it."""
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
    failures += [replace(one, case=f"{result.key}, {one.case}") if one.case != result.key else one
                 for result in results for one in result.failures]  # fmt: skip
    return results
