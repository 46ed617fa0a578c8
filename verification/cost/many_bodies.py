"""Time of a step against the number of free bodies; with the broad phase it is linear.

The time depends on the machine. The number of pairs that the broad phase leaves for the narrow phase does not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from iapb.contact.kernels.broadphase import near_pairs
from iapb.recording import make_record
from iapb.scene import scene_from_text
from iapb.simulation import Simulation
from verification.clock import timed
from verification.finding import Column, Failure, Table, of_each, table_of

COUNTS = (1, 2, 5, 10, 20, 50, 100, 200)
LEAST_BODIES = 20  # with fewer, overhead hides the growth
RADIUS, PITCH = 0.02, 0.046  # [m]: discs on a square grid with 6 mm between them
CHUNKS, CHUNK_STEPS, REPEATS = 50, 10, 3  # short chunks, so that each chunk has an undisturbed repeat


# contacts : mean number per step; pairs of shapes : pairs that may touch; pairs tested : mean number that the broad
# phase leaves
COLUMNS = (
    Column("bodies", condition=True), Column("step", "µs", timed=True), Column("contacts"), Column("pairs of shapes"),
    Column("pairs tested"),
)


def field_of_discs(n: int) -> str:
    """Return the YAML text of a scene of n discs with random velocities over a wall."""
    rng, columns = np.random.default_rng(0), math.ceil(math.sqrt(n))
    bodies = [
        f"  - {{name: disc_{k}, joint: planar, mass: 0.1, inertia: 2e-5, "
        f"shapes: [{{kind: circle, radius: {RADIUS}}}], "
        f"position: [{PITCH * (k % columns):.6f}, {PITCH * (k // columns):.6f}, 0], "
        f"velocity: [{0.3 * rng.normal():.6f}, {0.3 * rng.normal():.6f}, 0]}}"
        for k in range(n)
    ]
    return "\n".join([
        "name: field_of_discs", "rate: 1000", "duration: 1", "bodies:", *bodies, "walls:",
        "  - {name: wall, kind: half_plane, point: [0, -0.03], normal: [0, 1]}",
        "contact: {forces: paper, stiffness: 500, damping: 1, restitution: 0.5, coherence_distance: 1e-3}", "",
    ])  # fmt: skip


def study_many_bodies(counts: Sequence[int] = COUNTS, failures: list[Failure] | None = None) -> Table:
    """Return the time of a step for each number of bodies."""
    rows = of_each(counts, lambda n: [_cost(n)], failures, lambda n: f"{n} bodies")
    return table_of(COLUMNS, rows, digits=3)


def _cost(n: int) -> dict[str, Any]:
    """Time the same steps several times; each chunk counts with its least time, as other processes only add time."""
    simulation = Simulation(scene_from_text(field_of_discs(n)))
    sizes = (simulation.system.mechanism.nq, simulation.system.mechanism.nv, 0, 0)
    simulation.advance_chunk(make_record(1, sizes, simulation.system.capacity, n), 1)  # compiles
    quickest = [math.inf] * CHUNKS
    for _ in range(REPEATS):
        simulation.state = simulation.system.make_state()
        contacts, tested = 0.0, 0.0
        for k in range(CHUNKS):
            record = make_record(CHUNK_STEPS, sizes, simulation.system.capacity, n)
            _, spent = timed(partial(simulation.advance_chunk, record, CHUNK_STEPS))
            quickest[k] = min(quickest[k], spent)
            contacts += float(record.steps.contact_count.mean()) / CHUNKS
            tested += _tested(simulation) / CHUNKS
    seconds = sum(quickest) / (CHUNKS * CHUNK_STEPS)
    return {"bodies": n, "step": seconds * 1e6, "contacts": contacts, "pairs of shapes": len(simulation.world.pairs),
            "pairs tested": tested}  # fmt: skip


def _tested(simulation: Simulation) -> int:
    """Return the number of pairs that the narrow phase tests at the current positions of the bodies."""
    world, body = simulation.world, simulation.state.body
    if not world.switches.broad_phase:
        return len(world.pairs)
    return int(near_pairs(world.broad_phase, body.rotation, body.position, 0.0))
