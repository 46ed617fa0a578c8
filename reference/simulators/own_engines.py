"""Our engine and our rigid world behind the adapters' protocol: the yardstick, judged like the others."""

from __future__ import annotations

from typing import Any

import numpy as np

from iapb.contact.laws import ContactLaw
from iapb.errors import IapbError
from iapb.simulation import simulate
from reference.simulators.own_scene import own_scene, world_state
from reference.simulators.scene import FixedScene
from reference.simulators.simulator import Settings
from reference.simulators.trajectory import Trajectory, steps_between_samples
from reference.time_stepping import RigidConstraints

STEP = 1e-3  # [s] the haptic rate, for which both are made
IMPACT = {"stiffness": 1e3, "damping": 0.0, "coherence_distance": 2e-3}  # the paper's walls, lossless
REST = {"stiffness": 1e4, "damping": 40.0, "coherence_distance": 1e-3}
STACK_STEP = 5e-6  # [s] springs that carry 1000 kg are stable against 1 g only at such steps
STACK = {"stiffness": 4e6, "damping": 2.5, "coherence_distance": 1e-3}


class ImpulseAugmentedEngine:
    """iapb: impulses where a contact is new, penalties while it lasts."""

    title = "iapb (ours)"

    def version(self) -> str:
        """Our own."""
        return _own_version()

    def settings(self, scene: FixedScene, step: float | None = None) -> Settings:
        """Stiffness and damping per corner, as a scene's author would choose them."""
        if not scene.rests:
            return Settings(step or STEP, dict(IMPACT))
        heavy = max(body.mass for body in scene.bodies) > 100.0
        if heavy and step is None:
            return Settings(STACK_STEP, dict(STACK), "a stack of springs: the mass ratio asks for short steps")
        return Settings(step or STEP, dict(REST), "springs that suit the lightest box cannot carry the heaviest"
                        if heavy else "")  # fmt: skip

    def run(self, scene: FixedScene, settings: Settings, step: float, duration: float) -> Trajectory:
        """By the compiled loop."""
        return _simulated(scene, settings, step, duration, None)


class RigidWorld:
    """Rigid contacts at velocity level: one QP per step."""

    title = "rigid world (ours)"

    def version(self) -> str:
        """Our own."""
        return _own_version()

    def settings(self, scene: FixedScene, step: float | None = None) -> Settings:
        """Moreau's step where e > 0, Stewart and Trinkle's where e = 0; overlaps are left."""
        return Settings(step or STEP, {"scheme": "automatic", "margin": 0.02})

    def run(self, scene: FixedScene, settings: Settings, step: float, duration: float) -> Trajectory:
        """By the Python loop."""
        law = RigidConstraints(scheme=str(settings.options["scheme"]), margin=float(settings.options["margin"]))
        return _simulated(scene, Settings(step), step, duration, law)


def _simulated(scene: FixedScene, settings: Settings, step: float, duration: float,
               law: ContactLaw | None) -> Trajectory:  # fmt: skip
    contact: dict[str, Any] = dict(settings.options)
    run = simulate(own_scene(scene, step, duration, **contact), law)
    if not run.complete:
        raise IapbError(run.stopped)
    keep = slice(None, None, steps_between_samples(step))
    touching = np.append(np.diff(run.contacts.offsets), 0)
    return Trajectory(run.time[keep], *world_state(run.q[keep], run.v[keep]), touching[keep])


def _own_version() -> str:
    from importlib.metadata import version

    return version("iapb")
