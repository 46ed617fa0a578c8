"""One recorded step of ours against MuJoCo's, each in its own compiled loop, on scenes in resting contact.

Ours is `Simulation.advance_chunk`, as `simulate` runs it, record included; MuJoCo's is `mj_step(model, data, nstep)`,
which records nothing. Both are called for the same number of steps in turn, by the thread's own clock; each round
gives one ratio. Every solver of MuJoCo is tried, and the fastest one of a form is what counts.
Where the time of our step goes: every part of it by itself, in turn.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from iapb.errors import MissingDependencyError
from iapb.recording import make_record
from iapb.scene import scene_from_text
from iapb.simulation import Simulation
from verification.cost.kernels import quartiles
from verification.cost.loops import PARTS, repeat_part
from verification.cost.measure import Quartiles
from verification.cost.resting_scenes import RestingScene, resting_scenes
from verification.finding import Failure, attempt

STEPS, ROUNDS = 512, 15  # steps of one sample, as many as a chunk of `simulate`; samples of each
SOLVERS = ("Newton", "CG", "PGS")
TARGETS = {"peg in the corner": 0.1}
SPATIAL_TARGET = 0.5


@dataclass(frozen=True)
class StepRace:
    """One scene: a step of ours against MuJoCo's with one form of the scene and one solver.

    contacts, their_contacts : mean over the steps that were timed
    ratio : ours by theirs, round by round
    moved, they_moved : largest change of a coordinate while timed [m, rad]: near zero where the scene rests
    """

    scene: str
    form: str
    solver: str
    contacts: float
    their_contacts: float
    ours: Quartiles
    theirs: Quartiles
    ratio: Quartiles
    moved: float
    they_moved: float

    @property
    def target(self) -> float:
        """Largest ratio asked for."""
        return TARGETS.get(self.scene, SPATIAL_TARGET)


def race_mujoco(
    scenes: Sequence[RestingScene] | None = None, rounds: int = ROUNDS, steps: int = STEPS,
    progress: Callable[[int, int], None] | None = None, failures: list[Failure] | None = None,
) -> tuple[StepRace, ...]:
    """Time every scene, form and solver.

    Raises
    ------
    MissingDependencyError
        MuJoCo is not installed.
    """
    _mujoco()
    found: list[StepRace] = []
    chosen = resting_scenes() if scenes is None else tuple(scenes)
    for done, scene in enumerate(chosen, start=1):
        found += attempt(f"race on {scene.name}", partial(_race, scene, rounds, steps), failures) or []
        if progress is not None:
            progress(done, len(chosen))
    return tuple(found)


def fastest_of_theirs(races: Sequence[StepRace]) -> tuple[StepRace, ...]:
    """Of each scene and form, the race against MuJoCo's fastest solver."""
    by: dict[tuple[str, str], StepRace] = {}
    for race in races:
        key = race.scene, race.form
        if key not in by or race.theirs.median < by[key].theirs.median:
            by[key] = race
    return tuple(by.values())


def _race(scene: RestingScene, rounds: int, steps: int) -> list[StepRace]:
    ours = OwnLoop(scene, steps)
    theirs = {(form, solver): _Theirs(scene, form, solver, steps) for form in scene.models for solver in SOLVERS}
    runners: list[OwnLoop | _Theirs] = [ours, *theirs.values()]
    for runner in runners:  # warm
        runner.sample()
    for turn in range(rounds):
        first = turn % len(runners)
        for runner in runners[first:] + runners[:first]:
            runner.times.append(runner.sample() / steps)
    return [
        StepRace(
            scene.name, form, solver, ours.contacts, other.contacts, quartiles(ours.times), quartiles(other.times),
            quartiles([a / b for a, b in zip(ours.times, other.times, strict=True)]), ours.moved, other.moved,
        ) for (form, solver), other in theirs.items()
    ]  # fmt: skip


class OwnLoop:
    """The scene in our loop, made anew for each sample and settled before the clock runs."""

    def __init__(self, scene: RestingScene, steps: int) -> None:
        self.simulation = Simulation(scene_from_text(scene.text, scene.file))
        self.settling, self.steps, self.times = scene.settling, steps, list[float]()
        self.contacts = self.moved = 0.0

    def sample(self) -> float:
        """Seconds of `steps` steps."""
        simulation, system = self.simulation, self.simulation.system
        simulation.state, simulation.port = system.make_state(), system.make_port(simulation.coupling)
        simulation.advance_chunk(self.record(self.settling), self.settling)
        record, before = self.record(self.steps), simulation.state.q.copy()
        started = time.thread_time()
        simulation.advance_chunk(record, self.steps)
        seconds = time.thread_time() - started
        self.contacts = float(record.contact_count.mean())
        self.moved = float(np.abs(simulation.state.q - before).max())
        return seconds

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
        self.settling, self.steps, self.times = scene.settling, steps, list[float]()
        self.contacts = self.moved = 0.0

    def sample(self) -> float:
        """Seconds of `steps` steps."""
        data = self.mujoco.MjData(self.model)
        data.xfrc_applied[-1] = self.push
        if self.pose:
            data.qpos[:] = self.pose
        self.mujoco.mj_step(self.model, data, self.settling)
        before, touching = data.qpos.copy(), data.ncon
        started = time.thread_time()
        self.mujoco.mj_step(self.model, data, self.steps)
        seconds = time.thread_time() - started
        self.contacts = 0.5 * (touching + data.ncon)
        self.moved = float(np.abs(data.qpos - before).max())
        return seconds


def _mujoco() -> Any:
    try:
        import mujoco
    except ImportError as error:
        raise MissingDependencyError("mujoco", "The comparison with MuJoCo", "pip install 'iapb[peers]'") from error
    return mujoco


@dataclass(frozen=True)
class PartTime:
    """Time of one part of a step [s]; part "whole step" is the loop itself."""

    scene: str
    part: str
    seconds: Quartiles


def profile_step(scene: RestingScene, rounds: int = ROUNDS, steps: int = STEPS) -> tuple[PartTime, ...]:
    """Time of each part, and of the whole step, on a scene at rest."""
    loop = OwnLoop(scene, steps)
    times: dict[str, list[float]] = {"whole step": [], **{part: [] for part in PARTS}}
    for turn in range(rounds + 1):
        seconds = loop.sample()
        found = {"whole step": seconds / steps}
        simulation = loop.simulation
        for number, part in enumerate(PARTS):
            record = loop.record(steps)
            started = time.thread_time()
            repeat_part(simulation.world, simulation.state, simulation.port, record, number, steps)
            found[part] = (time.thread_time() - started) / steps
        if turn:
            for part, value in found.items():
                times[part].append(value)
    return tuple(PartTime(scene.name, part, quartiles(samples)) for part, samples in times.items())
