"""Worlds by name. A world is a contact law with a coupling, or another engine.

`reference.worlds` adds the worlds of rigid contact, and MuJoCo.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.engines import Engine, is_engine
from iapb.errors import ArgumentError
from iapb.haptics.coupling import Coupling
from iapb.lazy import load_extensions
from iapb.names import object_named, one_of
from iapb.scene import Scene
from iapb.system import coupling_of


class World(NamedTuple):
    """A named pair of contact law and coupling; the gains of the coupling come from the scene.

    An engine stands in place of the law, and has no coupling.
    """

    name: str
    law: Any  # a ContactLaw, or an Engine
    coupling: str

    def coupling_in(self, scene: Scene) -> Coupling:
        """Return the coupling with the scene's gains, or no coupling if the scene has no hand or no
        gains."""
        return coupling_of(scene, self.coupling if scene.is_coupled else "none")


def _augmented(name: str, **settings: Any) -> Callable[[str], World]:
    return lambda rendering: World(
        name, ImpulseAugmented(rendering=rendering, **settings), "four-channel"
    )


# name -> function of the rendering (how IAPB respects the device's limits) that returns the world
WORLDS: dict[str, Callable[[str], World]] = {
    "IAPB": _augmented("IAPB"),
    "PB": lambda rendering: World("PB", Penalty(), "four-channel"),
    "IAPB-friction": _augmented("IAPB-friction", friction_in_impacts=True),
    "IAPB-push": _augmented("IAPB-push", pushing=True),
}


def find_world(name: str, rendering: str = "full") -> World:
    """Return the world of that name.

    Parameters
    ----------
    name : a key of `WORLDS`, or an engine of one's own as ``package.module:engine``
    rendering : how IAPB respects the device's limits: full (ignores them), saturate, scale or
        spread

    Raises
    ------
    ArgumentError
        There is no such world, or its law has no impulses to which a rendering applies.
    """
    if name not in WORLDS and ":" not in name:
        load_extensions("iapb.worlds", purpose=f"The world {name}")
        if name not in WORLDS:
            raise ArgumentError(
                "world", name, f"{one_of(name, WORLDS)}, or your engine as module:engine"
            )
    world = WORLDS[name](rendering) if name in WORLDS else World(name, _engine_named(name), "none")
    if rendering != "full" and getattr(world.law, "rendering", "full") != rendering:
        raise ArgumentError(
            "rendering", rendering, f"full: the law of the world {name} has no impulses to fit"
        )
    return world


def _engine_named(name: str) -> Engine:
    """Import an engine by name: an object, or a class that makes one without arguments."""
    found: Any = object_named("world", name, "module:engine")
    engine: Any = found() if isinstance(found, type) else found
    if is_engine(engine):
        return engine
    expected = "an engine: an object with name, settings, ignored(scene) and run(scene)"
    raise ArgumentError("world", name, expected)
