"""Topic: every method and world on all hard cases, the failing one as a motion, and the ordinary
scenes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from reference.one_thread import one_thread
from verification.check import Check, Study, Topic
from verification.data import data_of
from verification.finding import Part
from verification.hard_cases.case import NOT_TRIED, STABLE, AnyCase, TrajectoryCase
from verification.hard_cases.catalogue import HARD_CASES
from verification.hard_cases.judge import judge_hard_case, methods_for
from verification.numbers import Values, quoted
from verification.ordinary.judge import ORDINARY, THEIRS
from verification.ordinary.touch import TOUCH
from verification.table import Columns, Row, Table

ENGINE = ("factored", "IAPB")  # the engine's default impact method and its world
IMPACT = "impact"
MOTION = "motion"
INSTANTS = 600  # of a failing motion
QUOTES = data_of(__file__, "numbers.yaml")


def _case(study: Study, name: str) -> AnyCase:
    return study.once(("hard case", name), HARD_CASES[name])


def _kind(case: AnyCase) -> str:
    return MOTION if isinstance(case, TrajectoryCase) else IMPACT


def _pairs(study: Study) -> Iterator[tuple[str, str]]:
    """Yield each case with each of its methods or worlds."""
    for name in HARD_CASES:
        yield from ((name, method) for method in methods_for(_case(study, name)))


@one_thread()
def _judged(study: Study, pair: tuple[str, str]) -> Row:
    name, method = pair
    case = _case(study, name)
    return {
        "case": case.name,
        "kind": _kind(case),
        **judge_hard_case(case, method, study.run),
    }


def is_right(row: Mapping[str, Any]) -> bool | None:
    """Whether a method is right in a case; None if it was not tried."""
    return None if row["outcome"] == NOT_TRIED else bool(row["outcome"] == STABLE)


def failing(table: Table) -> list[str]:
    """Return the cases in which the engine is wrong."""
    return [
        row["case"] for row in table.records() if row["method"] in ENGINE and is_right(row) is False
    ]


def _targets(table: Table) -> Iterator[Part]:
    """Yield the target of the engine: no hard case is wrong."""
    yield Part.on("hard cases in which the engine is wrong", len(failing(table)), 0)


EVERY_METHOD = Check(
    key="every method",
    question="Which methods give the known answer and gain no energy?",
    cases=_pairs,
    row=_judged,
    holds=is_right,
    targets=_targets,
    columns=Columns(prose=("note",)),
)


def _described(study: Study, name: str) -> Row:
    case = _case(study, name)
    return {
        "case": case.name,
        "kind": _kind(case),
        "source": case.source,
        "why it is hard": case.why_hard,
        "known answer": case.law,
        "expected": case.expected,
    }


CASES = Check(
    key="cases",
    question="Where does each case come from, why is it hard, and what is its answer?",
    cases=lambda study: HARD_CASES,
    row=_described,
    columns=Columns(prose=("why it is hard", "known answer", "expected")),
)


def _failing_motions(study: Study) -> list[TrajectoryCase]:
    """Return the first motion in which the engine fails, if there is one."""
    wrong = failing(study.table(EVERY_METHOD))
    cases = (_case(study, name) for name in HARD_CASES)
    return [case for case in cases if isinstance(case, TrajectoryCase) and case.name in wrong][:1]


def _over_time(study: Study, case: TrajectoryCase) -> Iterator[Row]:
    """Yield the kinetic energy of the moving bodies over time in each world of the case."""
    for world in case.worlds:
        run = study.run(case.scene, world)
        kinetic = run.energy["kinetic"]
        for place in _instants(kinetic):
            yield {
                "case": case.name,
                "world": world,
                "time [s]": float(run.time[place]),
                "kinetic energy [mJ]": 1e3 * float(kinetic[place]),
            }


def _instants(values: np.ndarray) -> list[int]:
    """Return instants at which to draw a curve: evenly spread ones, and both sides of its jumps."""
    even = np.linspace(0, len(values) - 1, INSTANTS // 2).round().astype(int)
    steep = np.argsort(-np.abs(np.diff(values)), kind="stable")[: INSTANTS // 4]
    return sorted({*even.tolist(), *steep.tolist(), *(steep + 1).tolist()})


FAILURE = Check(
    key="the failure",
    question="What does the engine do where it fails?",
    cases=_failing_motions,
    row=_over_time,
)


def _numbers(tables: Mapping[str, Table]) -> Values:
    """Return what the page quotes."""
    every = tables[EVERY_METHOD.key]
    wrong = failing(every)
    rows = every.records()
    others = {row["case"] for row in rows if row["method"] not in ENGINE and is_right(row) is False}
    right = {row["case"] for row in rows if row["method"] in ENGINE and is_right(row)}
    return {
        "right": len(right.difference(wrong)),
        "failing": len(wrong),
        "failing_case": wrong[0] if wrong else None,
        "other_fails": len(others),
        **_failure_numbers(tables[FAILURE.key]),
        "mujoco_right": _right_in_mujoco(tables[ORDINARY.key]),
        **quoted(QUOTES, tables),
    }


def _right_in_mujoco(table: Table) -> int | None:
    key = f"{THEIRS} is right"
    return sum(table[key]) if key in table.keys else None


def _failure_numbers(table: Table) -> Values:
    """Return how many times the energy of arrival each world reaches; the rigid wall only loses it,
    so its largest energy is that of arrival."""
    largest = (
        {
            world: max(table.where(world=world)["kinetic energy"])
            for world in dict.fromkeys(table["world"])
        }
        if table.rows
        else {}
    )
    arrival = largest.get("ideal")
    return {
        f"failure_energy_times_{name}": largest[world] / arrival
        if arrival and world in largest
        else None
        for world, name in (("IAPB", "iapb"), ("PB", "pb"))
    }


TOPIC = Topic(
    key="hard-cases",
    title="Hard cases",
    question="Which hard cases break it?",
    checks=(EVERY_METHOD, CASES, FAILURE, ORDINARY, TOUCH),
    numbers=_numbers,
)
