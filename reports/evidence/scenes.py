"""Topic: every scene that comes with the project: how deep, where the energy went, how long a step takes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

from reports.evidence import scenes_tables as tables
from reports.evidence.runs import shipped_scene
from reports.evidence.scenes_findings import findings_of, verdict_of
from reports.runner import Runner
from verification.finding import Failure, Finding, attempt, finding_of

if TYPE_CHECKING:
    from iapb.run import Run
    from verification.scenes.open_books import OpenBooks
    from verification.scenes.scene_measures import SceneMeasure

ID, TITLE = "scene-ledger", "The scenes"
LEAD = (
    "Every scene file of the project, run in the world IAPB at the scene's own step. The energy books say where each "
    "joule came from and went; what they leave open is energy that the steps in time made up or swallowed, and must "
    "fall with the integrator's declared order when the step is shortened. Other load on the machine lengthens the "
    "times per step: compare the ratios."
)
WORLD = "IAPB"
TIMED_AGAIN = 3  # short runs are timed in one piece, which may hold compilation
REFINEMENTS = {"quick": (1, 2, 4), "full": (1, 2, 4, 8)}


def compute(runner: Runner, depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Run every scene, at shorter steps too, and keep the books of each."""
    from iapb.scene import scene_names
    from reference.worlds import run_world
    from verification.scenes.open_books import open_books
    from verification.scenes.scene_measures import measure

    def studied(name: str) -> tuple[Run, SceneMeasure, OpenBooks]:
        scene = shipped_scene(name)
        run = runner(scene, WORLD)
        measured = measure(run, [run_world(scene, WORLD) for _ in range(TIMED_AGAIN)])
        return run, measured, open_books(scene, lambda refined: runner(refined, WORLD, keep=False), REFINEMENTS[depth])

    names, failures = scene_names(), list[Failure]()
    found: list[tuple[Run, SceneMeasure, OpenBooks]] = []
    for done, name in enumerate(names):
        progress(done, len(names))
        records = attempt(name, partial(studied, name), failures)
        if records is not None:
            found.append(records)
    progress(len(names), len(names))
    runs, measures, books = zip(*found, strict=True) if found else ((), (), ())
    return topic_of(runs, measures, books, failures)


def topic_of(
    runs: Sequence[Run], measures: Sequence[SceneMeasure], books: Sequence[OpenBooks], failures: Sequence[Failure] = ()
) -> Finding:
    """Return the topic of these records."""
    more = list(failures)
    findings = findings_of(runs, measures, books, more)
    made = tables.all_tables(runs, measures, books)
    return finding_of(ID, TITLE, LEAD, verdict_of(measures, books), findings, made, more)
