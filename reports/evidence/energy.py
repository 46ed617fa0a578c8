"""Topic: does anything ever create energy? The table of impacts, the laws, the scenes, and all runs
of the report, whose impacts are judged in exact arithmetic."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from iapb.contact.laws import ENGINE_LAWS
from reports.store.runs import read_run
from reports.workers import REPORT_WORKERS, executor
from verification.certificate import certify
from verification.check import Check, Study, Topic
from verification.finding import Part, attempt
from verification.laws import LAWS
from verification.laws.bulk import GAIN, PRINTED, TABLE, ours
from verification.laws.topic import CAUGHT, COUNTEREXAMPLES, LAW_TABLE
from verification.numbers import Values
from verification.scenes.books import OPEN
from verification.scenes.ledger import SCENES, WORTH_NAMING
from verification.table import HOLDS, Row, Table

CERTIFIED_RUNS = "certified runs"  # the check that needs the runs of all other stages
# names of files that are not even read
WITHOUT_IMPACTS = re.compile(r"-(PB|CBuc|ideal|ideal-friction)-[0-9a-f]+\.h5$")
FEW = 100  # runs that are certified in this process, which is faster than to start others


def _certified(study: Study, name: str) -> list[Row]:
    folder = study.run.store.folder  # type: ignore[attr-defined]
    return study.once(name, lambda: _rows(folder, name))


def _rows(folder: Path, name: str) -> list[Row]:
    """Return the row of a run; none if the run's law is not the engine's or the run has no impact.

    Rigid worlds are left out: they solve for the impulses and forces of a step together and record
    no separate impact.
    """
    if WITHOUT_IMPACTS.search(name):
        return []
    run = read_run(folder / name)
    if run.law not in ENGINE_LAWS or not len(run.impacts.step):
        return []
    one = certify(run)
    return [
        {
            "run": name,
            "law": run.law,
            "impacts": one.impacts,
            "gains": one.gains,
            "largest gain": one.largest_gain,
            "M Δv − impulse": _known(one.momentum),
            "Jᵀp − impulse": _known(one.span),
            "error of restitution": _known(one.restitution),
            HOLDS: one.passed,
        }
    ]


def _runs(study: Study) -> list[str]:
    """Return the names of the runs, certified in processes; a run that raises there is tried again,
    and named, without them."""
    names = sorted(study.run.files)  # type: ignore[attr-defined]
    if len(names) > FEW:
        rows = partial(_rows, study.run.store.folder)  # type: ignore[attr-defined]
        with executor(REPORT_WORKERS) as pool:
            found = zip(names, pool.map(partial(attempted, rows), names), strict=True)
            study.results.update((name, given) for name, given in found if given is not None)
    return names


def attempted(compute: Callable[[Any], Any], part: Any) -> Any:
    """Return the result of a part, or None if it raises."""
    return attempt("", partial(compute, part), [])


def _known(value: float) -> float | None:
    return None if np.isnan(value) else value


def _targets(table: Table) -> Iterator[Part]:
    yield Part.on("impacts in runs that gain energy", _sum(table, "gains"), 0)


RUNS = Check(
    key=CERTIFIED_RUNS,
    question="Does an impact of any run gain energy, in exact arithmetic?",
    cases=_runs,
    row=_certified,
    targets=_targets,
)


def _sum(table: Table, key: str) -> int:
    return sum(table[key]) if table.rows else 0


def numbers(tables: Mapping[str, Table]) -> Values:
    """Return what the pages quote."""
    impacts = tables[TABLE.key]
    laws = tables[LAW_TABLE.key]
    scenes = tables[SCENES.key]
    runs = tables[CERTIFIED_RUNS]
    told = ours(impacts)
    printed = impacts.where(method=PRINTED).records()[0]
    widest = max(scenes.records(), key=lambda row: float(row[OPEN]))
    caught = laws[CAUGHT]
    return {
        "impacts": _sum(told, "impacts"),
        "gains": _sum(told, "gains"),
        "runs": len(runs.rows),
        "impacts_in_runs": _sum(runs, "impacts"),
        "gains_in_runs": _sum(runs, "gains"),
        "printed_largest_gain": printed[GAIN],
        "impact_laws": len(LAWS),
        "laws": len(laws.rows),
        "laws_kept": sum(laws.decided),
        "faults": len(caught),
        "faults_caught": sum(caught),
        "scenes": len(scenes.rows),
        "scenes_above_1_percent": sum(row[OPEN] > WORTH_NAMING for row in scenes.records()),
        "widest_residual_percent": widest[OPEN],
        "widest_scene": widest["scene"].replace("_", " "),
        **_example(tables[COUNTEREXAMPLES.key]),
    }


def _example(table: Table) -> Values:
    """Return the counterexample to the printed formula."""
    row = table.where(solver=PRINTED).records()[0]
    return {
        "example_gain": row["relative energy gain"],
        **{f"example_{name}": row[name] for name in ("M", "J", "v⁻", "e", "v⁺")},
    }


TOPIC = Topic(
    key="energy",
    title="Energy",
    question="Does anything ever create energy?",
    checks=(TABLE, LAW_TABLE, COUNTEREXAMPLES, SCENES, RUNS),
    numbers=numbers,
)
