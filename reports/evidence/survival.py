"""Topic: do runs repeat to the last bit?"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from reports.evidence.runs import FIGURE_RUNS, shipped_scene
from reports.resimulate import repeat_run
from reports.runner import Runner
from verification.finding import REFUTED, REPRODUCED, Failure, Finding, Part, finding_of, of_each
from verification.table import titled

LEAD = "Does a run repeat to the last bit if it is simulated again from its file alone?"


def compute(runner: Runner, depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Simulate the runs of the figures again from their files."""
    failures: list[Failure] = []
    repeated = tuple(of_each(FIGURE_RUNS, partial(_repeated, runner), failures))
    same = sum(repetition.same for _, repetition in repeated)
    part = Part(
        f"{same} of {len(repeated)} runs of the figures repeat to the last bit when simulated "
        f"again from "
        "their own files alone.",
        REPRODUCED if same == len(repeated) else REFUTED,
        target="all",
        asked="Runs of the figures that repeat to the last bit",
        measured=f"{same} of {len(repeated)}",
    )
    table = titled(
        ("run", "content hash stored", "content hash, simulated again", "differs in"),
        [
            (name, one.stored[:16], one.again[:16], ", ".join(map(str, one.differs)) or "nothing")
            for name, one in repeated
        ],
    )
    tables = {"simulated again": table}
    return finding_of(
        "survival", "Runs that repeat", LEAD, part.sentence, (part,), tables, failures
    )


def _repeated(runner: Runner, name: str) -> Any:
    scene, values, world, rendering = FIGURE_RUNS[name]
    source = shipped_scene(scene, values)
    runner(source, world, rendering)
    path = runner.store.folder / runner.file_of(source, world, rendering)
    yield name, repeat_run(path)
