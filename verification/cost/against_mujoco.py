"""Compare the time of our step with that of MuJoCo's, each in its own compiled loop, on scenes in resting contact.

Our loop is `Simulation.advance_chunk`, as in `simulate`, and records every step. MuJoCo's loop is
`mj_step(model, data, nstep)`, which records nothing. Both run the same number of steps in turns; each round gives one
ratio. All solvers of MuJoCo are timed, and the fastest solver of each form counts. `profile_step` times each part of
our step by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from iapb.compiled import kernel
from iapb.contact.kernels.collide import resolve_collisions
from iapb.contact.kernels.step import clear, find_contacts, locate, move
from iapb.errors import MissingDependencyError
from iapb.haptics.kernels import couple, drive_device
from iapb.recording import make_record, write_step
from iapb.scene import scene_from_text
from iapb.simulation import Simulation
from verification.clock import TIME_COLUMNS, take_turns, time_cells, timed
from verification.cost.resting_scenes import RestingScene, resting_scenes
from verification.finding import Column, Failure, Row, Table, attempt, table_of

STEPS, ROUNDS = 512, 15  # steps of one sample, as in a chunk of `simulate`; number of samples of each loop
SOLVERS = ("Newton", "CG", "PGS")
TARGETS = {"peg in the corner": 0.1}
SPATIAL_TARGET = 0.5


RACE_COLUMNS = (
    Column("scene", condition=True),
    Column("MuJoCo's form", condition=True),
    Column("MuJoCo's solver", condition=True),
    Column("iapb's contacts"),
    Column("MuJoCo's contacts"),
    Column("MuJoCo's step", "µs", timed=True),
    Column("ratio", timed=True),
    Column("quartiles", timed=True),
    Column("target"),
    Column("iapb's drift", timed=True),
    Column("MuJoCo's drift", timed=True),
)
RACE_NOTE = (
    "Frictionless (condim 1), with the same masses, forces and step; MuJoCo's other options have default values. The "
    "engine's steps are recorded, MuJoCo's are not. Ratios are computed for each round of timing; median and quartiles "
    "are given. Contacts are means over the timed steps. Moved: largest change of a coordinate while timed, m or rad."
)


def race_mujoco(
    scenes: Sequence[RestingScene] | None = None, rounds: int = ROUNDS, steps: int = STEPS,
    progress: Callable[[int, int], None] | None = None, failures: list[Failure] | None = None,
) -> Table:
    """Time a step of every scene against MuJoCo's, with every form and solver.

    Raises
    ------
    MissingDependencyError
        MuJoCo is not installed.
    """
    _mujoco()
    found: list[Row] = []
    chosen = resting_scenes() if scenes is None else tuple(scenes)
    for done, scene in enumerate(chosen, start=1):
        found += attempt(f"race on {scene.name}", partial(_race, scene, rounds, steps), failures) or []
        if progress is not None:
            progress(done, len(chosen))
    return table_of(RACE_COLUMNS, found, digits=3, note=RACE_NOTE)


def fastest_of_theirs(races: Table) -> list[Row]:
    """Return the row with MuJoCo's fastest solver for each scene and form."""
    by: dict[tuple[str, str], Row] = {}
    for race in sorted(races.records(), key=lambda race: float(race["MuJoCo's step"])):
        by.setdefault((race["scene"], race["MuJoCo's form"]), race)
    return list(by.values())


def _race(scene: RestingScene, rounds: int, steps: int) -> list[Row]:
    ours = OwnLoop(scene, steps)
    theirs = {(form, solver): _Theirs(scene, form, solver, steps) for form in scene.models for solver in SOLVERS}
    times = take_turns({"ours": ours.sample, **{key: other.sample for key, other in theirs.items()}}, rounds)
    found: list[Row] = []
    for (form, solver), other in theirs.items():
        ratio = times["ours"].over(times[form, solver])
        found.append({
            "scene": scene.name, "MuJoCo's form": form, "MuJoCo's solver": solver, "iapb's contacts": ours.contacts,
            "MuJoCo's contacts": other.contacts, "MuJoCo's step": 1e6 * times[form, solver].median,
            "ratio": ratio.median, "quartiles": f"{ratio.lower:.2g} to {ratio.upper:.2g}",
            "target": TARGETS.get(scene.name, SPATIAL_TARGET), "iapb's drift": ours.moved,
            "MuJoCo's drift": other.moved,
        })  # fmt: skip
    return found


class OwnLoop:
    """The scene in our loop; every sample starts again and settles before the timed steps."""

    def __init__(self, scene: RestingScene, steps: int) -> None:
        self.simulation = Simulation(scene_from_text(scene.text, scene.file))
        self.settling, self.steps = scene.settling, steps
        self.contacts = self.moved = 0.0

    def sample(self) -> float:
        """Return the time per step [s]."""
        self.settle()
        simulation, record = self.simulation, self.record(self.steps)
        before = simulation.state.q.copy()
        _, seconds = timed(lambda: simulation.advance_chunk(record, self.steps))
        self.contacts = float(record.steps.contact_count.mean())
        self.moved = float(np.abs(simulation.state.q - before).max())
        return seconds / self.steps

    def settle(self) -> None:
        """Start from the first state and simulate until the scene is at rest."""
        simulation, system = self.simulation, self.simulation.system
        simulation.state, simulation.port = system.make_state(), system.make_port(simulation.coupling)
        simulation.advance_chunk(self.record(self.settling), self.settling)

    def record(self, steps: int) -> Any:
        system, port = self.simulation.system, self.simulation.port
        sizes = (system.mechanism.nq, system.mechanism.nv, len(port.device_q), len(port.device_v))
        return make_record(steps, sizes, system.capacity, len(system.mechanism.tree_dofs))


class _Theirs:
    """The scene in MuJoCo's loop."""

    def __init__(self, scene: RestingScene, form: str, solver: str, steps: int) -> None:
        self.mujoco = _mujoco()
        self.model = scene.models[form](solver)
        self.push, self.pose = scene.push, scene.pose
        self.settling, self.steps = scene.settling, steps
        self.contacts = self.moved = 0.0

    def sample(self) -> float:
        """Return the time per step [s]."""
        data = self.mujoco.MjData(self.model)
        data.xfrc_applied[-1] = self.push
        if self.pose:
            data.qpos[:] = self.pose
        self.mujoco.mj_step(self.model, data, self.settling)
        before, touching = data.qpos.copy(), data.ncon
        _, seconds = timed(lambda: self.mujoco.mj_step(self.model, data, self.steps))
        self.contacts = 0.5 * (touching + data.ncon)
        self.moved = float(np.abs(data.qpos - before).max())
        return seconds / self.steps


def _mujoco() -> Any:
    try:
        import mujoco
    except ImportError as error:
        raise MissingDependencyError("mujoco", "The comparison with MuJoCo", "pip install 'iapb[peers]'") from error
    return mujoco


# in the order in which `repeat_part` numbers them
PARTS = ("hand and coupling", "bodies placed", "contacts found", "collisions", "forces and motion", "device", "record")


WHOLE = "whole step"
PART_COLUMNS = (Column("scene", condition=True), Column("part", condition=True), *TIME_COLUMNS)


def profile_step(scene: RestingScene, rounds: int = ROUNDS, steps: int = STEPS) -> list[Row]:
    """Return the times of the whole step and of each of its parts on a scene at rest, as rows of PART_COLUMNS."""
    loop = OwnLoop(scene, steps)

    def part(number: int) -> float:
        loop.settle()
        simulation, record = loop.simulation, loop.record(steps)
        arguments = simulation.world, simulation.state, simulation.port, record, number, steps
        return timed(lambda: repeat_part(*arguments))[1] / steps

    times = take_turns({WHOLE: loop.sample, **{name: partial(part, k) for k, name in enumerate(PARTS)}}, rounds)
    return [{"scene": scene.name, "part": name, **time_cells(taken)} for name, taken in times.items()]


@kernel
def repeat_part(world: Any, state: Any, port: Any, record: Any, part: Any, times: Any) -> None:
    """Repeat one part of the step `times` times; on a scene at rest all repetitions do the same work."""
    for k in range(times):
        if part == 0:
            couple(world, state, port)
        elif part == 1:
            clear(state)
            locate(world, state)
        elif part == 2:
            find_contacts(world, state)
        elif part == 3:
            resolve_collisions(world, state)
        elif part == 4:
            state.penalty_force[:] = 0.0
            state.friction_force[:] = 0.0
            move(world, state, port.applied)
        elif part == 5:
            drive_device(world, state, port)
        else:
            write_step(record, k, k, state, port)
