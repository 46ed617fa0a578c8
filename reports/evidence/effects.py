"""Stage: which effects the peg scene calls for, why, and what they cost."""

from __future__ import annotations

from collections.abc import Callable

from reports.evidence.runs import shipped_scene
from reports.pages.records import SceneEffect

SCENES = ("peg_corner", "arm_pushing")


def compute(progress: Callable[[int, int], None]) -> dict[str, tuple[SceneEffect, ...]]:
    """The effects of each scene in the IAPB world, with the measured cost of those that can be left out."""
    from iapb import decide_effects
    from reference.worlds import find_world
    from verification.accuracy_time.effect_cost import effect_costs

    found = {}
    for done, name in enumerate(SCENES):
        progress(done, len(SCENES))
        scene = shipped_scene(name)
        world = find_world("IAPB")
        costs = effect_costs(scene)
        effects = decide_effects(scene, world.law.name, world.coupling_in(scene).name, "full")
        found[name] = tuple(
            SceneEffect(effect.name, effect.active, effect.reason, costs.get(effect.name, ""), effect.left_out)
            for effect in effects
        )
    progress(len(SCENES), len(SCENES))
    return found
