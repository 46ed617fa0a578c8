"""The paper's four worlds (section VI) and its future extensions. A world is a named pair of
contact law and coupling.

| world | contact law | coupling |
|---|---|---|
| ideal | rigid constraints | four-channel |
| IAPB | impulses and penalties | four-channel |
| PB | penalties | four-channel |
| CBuc | rigid constraints | unilateral coupler |
| ideal-friction | rigid constraints with Coulomb's law of friction, by complementarity | four-channel |
| IAPB-friction | impulses with Coulomb friction, and penalties | four-channel |
| IAPB-push | impulses that only push (two LCPs), and penalties | four-channel |
| mujoco | MuJoCo's own contacts (`reference.mujoco`) | none |

The worlds of the engine are in `iapb.worlds`; this module adds the rigid ones. The paper's rigid
worlds, ideal and CBuc, have no friction: they ignore the friction of the scene, and the run records
this. Restitution that differs between bodies needs no separate world: IAPB uses the values of the
scene.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from iapb.simulation import require_complete, simulate
from iapb.worlds import WORLDS, World, find_world
from reference.mujoco import MuJoCo
from reference.one_thread import one_thread
from reference.time_stepping import RigidConstraints

# to add a world, add a line here
WORLDS |= {
    "ideal": lambda rendering: World("ideal", RigidConstraints(), "four-channel"),
    "CBuc": lambda rendering: World("CBuc", RigidConstraints(), "unilateral"),
    "ideal-friction": lambda rendering: World(
        "ideal-friction", RigidConstraints(friction="coulomb"), "four-channel"
    ),
    "mujoco": lambda rendering: World("mujoco", MuJoCo(), "none"),
}


@one_thread()  # entered once for all steps of a rigid world
def run_world(
    scene: Scene | str | Path,
    name: str,
    rendering: str = "full",
    progress: Callable[[int, int], None] | None = None,
    *,
    partial: bool = False,
    **options: Any,
) -> Run:
    """Simulate a scene in a world and return its Run.

    Parameters
    ----------
    scene : a checked scene, the path of a scene file, or the name of a scene that comes with the
        project
    name, rendering : as `find_world` takes them
    progress : called as progress(steps done, total steps) after every chunk
    partial : whether to return a run that stopped early; if False, an exception is raised instead
    options : as `iapb.simulate` takes them

    Raises
    ------
    ArgumentError
        There is no such world, or the scene has no gains for its coupling.
    IapbError
        The run stopped early, and `partial` is False.
    """
    if not isinstance(scene, Scene):
        scene = load_scene(find_scene(scene))
    world = find_world(name, rendering)
    label = name if rendering == "full" else f"{name} {rendering}"
    run = simulate(
        scene, world.law, world.coupling_in(scene), world=label, progress=progress, **options
    )
    return run if partial else require_complete(run)
