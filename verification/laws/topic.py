"""The laws on random inputs with their planted faults, and the smallest inputs that break a law."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from iapb import resolve_impact
from iapb.errors import IapbError
from reference.exact import relative_energy_gain
from verification.check import SEED, Check, Study
from verification.finding import Part, of_each
from verification.laws import LAWS, PLANTED_BUGS, check_passivity, engine, planted
from verification.laws.bounds import LawCount
from verification.laws.resolver import Resolver
from verification.laws.scenes import SceneCase, draw_scene, draw_spatial_scene
from verification.laws.trajectories import TRAJECTORY_LAWS, judge_run
from verification.methods import gram_pinv
from verification.table import HOLDS, Columns, Row, Table

KIT_IMPACTS = 1500
FAULT_IMPACTS = 400
# cases per law, per simulating law, with a fault
ENGINE_CASES = 300
SIMULATED = 20
FAULT_CASES = 60
TRAJECTORIES = 60
IN_SPACE = 40
TRAJECTORY_STEPS = 300
# for the search of a counterexample
COUNTER_IMPACTS = 500
SEARCH = 300
CAUGHT = "fault caught"


def _row(law: str, count: LawCount, fault: str, caught: bool) -> Row:
    """Return the row of a law; the worst is empty if the law applied to no case."""
    value, bound = (count.worst.value, count.worst.tolerance) if count.worst else (None, None)
    return {
        "law": law,
        "cases": count.checked,
        "worst": value,
        "bound": bound,
        HOLDS: not count.failures,
        "fault": fault.replace("_", " "),
        CAUGHT: caught,
    }


def _impact_law(study: Study, name: str) -> Row:
    report = study.once(
        "kit", lambda: check_passivity(resolve_impact, impacts=KIT_IMPACTS, search=0)
    )
    verdict = report.verdict(name)
    fault = PLANTED_BUGS[name]
    if verdict.error is not None:
        raise verdict.error
    broken = check_passivity(fault.make(), laws=[name], impacts=FAULT_IMPACTS, search=0)
    return _row(verdict.statement, verdict, fault.name, name in broken.broken_laws)


def _engine_law(study: Study, name: str) -> Row:
    cases = SIMULATED if name == "group_splitting" else ENGINE_CASES
    count = engine.judge_engine_law(name, cases=cases, seed=SEED)
    fault = planted.PLANTED_ENGINE_FAULTS[name]
    with np.errstate(all="ignore"):  # the faulty subjects may overflow
        broken = engine.judge_engine_law(
            name, fault.make(), cases=min(cases, FAULT_CASES), seed=SEED
        )
    return _row(engine.ENGINE_LAWS[name].statement, count, fault.name, broken.failures > 0)


def _trajectories(study: Study) -> tuple[list[SceneCase], dict[str, LawCount]]:
    """The random scenes, and the count of each law."""
    rng = np.random.default_rng(SEED)
    scenes = [draw_scene(rng, TRAJECTORY_STEPS) for _ in range(TRAJECTORIES)]
    scenes += [draw_spatial_scene(rng, TRAJECTORY_STEPS) for _ in range(IN_SPACE)]
    judged = of_each(
        enumerate(scenes, 1),
        lambda case: judge_run(case[1].simulate()),
        study.failures,
        lambda case: f"trajectory of random scene {case[0]}",
    )
    counts = {name: LawCount(name) for name in TRAJECTORY_LAWS}
    for name, residual in judged:
        counts[name].add(residual)
    return scenes, counts


def _trajectory_law(study: Study, name: str) -> Row:
    scenes, counts = study.once("trajectories", lambda: _trajectories(study))
    residual = planted.residual_with_fault(name, scenes)
    caught = residual is not None and not residual.passed
    fault = planted.PLANTED_TRAJECTORY_FAULTS[name].__name__
    statement = f"along a trajectory: {TRAJECTORY_LAWS[name].statement}"
    return _row(statement, counts[name], fault, caught)


KINDS: dict[str, Callable[[Study, str], Row]] = {
    "impact": _impact_law,
    "engine": _engine_law,
    "trajectory": _trajectory_law,
}


def _laws(study: Study) -> Iterator[tuple[str, str]]:
    yield from (("impact", name) for name in LAWS)
    yield from (("engine", name) for name in engine.ENGINE_LAWS)
    yield from (("trajectory", name) for name in TRAJECTORY_LAWS)


def _law_targets(table: Table) -> Iterator[Part]:
    yield Part.on("laws that the engine breaks", table.holds.count(False), 0)
    yield Part.on("planted faults that no check catches", table[CAUGHT].count(False), 0)


LAW_TABLE = Check(  # the worst of random cases depends on rounding: it is printed, not compared
    key="laws",
    question="Does the law hold, and is its planted fault caught?",
    cases=_laws,
    row=lambda study, case: KINDS[case[0]](study, case[1]),
    targets=_law_targets,
    columns=Columns(prose=("worst",)),
)


# resolver, the law that it breaks, and how the kit is asked: equations (20)-(21) as printed, and the
# obvious extension of (15) to one restitution per row, as equalities
OTHERS: dict[str, tuple[Resolver, str, dict[str, Any]]] = {
    "printed formula": (gram_pinv, "kinetic_energy", {"impacts": COUNTER_IMPACTS}),
    "J v⁺ = −E J v⁻, one e per contact": (
        planted.each_contact_its_own_restitution,
        "unequal_kinetic_energy",
        {
            "impacts": COUNTER_IMPACTS // 2,
            "unequal_restitution": True,
            "laws": ["unequal_kinetic_energy"],
        },
    ),
}


def _found(title: str) -> Row:
    """Return the smallest impact that the kit finds for a resolver that breaks a law."""
    resolver, law, how = OTHERS[title]
    report = check_passivity(resolver, search=SEARCH, **how)
    case = report.counterexample
    if case is None or report.counterexample_law != law:
        raise IapbError(f"in {how['impacts']} random impacts the resolver breaks no law {law!r}")
    v_plus = resolver(*case.given())
    arrays = {
        "M": case.mass_matrix,
        "J": case.contact_jacobian,
        "v⁻": case.velocity,
        "e": case.given_restitution(),
        "v⁺": v_plus,
    }
    return {
        "solver": title,
        "law": report.verdict(law).statement,
        "relative energy gain": relative_energy_gain(case.mass_matrix, case.velocity, v_plus),
        **{name: str(np.asarray(array).tolist()) for name, array in arrays.items()},
        "test": report.counterexample_test,
    }


COUNTEREXAMPLES = Check(
    key="counterexamples",
    question="Which small inputs make other solvers gain energy?",
    cases=lambda study: OTHERS,
    row=lambda study, title: _found(title),
    columns=Columns(prose=("M", "J", "v⁻", "e", "v⁺", "test", "relative energy gain")),
)
