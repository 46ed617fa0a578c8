"""Topic: do runs repeat to the last bit?"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from reports.evidence.runs import FIGURE_RUNS, shipped_scene
from reports.resimulate import repeat_run
from reports.runner import Runner
from verification.finding import Failure, Finding, Part, finding_of, of_each
from verification.numbers import value_tables
from verification.table import titled

LEAD = "Does a run repeat to the last bit if it is simulated again from its file alone?"


def compute(runner: Runner, depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Simulate the runs of the figures again from their files."""
    failures: list[Failure] = []
    repeated = tuple(of_each(FIGURE_RUNS, partial(_repeated, runner), failures))
    same = sum(repetition.same for _, repetition in repeated)
    part = Part.on("runs that repeat to the last bit", same, len(repeated), least=True)
    table = titled(
        ("run", "content hash stored", "content hash, simulated again", "differs in"),
        [
            (name, one.stored[:16], one.again[:16], ", ".join(map(str, one.differs)) or "nothing")
            for name, one in repeated
        ],
    )
    quoted = value_tables({"runs": len(repeated), "same": same})
    tables = {"simulated again": table, **quoted}
    return finding_of("survival", "Runs that repeat", LEAD, (part,), tables, failures)


def _repeated(runner: Runner, name: str) -> Any:
    scene, values, world, rendering = FIGURE_RUNS[name]
    source = shipped_scene(scene, values)
    runner(source, world, rendering)
    path = runner.store.folder / runner.file_of(source, world, rendering)
    yield name, repeat_run(path)
