"""Stage: which effects a scene calls for, why, what they cost, and what changes without them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from reports.evidence.runs import shipped_scene
from reports.pages.records import SceneEffect
from verification.finding import Failure, Table, attempt, titled

SCENES = ("peg_corner", "arm_pushing", "arm_obstacles")
INPUT = "effect_costs"


def compute(
    progress: Callable[[int, int], None], failures: list[Failure]
) -> dict[str, tuple[SceneEffect, ...]]:
    """The effects of each scene in the IAPB world; those that can be left out are measured."""
    found = {}
    for done, name in enumerate(SCENES):
        progress(done, len(SCENES))
        found[name] = attempt(name, partial(_effects_of, name, failures), failures)
    progress(len(SCENES), len(SCENES))
    return {name: effects for name, effects in found.items() if effects is not None}


def _effects_of(name: str, failures: list[Failure]) -> tuple[SceneEffect, ...]:
    return effects_of(shipped_scene(name), failures=failures)


def effects_of(
    scene: Any, world: str = "IAPB", progress: Callable[[int, int], None] | None = None,
    failures: list[Failure] | None = None,
) -> tuple[SceneEffect, ...]:
    """Every effect of a scene in a world of the compiled engine, measured where it is on and can be left out."""
    from iapb import decide_effects
    from reference.worlds import find_world
    from verification.cost.effect_cost import in_words, measure_effects

    chosen = find_world(world)
    measured = {one.effect: one for one in measure_effects(scene, world, progress=progress, failures=failures)}
    effects = []
    for effect in decide_effects(scene, chosen.law, chosen.coupling_in(scene)):
        one = measured.get(effect.name)
        cost, change = in_words(one) if one is not None else ("", "")
        effects.append(SceneEffect(
            effect.name, effect.active, effect.reason, cost, effect.left_out, change,
            _known(one.saved) if one else None, _known(one.position) if one else None,
        ))  # fmt: skip
    return tuple(effects)


def summary(effects: Mapping[str, Sequence[SceneEffect]]) -> Table:
    """The table behind the figure: a row per scene and measured effect."""
    rows = tuple((scene, one.name, 100.0 * one.saved, 1e3 * one.position, _best(one, found))
                 for scene, found in effects.items() for one in found
                 if one.saved is not None and one.position is not None)  # fmt: skip
    return titled(("scene", "effect", "time saved [%]", "error [mm]", "best of its error"), rows, 3,
                   "Best of its error: no other effect saves more time at the cost of no larger error.",
                   timed=("time saved [%]", "best of its error"))


def _best(one: SceneEffect, others: Sequence[SceneEffect]) -> str:
    """Whether an effect is on the Pareto front of time saved and error made."""
    rivals = [(other.saved, other.position) for other in others if other is not one]
    beaten = any(saved is not None and position is not None and one.saved is not None and one.position is not None
                 and saved >= one.saved and position <= one.position and (saved, position) != (one.saved, one.position)
                 for saved, position in rivals)  # fmt: skip
    return "no" if beaten else "yes"


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
