"""Topic: do runs repeat to the last bit? It also shows the last results of fault injection and fuzzing."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from typing import Any

from reports.evidence.depends import LAST_RESULT
from reports.evidence.runs import FIGURE_RUNS, shipped_scene
from reports.resimulate import repeat_run
from reports.runner import Runner
from verification.finding import (
    NOT_COMPUTED,
    REFUTED,
    REPRODUCED,
    Failure,
    Finding,
    Part,
    Table,
    finding_of,
    of_each,
    titled,
)

LEAD = (
    "Evidence must not be lost or changed silently. Each fault below was injected into a store of runs. A fault counts "
    "as survived if every finished run is still there and intact, and every damaged file is reported as damaged."
)


def compute(runner: Runner, depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Simulate the runs of the figures again from their files; read the last results of `make fuzz`."""
    failures: list[Failure] = []
    repeated = tuple(of_each(FIGURE_RUNS, partial(_repeated, runner), failures))
    tables, findings = {"simulated again": _repeated_table(repeated)}, [_repetitions(repeated)]
    for part, finding in (("faults", _faults), ("wrong input", _inputs)):
        if last := _last(part):
            tables[part] = last[0]
            findings.append(finding(*last))
        else:
            findings.append(Part(f"No stored result for {part}: run `make fuzz`.", NOT_COMPUTED))
    verdict = " ".join(finding.sentence for finding in findings)
    return finding_of("survival", "Runs that survive", LEAD, verdict, findings, tables, failures)


def _repeated(runner: Runner, name: str) -> Any:
    scene, values, world, rendering = FIGURE_RUNS[name]
    source = shipped_scene(scene, values)
    runner(source, world, rendering)
    path = runner.store.folder / runner.file_of(source, world, rendering)
    yield name, repeat_run(path)


def _last(part: str) -> tuple[Table, str] | None:
    """Return the table of the last fuzzing or fault injection with its origin; None if there is no stored result."""
    kept = json.loads(LAST_RESULT.read_text(encoding="utf-8")) if LAST_RESULT.is_file() else {}
    if part not in kept:
        return None
    found = kept[part]
    table = titled(tuple(found["columns"]), tuple(tuple(row) for row in found["rows"]))
    return table, f"make fuzz, {found['date']}, commit {found['commit'][:7]}"


def _of_table(table: Table, column: str) -> int:
    """Return the sum of a column."""
    return sum(table.column(column))


def _inputs(table: Table, made: str) -> Part:
    tried, broken = _of_table(table, "tried"), _of_table(table, "traceback or hang")
    came = f"{broken} caused a traceback or a hang" if broken else "none caused a traceback or a hang"
    return Part(f"Of {tried} damaged inputs of {len(table.rows)} kinds {came}: {_of_table(table, 'refused by name')} "
                   f"raised a named error, and the others were still valid input ({made}).",
                   REFUTED if broken else REPRODUCED)  # fmt: skip


def _faults(table: Table, made: str) -> Part:
    tried, survived, lost = (_of_table(table, column) for column in ("tried", "survived", "lost"))
    return Part(
        f"The store survived {survived} of {tried} injected faults of {len(table.rows)} kinds; {lost} finished results "
        f"were lost ({made}).", REPRODUCED if survived == tried and lost == 0 else REFUTED)  # fmt: skip


def _repetitions(repeated: Any) -> Part:
    same = sum(repetition.same for _, repetition in repeated)
    return Part(f"{same} of {len(repeated)} runs of the figures repeat to the last bit when simulated again from "
                   "their own files alone.", REPRODUCED if same == len(repeated) else REFUTED)  # fmt: skip


def _repeated_table(repeated: Any) -> Table:
    rows = tuple((name, one.stored[:16], one.again[:16], ", ".join(map(str, one.differs)) or "nothing")
                 for name, one in repeated)  # fmt: skip
    return titled(("run", "content hash stored", "simulated again", "differs in"), rows)
