"""Time of one impact, and of whole steps, beside complementarity: the rows of claim C22.

The time is the whole one from M, J, v to v⁺: forming W or its factor for the references, the checks
of `resolve_impact` for IAPB. Only methods that are called in the same way are compared: the kernels
of IAPB and of Lemke's method from compiled code, all others from Python. The common interface of
the references takes time for its checks; DAQP is timed without it, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple
from unittest import mock

import numpy as np

from iapb.errors import IapbError, MissingDependencyError
from iapb.scene import Scene, find_scene, load_scene, scene_names
from iapb.simulation import Simulation
from reference.one_thread import one_thread
from reference.worlds import find_world
from verification.check import Study
from verification.clock import LEAST_ROUNDS, Times, sampler, take_turns
from verification.cost import calls
from verification.cost.accuracy import COMPILED, IAPB, LEMKE, PYTHON
from verification.cost.calls import PRINTED, Call
from verification.cost.problems import patch, pile
from verification.cost.resting import RESTING
from verification.cost.steps import RecordedLoop
from verification.finding import attempt
from verification.impacts import ImpactCase
from verification.table import Row

FAMILIES = {"patch": patch, "pile": pile}
# Contacts of compiled methods, and of those called from Python.
SIZES = (*range(1, 13), 14, 16, 20, 24, 28, 32, 40, 48, 56, 64, 80, 96, 128, 192, 300)
CALLED_SIZES = (1, 2, 4, 8, 16, 32, 64, 128, 300)
DAQP = "DAQP, direct call"
SOLVERS = ("daqp", "quadprog", "lemke", "gauss_seidel", "proxqp", "cvxpy_clarabel")
# Where the arrays of an impact lie in memory changes its ratio by up to 40 %, so each compiled size
# has several draws, each in arrays of its own. Their median then moves by up to 12 % between
# processes on a busy machine (once by 19 %).
DRAWS = 4
ROUNDS = {"quick": LEAST_ROUNDS, "full": 7}
LONGEST = {
    "quick": 0.4,
    "full": 60.0,
}  # [s] a solver that needs more time for an impact skips larger impacts
# An impact counts as solved if |v⁺ − v⁺_IAPB| in the kinetic metric is below this; first-order
# solvers reach 1e-6.
SOLVED = 1e-5
CLEAR = 1.1  # a clear difference: a quartile of the ratio is beyond this factor
STEPS = "whole steps"
RIGID = "rigid wall"
OF_STEPS = ("IAPB, slowest [µs]", "solver alone [µs]")
MEASURED = ("time [µs]", "IAPB [µs]", "ratio", "lower quartile", "upper quartile")


class Size(NamedTuple):
    """Impacts of a family, resolved by methods that are called in one way."""

    impacts: str
    called: str
    contacts: int


CASES: tuple[Size | str, ...] = (
    *(Size(family, COMPILED, c) for c in SIZES for family in FAMILIES),
    *(Size(family, PYTHON, c) for c in CALLED_SIZES for family in FAMILIES),
    *scene_names(),
    *RESTING,
)


def compare(study: Study, case: Size | str) -> Iterator[Row]:
    """Yield the rows of one size of impact, or of the steps of one scene.

    ratio : our time over theirs, round by round; apart : distance of the two velocities
    """
    return _steps(study, case) if isinstance(case, str) else _impacts(study, case)


def _impacts(study: Study, size: Size) -> Iterator[Row]:
    compiled = size.called == COMPILED
    draws = DRAWS if compiled else 1
    ratios: dict[str, list[float]] = {}
    spent: dict[str, list[float]] = {}
    apart: dict[str, float] = {}
    ours = IAPB
    slow: set[tuple[str, str]] = study.once("too slow", set)
    for draw in range(draws):
        rng = np.random.default_rng([study.seed, size.contacts, draw])
        case = FAMILIES[size.impacts](size.contacts, rng)
        made, answers = _made(study, size, case)
        times = take_turns(
            {name: sampler(call) for name, call in made.items()}, ROUNDS[study.depth], warm=False
        )
        for name, taken in times.items():
            spent.setdefault(name, []).extend(taken.samples)
            ratios.setdefault(name, []).extend(times[ours].over(taken).samples)
            apart[name] = max(apart.get(name, 0.0), case.distance(answers[name], answers[ours]))
            if name != ours and taken.median > 0.25 * LONGEST[study.depth]:
                slow.add((size.impacts, name))
    for name in spent:
        if name != ours:
            yield {
                "impacts": size.impacts,
                "method": name,
                "called": size.called,
                "contacts": size.contacts,
                **_cells(
                    Times(tuple(spent[name])), Times(tuple(spent[ours])), Times(tuple(ratios[name]))
                ),
                "apart": apart[name] if np.isfinite(apart[name]) else np.inf,
            }


def _made(study: Study, size: Size, case: ImpactCase) -> tuple[dict[str, Call], dict[str, Any]]:
    """Return the calls of the methods that answer, and their v⁺; a missing package is left out."""
    makers: dict[str, Callable[[ImpactCase], Call]] = {
        IAPB: calls.kernel_call,
        LEMKE: calls.lemke_call,
    }
    if size.called == PYTHON:
        makers = {IAPB: calls.engine_call, PRINTED: calls.printed_call, DAQP: calls.daqp_call}
        makers |= {name: partial(calls.solver_call, name=name) for name in SOLVERS}
    slow: set[tuple[str, str]] = study.once("too slow", set)
    made = dict[str, Call]()
    answers = dict[str, Any]()

    def tried(name: str) -> None:
        try:
            call = makers[name](case)
            answers[name] = np.array(call())
            made[name] = call
        except MissingDependencyError:
            return

    with one_thread():
        for name in makers:
            if (size.impacts, name) not in slow:
                attempt(
                    f"{name}, {', '.join(map(str, size))}", partial(tried, name), study.failures
                )
    return made, answers


def _cells(theirs: Times, ours: Times, ratio: Times) -> Row:
    values = (1e6 * theirs.median, 1e6 * ours.median, ratio.median, ratio.lower, ratio.upper)
    return dict(zip(MEASURED, values, strict=True))


def costs_more(row: Row) -> bool | None:
    """Return whether complementarity takes clearly longer; None if neither does.

    Of an impact, by the quartiles of our time over theirs, if both methods give the same velocity.
    Of whole steps, by the time inside the compiled solver of the rigid step.
    """
    alone = row.get("solver alone")
    if alone is not None:
        if alone > CLEAR * row["IAPB, slowest"]:
            return True
        return False if row["time"] < row["IAPB"] else None
    if row["ratio"] is None or not row["apart"] <= SOLVED:
        return None
    if row["upper quartile"] <= 1.0 / CLEAR:
        return True
    return False if row["lower quartile"] >= CLEAR else None


MOST_STEPS = 300  # timed steps of a scene
RIGID_RUNS = 2  # the first one may compile


def _steps(study: Study, name: str) -> Iterator[Row]:
    """Yield the time of a step with rigid walls, beside that of IAPB.

    Our rigid world is called from Python and IAPB is compiled, so the two do not compare as they
    are. But its solver, DAQP, is compiled, and tells its own time. If the solver alone takes longer
    than the whole step of IAPB, a compiled rigid step takes longer, too. If the whole rigid step
    takes less, it costs less. Else the scene cannot tell.
    """
    scene = RESTING[name].scene() if name in RESTING else load_scene(find_scene(name))
    rigid_loop, our_loop = (_loop(world, scene) for world in ("ideal", "IAPB"))
    steps = rigid_loop.steps
    try:
        samples = list[float]()
        with one_thread():
            inside = seconds_in_solver(
                lambda: samples.extend(rigid_loop.sample() for _ in range(RIGID_RUNS))
            )
        ours = [our_loop.sample() for _ in range(LEAST_ROUNDS + 1)][1:]
    except IapbError:  # the rigid world stops: two laws of restitution, or too many contacts
        return
    alone = inside / (RIGID_RUNS * steps)
    median = float(np.median(ours))
    yield {
        "impacts": STEPS,
        "method": RIGID,
        "called": PYTHON,
        "scene": name,
        "time [µs]": 1e6 * min(samples),
        "IAPB [µs]": 1e6 * median,
        "IAPB, slowest [µs]": 1e6 * max(ours),
        "solver alone [µs]": 1e6 * alone,
    }


def _loop(world: str, scene: Scene) -> RecordedLoop:
    """Return the loop over the first steps of a scene in a world."""
    found = find_world(world)
    simulation = Simulation(scene, found.law, found.coupling_in(scene))
    return RecordedLoop(simulation, min(scene.steps, MOST_STEPS))


def seconds_in_solver(work: Callable[[], object]) -> float:
    """Return the time [s] that DAQP measures inside its compiled code while `work` runs."""
    import daqp

    solve = daqp.solve
    spent = list[float]()

    def timed(*given: Any, **options: Any) -> Any:
        answer = solve(*given, **options)
        spent.append(answer[3]["setup_time"] + answer[3]["solve_time"])
        return answer

    with mock.patch.object(daqp, "solve", timed):
        work()
    return sum(spent)
