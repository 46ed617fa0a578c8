"""The paper's four worlds (section VI), and what it leaves to the future: a contact law and a coupling by name.

| world | contact law | coupling |
|---|---|---|
| ideal | rigid constraints | four-channel |
| IAPB | impulses and penalties | four-channel |
| PB | penalties | four-channel |
| CBuc | rigid constraints | unilateral coupler |
| ideal-friction | rigid constraints with Coulomb's law of friction, by complementarity | four-channel |
| IAPB-friction | impulses with Coulomb friction, and penalties | four-channel |
| IAPB-push | impulses that only push (two LCPs), and penalties | four-channel |

The engine's are in `iapb.worlds`; this module adds the rigid ones. The paper's rigid worlds, ideal and CBuc, have no
friction: they ignore the scene's, and a run says so. Restitution that differs between bodies needs no world of its own:
IAPB does as the scene says.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from iapb.errors import IapbError
from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from iapb.simulation import INTERRUPTED, simulate
from iapb.worlds import WORLDS, World, find_world
from reference.one_thread import one_thread
from reference.time_stepping import RigidConstraints

# to add a world: a line here
WORLDS |= {
    "ideal": lambda rendering: World("ideal", RigidConstraints(), "four-channel"),
    "CBuc": lambda rendering: World("CBuc", RigidConstraints(), "unilateral"),
    "ideal-friction": lambda rendering: World(
        "ideal-friction", RigidConstraints(friction="coulomb"), "four-channel"
    ),
}


def run_world(
    scene: Scene | str | Path,
    name: str,
    rendering: str = "full",
    progress: Callable[[int, int], None] | None = None,
    *,
    partial: bool = False,
    **options: Any,
) -> Run:
    """Simulate a scene in a world.

    Parameters
    ----------
    scene : a checked scene, the path of a scene file, or the name of a scene that comes with the project
    name, rendering : as `find_world` takes them
    progress : called with (steps done, steps) now and then
    partial : True: an incomplete run (interrupted, or out of range) is returned; False: it is raised
    options : as `iapb.simulate` takes them

    Returns
    -------
    Run

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
    with one_thread():  # once for all steps of a rigid world
        run = simulate(scene, world.law, world.coupling_in(scene), world=label_of(name, rendering), progress=progress,
                       **options)  # fmt: skip
    return run if partial else require_complete(run)


def label_of(name: str, rendering: str) -> str:
    """Return what a run in a world says of its world."""
    return name if rendering == "full" else f"{name} {rendering}"


def require_complete(run: Run) -> Run:
    """Return the run, or raise what stopped it: half a run is no evidence."""
    if run.complete:
        return run
    if run.stopped == INTERRUPTED:
        raise KeyboardInterrupt
    raise IapbError(f"{run.scene_name} in the world {run.world} stopped after {run.time[-1]:g} s: {run.stopped}")
