"""Topic: what crashes, full disks, damaged files and wrong input do; and runs that come out the same."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from reports.evidence.runs import FIGURE_RUNS, shipped_scene
from reports.figures.figure import Numbers
from reports.pages.records import Finding, Topic, with_failures
from reports.runner import Runner
from verification.finding import REFUTED, REPRODUCED, Failure, of_each

LEAD = (
    "A result that can be lost, or changed without a word, is no evidence. Each of these was done on purpose to a "
    "store of runs; a fault is survived if every run that was finished is there and whole, and what is not whole says "
    "so."
)
TIMES = {"quick": 12, "full": 120}
INPUTS = {"quick": 60, "full": 2000}  # wrong inputs of each kind
_SAID = 160  # characters of a message that a table shows


def compute(runner: Runner, depth: str, progress: Callable[[int, int], None]) -> Topic:
    """Do every fault, and simulate the runs of the figures again from their files."""
    from reports.faults import try_faults
    from reports.fuzz import fuzz
    from reports.fuzz.kinds import kinds

    failures: list[Failure] = []
    with tempfile.TemporaryDirectory() as folder:
        faults = try_faults(Path(folder), TIMES[depth], progress, failures)
    repeated = tuple(of_each(FIGURE_RUNS, partial(_repeated, runner), failures))
    inputs = tuple(of_each(kinds(), lambda kind: [fuzz(kind, range(INPUTS[depth]))], failures))
    tables = {"faults": _fault_table(faults), "simulated again": _repeated_table(repeated),
              "wrong input": _input_table(inputs)}  # fmt: skip
    findings = (_faults(faults), _repetitions(repeated), _inputs(inputs))
    verdict = " ".join(finding.sentence for finding in findings)
    return with_failures(Topic("survival", "Runs that survive", LEAD, findings, tables, verdict), failures)


def _repeated(runner: Runner, name: str) -> Any:
    from reports.resimulate import repeat_run

    scene, values, world, rendering = FIGURE_RUNS[name]
    source = shipped_scene(scene, values)
    runner(source, world, rendering)
    path = runner.store.folder / runner.file_of(source, world, rendering)
    yield name, repeat_run(path)


def _inputs(records: Any) -> Finding:
    tried, broken = sum(record.tried for record in records), sum(len(record.broken) for record in records)
    came = f"{broken} gave a traceback or hung" if broken else "none gave a traceback or hung"
    return Finding(f"Of {tried} wrong inputs of {len(records)} kinds {came}: "
                   f"{sum(record.refused for record in records)} were refused by name, the others taken as valid.",
                   REFUTED if broken else REPRODUCED)  # fmt: skip


def _input_table(records: Any) -> Numbers:
    rows = tuple((r.kind, r.tried, r.refused, r.read, len(r.broken), " ".join(r.said.split())[:_SAID]) for r in records)
    columns = ("input", "tried", "refused by name", "taken as valid", "traceback or hang", "the shortest refusal")
    return Numbers(columns, rows)


def _faults(faults: Any) -> Finding:
    tried, survived, lost = (sum(getattr(fault, name) for fault in faults) for name in ("tried", "survived", "lost"))
    return Finding(
        f"Of {tried} faults of {len(faults)} kinds, {survived} were survived; {lost} finished results were lost.",
        REPRODUCED if survived == tried and lost == 0 else REFUTED)  # fmt: skip


def _repetitions(repeated: Any) -> Finding:
    same = sum(repetition.same for _, repetition in repeated)
    return Finding(f"{same} of {len(repeated)} runs of the figures, simulated again from nothing but their own files, "
                   "came out the same to the last bit.", REPRODUCED if same == len(repeated) else REFUTED)  # fmt: skip


def _fault_table(faults: Any) -> Numbers:
    rows = tuple((fault.fault, fault.tried, fault.survived, fault.lost, fault.said) for fault in faults)
    return Numbers(("fault", "tried", "survived", "lost", "what one reads"), rows)


def _repeated_table(repeated: Any) -> Numbers:
    rows = tuple((name, one.stored[:16], one.again[:16], ", ".join(map(str, one.differs)) or "nothing")
                 for name, one in repeated)  # fmt: skip
    return Numbers(("run", "content hash stored", "simulated again", "differs in"), rows)
