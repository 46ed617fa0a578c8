"""Where the time of a resting step goes: every part of it by itself, in turn, by the thread's own clock."""

from __future__ import annotations

import time
from dataclasses import dataclass

from verification.cost.against_mujoco import STEPS, OwnLoop
from verification.cost.kernels import quartiles
from verification.cost.measure import Quartiles
from verification.cost.resting_scenes import RestingScene

ROUNDS = 15


@dataclass(frozen=True)
class PartTime:
    """Time of one part of a step [s]; part "whole step" is the loop itself."""

    scene: str
    part: str
    seconds: Quartiles


def profile_step(scene: RestingScene, rounds: int = ROUNDS, steps: int = STEPS) -> tuple[PartTime, ...]:
    """Time of each part, and of the whole step, on a scene at rest."""
    from verification.cost.step_parts import PARTS, repeat_part

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
