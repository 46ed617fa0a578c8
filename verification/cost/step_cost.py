"""C22: time of one impact with each solver and of one step in each world, compared with IAPB in the same run.

The time of an impact is the whole time from M, J, v to v⁺. It includes forming W or its factor for the references, and
the checks of `resolve_impact` for IAPB. The kernels of IAPB and of Lemke's method are called from compiled code, as in
the engine's step. `rivals` compares only methods that are called in the same way. The rigid worlds solve a QP per step
from Python, while the engine's worlds are compiled. Therefore IAPB's step is timed in both ways: in the compiled loop,
and one step at a time from Python.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from iapb.errors import IapbError, MissingDependencyError
from iapb.scene import find_scene, load_scene
from iapb.simulation import Simulation
from reference.one_thread import one_thread
from reference.worlds import find_world
from verification.clock import LEAST_ROUNDS, Times, sampler, seconds, take_turns
from verification.cost.calls import (
    PRINTED,
    Call,
    Floats,
    KernelCall,
    LemkeCall,
    engine_call,
    printed_call,
    solver_call,
)
from verification.cost.loop import RecordedLoop
from verification.finding import Column, Failure, Row, Table, attempt, failure_of, table_of
from verification.impacts import RANK_CUT, ImpactCase

CONTACTS = (1, 2, 4, 8, 16, 32, 64, 128, 300)
SOLVERS = ("daqp", "quadprog", "lemke", "gauss_seidel", "proxqp", "cvxpy_clarabel")
IAPB, KERNEL, LEMKE_KERNEL = "IAPB", "IAPB kernel", "Lemke kernel"
REPEATS = 5
LONGEST = 2.0  # [s] a solver that needs more time for an impact skips larger impacts, and their rows say so
# An impact counts as solved if |v⁺ − v⁺_reference| in the kinetic metric is below this; first-order solvers reach 1e-6.
_SOLVED = 1e-5

_DRAWS = 1000  # most draws of a patch
_AGREE = 1e-9  # largest difference of two equal changes of velocity, relative to |v⁻|, in the kinetic metric

_STATISTICS = ("median", "least", "largest")
_SPREAD = tuple(Column(name, "µs", timed=True) for name in _STATISTICS)
# outcome : "solved", "failed", "missing" or "left out" (slower than LONGEST on a smaller impact)
# distance : relative distance of v⁺ from daqp's (for IAPB's own methods from IAPB's), in the kinetic metric
COST_COLUMNS = (
    Column("impacts", condition=True), Column("contacts", condition=True), Column("coordinates"),
    Column("solver", condition=True), Column("outcome"), *_SPREAD, Column("samples"), Column("distance"),
    Column("note", timed=True),
)
# median, least, largest : over the rounds, of the time divided by that of IAPB's compiled loop in the same round
STEP_COLUMNS = (Column("scene", condition=True), Column("world", condition=True),
                *(Column(name, timed=True) for name in _STATISTICS), Column("samples"))


class Rivals(NamedTuple):
    """The rows of a solver and of IAPB on the same impact, called in the same way: compiled, or from Python."""

    called: str
    solver: Row
    ours: Row

    @property
    def costs_more(self) -> bool | None:
        """Whether the solver takes longer; None if it failed, or if the ranges of the two samples overlap."""
        return costs_more(self.solver, self.ours) if self.solver["outcome"] == "solved" else None


def rivals(costs: Table) -> tuple[Rivals, ...]:
    """Return every complementarity solver paired with IAPB on the same impact: kernels, or calls from Python."""
    rows = costs.records()
    ours = {(row["impacts"], row["contacts"], row["solver"]): row for row in rows}
    found = []
    for row in rows:
        if row["solver"] in (IAPB, KERNEL, PRINTED):
            continue
        called, mine = ("compiled", KERNEL) if row["solver"] == LEMKE_KERNEL else ("from Python", IAPB)
        found.append(Rivals(called, row, ours[row["impacts"], row["contacts"], mine]))
    return tuple(found)


def patch(contacts: int, rng: np.random.Generator) -> ImpactCase:
    """Return an impact of a slightly rotating box on `contacts` points of its lower face: d = 6, rank at most 3.

    Points are drawn again until impulses that only push give the velocity of the equalities. Otherwise IAPB and the
    complementarity solvers would resolve the impact differently, and their times would not compare.
    """
    for _ in range(_DRAWS):
        points = np.column_stack([rng.uniform(-1.0, 1.0, (contacts, 2)), -0.5 * np.ones(contacts)])
        up = np.array([0.0, 0.0, 1.0])
        rows = np.column_stack([np.tile(up, (contacts, 1)), np.cross(points, up)])
        velocity = np.array([0.3, 0.1, -1.0, *rng.uniform(-0.2, 0.2, 3)])
        case = ImpactCase(np.diag([2.0, 2.0, 2.0, 0.5, 0.5, 0.8]), rows, velocity, 0.0, "patch")
        if _only_pushes(case):
            return case
    raise IapbError(f"no patch of {contacts} contacts in {_DRAWS} draws on which impulses only push")


def _only_pushes(case: ImpactCase) -> bool:
    """Whether impulses p ≥ 0 give the change of velocity of a plastic impact on all rows."""
    from scipy.optimize import nnls

    u = case.lower.T @ case.velocity
    change = -np.linalg.lstsq(case.rows, case.rows @ u, rcond=RANK_CUT)[0]
    return bool(nnls(case.rows.T, change)[1] <= _AGREE * np.linalg.norm(u))


def pile(contacts: int, rng: np.random.Generator) -> ImpactCase:
    """Return an impact of a stack of planar boxes with two contacts between neighbours, all approaching."""
    boxes = (contacts + 1) // 2
    rows = np.zeros((contacts, 3 * boxes))
    for i in range(contacts):
        box, arm = i // 2, 1.0 if i % 2 else -1.0
        rows[i, 3 * box + 1 : 3 * box + 3] = 1.0, arm
        if box > 0:
            rows[i, 3 * box - 2 : 3 * box] = -1.0, -arm
    velocity = np.zeros(3 * boxes)
    velocity[1::3] = -np.cumsum(rng.uniform(0.5, 1.0, boxes))
    velocity[2::3] = rng.uniform(-0.1, 0.1, boxes)
    return ImpactCase(np.diag(np.tile([1.0, 1.0, 2.0 / 3.0], boxes)), rows, velocity, 0.0, "pile")


def impact_cost(
    contacts: Sequence[int] = CONTACTS,
    solvers: Sequence[str] = SOLVERS,
    repeats: int = REPEATS,
    seed: int = 22,
    longest: float = LONGEST,
    progress: Callable[[str, int, int], None] | None = None,
    failures: list[Failure] | None = None,
) -> Table:
    """Time every solver and IAPB on a patch and a pile of each size, with at least LEAST_ROUNDS samples each."""
    rows: list[Row] = []
    too_slow: dict[tuple[str, str], float] = {}
    for done, count in enumerate(contacts):
        for make in (patch, pile):
            case = make(count, np.random.default_rng([seed, count]))
            with one_thread():
                timing = partial(_time_case, case, solvers, max(LEAST_ROUNDS, repeats), longest, too_slow, failures)
                rows += attempt(f"{case.family} of {count} contacts", timing, failures) or []
        if progress is not None:
            progress("time per impact", done + 1, len(contacts))
    return table_of(COST_COLUMNS, rows, digits=3, note="Time from M, J and v to v⁺ on one thread; methods are timed in "
                    "turns. Kernels are called from compiled code, all others from Python, checks included.")


def _time_case(
    case: ImpactCase, solvers: Sequence[str], repeats: int, longest: float, too_slow: dict[tuple[str, str], float],
    failures: list[Failure] | None,
) -> list[Row]:
    calls, answers, notes = _warm(case, solvers, too_slow, failures)
    samples = take_turns({name: sampler(call) for name, call in calls.items()}, repeats, warm=False)
    too_slow.update({(case.family, name): times.median for name, times in samples.items() if times.median > longest})
    return [_row(case, name, samples, answers, notes) for name in (KERNEL, IAPB, PRINTED, LEMKE_KERNEL, *solvers)]


def _warm(
    case: ImpactCase, solvers: Sequence[str], too_slow: dict[tuple[str, str], float], failures: list[Failure] | None
) -> tuple[dict[str, Call], dict[str, Floats], dict[str, str]]:
    """Return the calls that work, their v⁺, and the reasons why the other calls fail."""
    calls: dict[str, Call] = {KERNEL: KernelCall(case), IAPB: engine_call(case),
                              PRINTED: printed_call(case)}  # fmt: skip
    answers, notes = {name: call() for name, call in calls.items()}, dict[str, str]()
    for name in (LEMKE_KERNEL, *solvers):
        if (case.family, name) in too_slow:
            notes[name] = f"left out: {too_slow[case.family, name]:.3g} s for fewer contacts"
            continue
        try:
            call = LemkeCall(case) if name == LEMKE_KERNEL else solver_call(case, name)
            answers[name] = call()
        except MissingDependencyError as error:
            notes[name] = f"missing: {error}"
        except Exception as error:
            if failures is None:
                raise
            failures.append(failure_of(f"{name} on a {case.family} of {case.contacts} contacts", error))
            notes[name] = f"failed: {error}"
        else:
            calls[name] = call
    return calls, answers, notes


def _row(
    case: ImpactCase, name: str, samples: dict[str, Times], answers: dict[str, Floats], notes: dict[str, str]
) -> Row:
    row: dict[str, Any] = {"impacts": case.family, "contacts": case.contacts, "coordinates": len(case.velocity),
                           "solver": name, "samples": 0, "note": ""}  # fmt: skip
    if name not in samples:
        return row | {"outcome": notes[name].split(":")[0], "note": notes[name]}
    reference = answers[IAPB] if name in (IAPB, KERNEL, PRINTED) else answers.get("daqp", answers[name])
    upper = np.linalg.cholesky(case.mass_matrix).T
    speed = float(np.linalg.norm(upper @ case.velocity))
    distance = float(np.linalg.norm(upper @ (answers[name] - reference))) / speed
    outcome = "solved" if distance <= _SOLVED else "failed"
    return row | {"outcome": outcome, **_spread(samples[name]), "distance": distance if np.isfinite(distance) else None}


def _spread(times: Times) -> dict[str, Any]:
    return {"median": times.median * 1e6, "least": times.least * 1e6, "largest": times.largest * 1e6,
            "samples": times.rounds}  # fmt: skip


SCENES = ("peg_corner", "peg_hole")
COMPILED, STEPPED, IDEAL = "IAPB, compiled loop", "IAPB, step by step", "ideal (QP per step)"
WAYS = (COMPILED, STEPPED, "PB, compiled loop", IDEAL, "CBuc (QP per step)")
STEPS = 256  # number of steps: half a second of the peg, with free, colliding and resting steps


def step_rivals(costs: Table) -> tuple[tuple[Row, Row], ...]:
    """Return (the rigid world's row, IAPB's row) of each scene, both stepped from Python."""
    by = {(row["scene"], row["world"]): row for row in costs.records()}
    return tuple((by[scene, IDEAL], by[scene, STEPPED]) for scene in dict.fromkeys(costs.column("scene"))
                 if (scene, IDEAL) in by and (scene, STEPPED) in by)  # fmt: skip


def costs_more(theirs: Row, ours: Row) -> bool | None:
    """Return whether `theirs` takes longer; None if the ranges of the two samples overlap."""
    if theirs["least"] <= ours["largest"] and ours["least"] <= theirs["largest"]:
        return None
    return bool(theirs["median"] > ours["median"])


def world_cost(
    scenes: Sequence[str] = SCENES, repeats: int = 5, steps: int = STEPS, ways: Sequence[str] = WAYS,
    progress: Callable[[str, int, int], None] | None = None, failures: list[Failure] | None = None,
) -> Table:
    """Time every world on every scene, with at least LEAST_ROUNDS samples each.

    Times are multiples of a step of IAPB's compiled loop; `verification.cost.effects` measures times in seconds.
    """
    rows: list[Row] = []
    for done, name in enumerate(scenes):
        times = take_turns({way: partial(_seconds_per_step, name, way, steps) for way in ways},
                           max(LEAST_ROUNDS, repeats), failures=failures, name=lambda way: f"{name}, {way}")  # noqa: B023  # fmt: skip
        rows += [{"scene": name, "world": way, "median": ratio.median, "least": ratio.least, "largest": ratio.largest,
                  "samples": ratio.rounds} for way, ratio in _over(times, COMPILED)]
        if progress is not None:
            progress("time per step", done + 1, len(scenes))
    return table_of(STEP_COLUMNS, rows, digits=3)


def _over(times: dict[str, Times], unit: str) -> list[tuple[str, Times]]:
    """Return the times of all ways divided by those of `unit` in the same rounds; [] if the unit has no times."""
    return [(way, each.over(times[unit])) for way, each in times.items()] if unit in times else []


def _seconds_per_step(scene_name: str, way: str, steps: int) -> float:
    scene, world = load_scene(find_scene(scene_name)), find_world(way.split(",")[0].split(" ")[0])
    simulation = Simulation(scene, world.law, world.coupling_in(scene))
    if way == STEPPED:
        simulation.step()
        return seconds(simulation.step, steps)
    return RecordedLoop(simulation, steps).sample()
