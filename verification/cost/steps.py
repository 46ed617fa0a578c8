"""Time of a step against MuJoCo, and over the number of bodies.

Our loop is `Simulation.advance_chunk`, as in `simulate`, and records every step. MuJoCo's loop is
`mj_step(model, data, nstep)`, which records nothing. Both run the same number of steps in turns;
each round gives one ratio. All solvers of MuJoCo are timed, and the fastest one counts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np

from iapb.contact.kernels.broadphase import near_pairs
from iapb.loop import make_record
from iapb.recording import Recorder
from iapb.scene import Scene, load_scene
from iapb.scene.mechanism import start_of
from iapb.simulation import Simulation
from reference.mujoco import MuJoCo, joint_places, set_state
from verification.check import Check, Study
from verification.clock import take_turns, timed
from verification.cost.growth import power_law
from verification.cost.resting import FOLDER, RESTING, RestingScene
from verification.finding import Part
from verification.table import Columns, Row, Table

IDEAL = "ideal (QP per step)"  # in tables of times


class RecordedLoop:
    """The loop of `simulate`, with its record; it starts again from the first state for every
    sample of `steps` steps.

    recording : the Recorder of the last sample
    """

    def __init__(self, simulation: Any, steps: int) -> None:
        self.simulation = simulation
        self.steps = steps
        self.recording: Recorder

    def sample(self) -> float:
        """Return the time per step of one whole run [s]; raise the error that stops the run before
        its end."""
        self.simulation.rewind()
        self.recording = Recorder(self.simulation)
        total = 0.0
        while self.recording.steps < self.steps:
            stop, spent = timed(partial(self.recording.chunk, self.steps))
            total += spent
            if stop is not None:
                raise stop
        return total / self.steps


def _record(simulation: Any, steps: int) -> Any:
    system = simulation.system
    coordinates = Recorder(simulation).coordinates
    return make_record(steps, coordinates, system.capacity, len(system.mechanism.tree_dofs))


# Against MuJoCo

# steps of one sample, as in a chunk of `simulate`; samples of each loop
STEPS = 512
ROUNDS = {"quick": 9, "full": 20}
SOLVERS = ("Newton", "CG", "PGS")
TARGETS = {"peg in the corner": 0.1}
SPATIAL_TARGET = 0.5


def race(study: Study, name: str, steps: int = STEPS) -> Iterator[Row]:
    """Yield the times of a step of one scene against MuJoCo's, with every solver."""
    ours = OwnLoop(RESTING[name], steps)
    theirs = {solver: TheirLoop(RESTING[name], solver, steps) for solver in SOLVERS}
    times = take_turns(
        {"ours": ours.sample, **{key: other.sample for key, other in theirs.items()}},
        ROUNDS[study.depth],
    )
    for solver, other in theirs.items():
        ratio = times["ours"].over(times[solver])
        yield {
            "scene": name,
            "MuJoCo's solver": solver,
            "iapb's contacts": ours.contacts,
            "MuJoCo's contacts": other.contacts,
            "MuJoCo's step [µs]": 1e6 * times[solver].median,
            "ratio": ratio.median,
            "lower quartile": ratio.lower,
            "upper quartile": ratio.upper,
            "target": TARGETS.get(name, SPATIAL_TARGET),
            "iapb's drift": ours.moved,
            "MuJoCo's drift": other.moved,
        }


def hardest(races: Table) -> list[Row]:
    """Return per scene the row of MuJoCo's fastest solver."""
    fastest: dict[str, Row] = {}
    for row in sorted(
        races.records() if races.rows else (), key=lambda row: float(row["MuJoCo's step"])
    ):
        fastest.setdefault(row["scene"], row)
    return list(fastest.values())


class OwnLoop:
    """The scene in our loop; every sample starts again and settles before the timed steps."""

    def __init__(self, scene: RestingScene, steps: int) -> None:
        self.simulation = Simulation(scene.scene())
        self.settling = scene.settling
        self.steps = steps
        self.contacts = self.moved = 0.0

    def sample(self) -> float:
        """Return the time per step [s]."""
        simulation = self.simulation
        record = self._settled()
        before = simulation.state.q.copy()
        _, spent = timed(lambda: simulation.advance_chunk(record, self.steps))
        self.contacts = float(record.steps.contact_count.mean())
        self.moved = float(np.abs(simulation.state.q - before).max())
        return spent / self.steps

    def _settled(self) -> Any:
        """Start from the first state, simulate until the scene is at rest, and return an empty
        record."""
        simulation = self.simulation
        simulation.rewind()
        simulation.advance_chunk(_record(simulation, self.settling), self.settling)
        return _record(simulation, self.steps)


class TheirLoop:
    """The scene in MuJoCo's loop, under the generalized force that the hand has at the start."""

    def __init__(self, resting: RestingScene, solver: str, steps: int) -> None:
        import mujoco

        self.resting = resting
        self.scene = resting.scene()
        self.steps = steps
        self.engine = MuJoCo()
        self.model = self.engine.model(self.scene)
        self.model.opt.solver = getattr(mujoco.mjtSolver, f"mjSOL_{solver.upper()}")
        self.contacts = self.moved = 0.0

    def sample(self) -> float:
        """Return the time per step [s]."""
        import mujoco

        data = mujoco.MjData(self.model)
        set_state(joint_places(self.scene, self.model), data, *start_of(self.scene))
        self.engine.step(self.scene, self.model, data, 0.0)
        mujoco.mj_step(self.model, data, self.resting.settling)
        before = data.qpos.copy()
        touching = data.ncon
        _, spent = timed(lambda: mujoco.mj_step(self.model, data, self.steps))
        self.contacts = 0.5 * (touching + data.ncon)
        self.moved = float(np.abs(data.qpos - before).max())
        return spent / self.steps


RACES = Check(
    key="steps against MuJoCo",
    question="How long is a step, compared with MuJoCo's?",
    row=race,
    cases=lambda _: RESTING if find_spec("mujoco") else (),
    columns=Columns(
        timed=(
            "MuJoCo's step",
            "ratio",
            "lower quartile",
            "upper quartile",
            "iapb's drift",
            "MuJoCo's drift",
        )
    ),
)


# Many bodies

COUNTS = (1, 2, 5, 10, 20, 50, 100, 200)
LEAST_BODIES = 20  # with fewer, overhead hides the growth
PITCH = 0.046  # [m]: discs on a square grid with 6 mm between them
# short chunks, so that each chunk has an undisturbed repeat
CHUNKS = 50
CHUNK_STEPS = 10
REPEATS = 3
LARGEST_POWER = 1.2  # target


def field_of_discs(n: int) -> Scene:
    """Return a scene of n discs with random velocities over a wall."""
    scene = load_scene(FOLDER / "field_of_discs.yaml")
    (disc,) = scene.resolved()["bodies"]
    rng = np.random.default_rng(0)
    columns = math.ceil(math.sqrt(n))
    bodies = [
        disc
        | {
            "name": f"disc_{k}",
            "position": [PITCH * (k % columns), PITCH * (k // columns), 0.0],
            "velocity": [*(0.3 * rng.normal(size=2)).tolist(), 0.0],
        }
        for k in range(n)
    ]
    return scene.with_values({"bodies": bodies})


def step_of_bodies(study: Study, n: int) -> Row:
    """Time the same steps several times; each chunk counts with its least time, as other processes
    only add time."""
    simulation = Simulation(field_of_discs(n))
    simulation.rewind()
    quickest = [math.inf] * CHUNKS
    for _ in range(REPEATS):
        simulation.rewind()
        contacts = 0.0
        tested = 0.0
        for k in range(CHUNKS):
            record = _record(simulation, CHUNK_STEPS)
            _, spent = timed(partial(simulation.advance_chunk, record, CHUNK_STEPS))
            quickest[k] = min(quickest[k], spent)
            contacts += float(record.steps.contact_count.mean()) / CHUNKS
            tested += _tested(simulation) / CHUNKS
    return {
        "bodies": n,
        "step [µs]": 1e6 * sum(quickest) / (CHUNKS * CHUNK_STEPS),
        "contacts": contacts,
        "pairs of shapes": len(simulation.world.pairs),
        "pairs tested": tested,
    }


def _tested(simulation: Simulation) -> int:
    """Return the number of pairs that the narrow phase tests at the current positions of the
    bodies."""
    world = simulation.world
    body = simulation.state.body
    if not world.broad_phase.used:
        return len(world.pairs)
    return int(near_pairs(world.broad_phase, body, 0.0))


def body_targets(table: Table) -> Iterator[Part]:
    """Yield the powers with which the time of a step and the number of tested pairs grow."""
    rows = [row for row in table.records() if row["bodies"] >= LEAST_BODIES]
    bodies, times, pairs = (
        [row[key] for row in rows] for key in ("bodies", "step", "pairs tested")
    )
    time = power_law(bodies, times)
    yield Part.on("power of the time of a step over bodies", time, LARGEST_POWER, timed=True)
    yield Part.on("power of the tested pairs over bodies", power_law(bodies, pairs), LARGEST_POWER)


BODIES = Check(
    key="bodies",
    question="How does the time of a step grow with the number of free bodies?",
    cases=lambda _: COUNTS,
    row=step_of_bodies,
    targets=body_targets,
    columns=Columns(timed=("step",)),
)
