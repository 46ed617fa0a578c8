"""Laws of the states of a run, whatever world or engine made it, and their test on random scenes.

Another engine gives configurations and velocities alone. Of the laws of a trajectory, those on
forces do not apply then, and these remain.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from iapb.engines import is_engine
from iapb.scene import Scene
from iapb.scene.reading import scene_from_values
from iapb.simulation import simulate
from iapb.worlds import find_world
from verification.laws.bounds import Found, Law, LawCount, law
from verification.laws.scenes import ROOM, Values, draw_scene, draw_spatial_scene
from verification.laws.trajectories import TRAJECTORY_LAWS, Trajectory, judge_run, norm
from verification.scenes.books import risen, work_given

STATE_LAWS: dict[str, Law] = {}
# What an integration over the drawn steps may make, and by how much a step's mean velocity may
# leave those at its ends.
CLOSE = 0.02
PASSED = 0.1 * ROOM  # [m] an overlap that no stiff contact has
INSTANTS = 100
KEPT = ("restitution", "friction")  # fields of contact that any engine can have


@law(STATE_LAWS, "velocity", "each step moves the bodies by a velocity between those at its ends")
def velocities_move_the_bodies(trajectory: Trajectory) -> Found:
    """Largest |Δq/Δt − (v + v')/2| − |v' − v|/2 of a step, relative to the largest speed of the
    run."""
    run = trajectory.run
    if trajectory.turns_over:
        return None
    before = run.v[:-1]
    after = run.v[1:]
    apart = norm(trajectory.displacements / run.dt - 0.5 * (before + after)) - 0.5 * norm(
        after - before
    )
    return float(np.max(apart)) / max(float(np.max(np.abs(run.v))), CLOSE), CLOSE


@law(STATE_LAWS, "energy", "energy never rises above the start and the work of the hand")
def energy_is_not_made(trajectory: Trajectory) -> Found:
    """Largest rise, relative to the largest kinetic energy, the change of potential energy and the
    hand's work."""
    run = trajectory.run
    if run.coupling == "unilateral" or "potential" not in run.energy:
        return None
    kinetic = run.energy["kinetic"]
    potential = run.energy["potential"]
    size = float(np.max(kinetic) + np.ptp(potential) + np.max(np.abs(work_given(run))))
    return (float(np.max(risen(run)[1:])) / size, CLOSE) if size > 0.0 else None


@law(STATE_LAWS, "overlap", "no body passes into another or into a wall")
def bodies_stay_apart(trajectory: Trajectory) -> Found:
    """Largest overlap [m] beyond that of the start, at some instants."""
    run = trajectory.run
    gaps = [
        float(np.min(trajectory.system.contacts_at(run.q[k]).gap, initial=0.0))
        for k in np.unique(np.linspace(0, run.steps, INSTANTS).astype(int))
    ]
    return gaps[0] - min(gaps), PASSED


def any_scene(values: Values) -> Scene:
    """Return a drawn scene with restitution and friction alone, and a hand that holds the tool
    itself."""
    dropped = ("device", "couplings", "integrator")
    kept = {name: value for name, value in values.items() if name not in dropped}
    contact = {name: value for name, value in values["contact"].items() if name in KEPT}
    return scene_from_values(kept | {"contact": contact})


def judge_world(
    world: str, scenes: int = 100, seed: int = 0, progress: Callable[[int, int], None] | None = None
) -> tuple[list[LawCount], int]:
    """Put a world to the laws on random scenes, one in two in space.

    Parameters
    ----------
    world : as `iapb.worlds.find_world` takes it
    scenes : number of scenes
    seed : seed of the draws
    progress : called as progress(scenes done, all scenes)

    Returns
    -------
    counts : of each law that applied
    left_out : number of scenes of which the engine ignores something
    """
    law_or_engine: Any = find_world(world).law
    counts: dict[str, LawCount] = {}
    left_out = 0
    for index in range(scenes):
        draw = draw_spatial_scene if index % 2 else draw_scene
        scene = any_scene(draw(np.random.default_rng([seed, index])).values)
        if is_engine(law_or_engine) and law_or_engine.ignored(scene):
            left_out += 1
            continue
        run = simulate(scene, world=world)
        for name, residual in judge_run(run, TRAJECTORY_LAWS | STATE_LAWS):
            counts.setdefault(name, LawCount(name)).add(residual)
        if progress is not None:
            progress(index + 1, scenes)
    return list(counts.values()), left_out
