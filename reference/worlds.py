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

The paper's rigid worlds, ideal and CBuc, have no friction: they ignore the scene's, and a run says so.
Restitution that differs between bodies needs no world of its own: IAPB does as the scene says.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from iapb.contact.laws import ContactLaw, ImpulseAugmented, Penalty
from iapb.errors import ArgumentError, IapbError
from iapb.haptics.coupling import Coupling
from iapb.names import one_of
from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from iapb.simulation import INTERRUPTED, simulate
from iapb.system import coupling_of
from reference.one_thread import one_thread
from reference.time_stepping import RigidConstraints


class World(NamedTuple):
    """A named combination; the coupling's gains come from the scene."""

    name: str
    law: ContactLaw
    coupling: str

    def coupling_in(self, scene: Scene) -> Coupling:
        """The coupling with the scene's gains; none where the scene has no hand or gives no gains at all."""
        gains = scene.couplings
        without = scene.hand is None or (gains.four_channel is None and gains.unilateral is None)
        return coupling_of(scene, "none" if without else self.coupling)


# name -> (how IAPB meets the device's limits) -> world; to add one: a line here
WORLDS: dict[str, Callable[[str], World]] = {
    "ideal": lambda rendering: World("ideal", RigidConstraints(), "four-channel"),
    "IAPB": lambda rendering: World("IAPB", ImpulseAugmented(rendering=rendering), "four-channel"),
    "PB": lambda rendering: World("PB", Penalty(), "four-channel"),
    "CBuc": lambda rendering: World("CBuc", RigidConstraints(), "unilateral"),
    "ideal-friction": lambda rendering: World(
        "ideal-friction", RigidConstraints(friction="coulomb"), "four-channel"
    ),
    "IAPB-friction": lambda rendering: World(
        "IAPB-friction", ImpulseAugmented(rendering=rendering, friction_in_impacts=True), "four-channel"
    ),
    "IAPB-push": lambda rendering: World(
        "IAPB-push", ImpulseAugmented(rendering=rendering, pushing=True), "four-channel"
    ),
}


def find_world(name: str, rendering: str = "full") -> World:
    """Return the world of that name.

    Parameters
    ----------
    name : a key of `WORLDS`
    rendering : how IAPB meets the device's limits: full (ignores them), saturate, scale or spread

    Raises
    ------
    ArgumentError
        There is no such world, or its law has no impulses that a rendering could fit.
    """
    if name not in WORLDS:
        raise ArgumentError("world", name, one_of(name, WORLDS))
    world = WORLDS[name](rendering)
    if rendering != "full" and getattr(world.law, "rendering", "full") != rendering:
        raise ArgumentError("rendering", rendering, f"full: the law of the world {name} has no impulses to fit")
    return world


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
    label = name if rendering == "full" else f"{name} {rendering}"
    with one_thread():  # once for all steps of a rigid world
        run = simulate(scene, world.law, world.coupling_in(scene), world=label, progress=progress, **options)
    return run if partial else require_complete(run)


def require_complete(run: Run) -> Run:
    """Return the run, or raise what stopped it: half a run is no evidence."""
    if run.complete:
        return run
    if run.stopped == INTERRUPTED:
        raise KeyboardInterrupt
    raise IapbError(f"{run.scene_name} in the world {run.world} stopped after {run.time[-1]:g} s: {run.stopped}")
