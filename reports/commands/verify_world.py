"""`iapb verify-world`: the laws of trajectories on random scenes, in any world."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import typer

from reports.commands.verify_many import line_of
from reports.show import Answer, Json, stage_progress
from verification.laws.worlds import judge_world

SCENES = 100  # random scenes


def verify_world(
    world: Annotated[str, typer.Argument(help="mujoco, or your engine as module:engine.")],
    seed: Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Seed of the scenes.")] = 0,
    json_: Json = False,
) -> Answer:
    """Put a world to the laws of trajectories on random scenes."""
    with stage_progress() as progress:
        counts, left_out = judge_world(world, SCENES, seed, partial(progress, "random scenes"))
    judged = SCENES - left_out
    ignoring = f"; {left_out} others have something that it ignores" if left_out else ""
    lines = [f"{world} on {judged} random scenes{ignoring}."]
    lines += [line_of(count) for count in counts]
    passed = judged > 0 and not any(count.failures for count in counts)
    facts = {
        "world": world,
        "scenes": judged,
        "left_out": left_out,
        "passed": passed,
        "laws": counts,
    }
    return Answer(facts, lines, int(not passed))
