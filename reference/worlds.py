"""The paper's four worlds (section VI): a contact law and a coupling under one name.

| world | contact law | coupling |
|---|---|---|
| ideal | rigid constraints | four-channel |
| IAPB | impulses and penalties | four-channel |
| PB | penalties | four-channel |
| CBuc | rigid constraints | unilateral coupler |
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from iapb.contact.laws import ContactLaw, ImpulseAugmented, Penalty
from iapb.errors import ArgumentError
from iapb.haptics.coupling import Coupling
from iapb.run import Run
from iapb.scene import Scene
from iapb.simulation import simulate
from iapb.system import coupling_of


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


WORLD_NAMES = ("ideal", "IAPB", "PB", "CBuc")


def find_world(name: str, rendering: str = "full") -> World:
    """The world of that name; `rendering` says how IAPB meets the device's limits (``full`` ignores them)."""
    if name not in WORLD_NAMES:
        raise ArgumentError("world", name, "one of " + ", ".join(WORLD_NAMES))
    if name == "IAPB":
        return World(name, ImpulseAugmented(rendering=rendering), "four-channel")
    if name == "PB":
        return World(name, Penalty(), "four-channel")
    from reference.time_stepping import RigidConstraints

    return World(name, RigidConstraints(), "four-channel" if name == "ideal" else "unilateral")


def run_world(
    scene: Scene,
    name: str,
    rendering: str = "full",
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> Run:
    """Simulate a scene in one of the paper's worlds."""
    world = find_world(name, rendering)
    label = name if rendering == "full" else f"{name} {rendering}"
    return simulate(scene, world.law, world.coupling_in(scene), world=label, progress=progress, **options)
