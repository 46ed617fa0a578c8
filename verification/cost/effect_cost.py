"""What an effect costs per step, and what changes without it: the same scene with it and without it, in turn.

An effect is left out by the scene's own values, by another law or coupling, by a switch of the compiled step, or by
the pairs of shapes that may touch; `LEFT_OUT` says which. Times are the thread's own, least of loops in turn: what
else runs only adds. Positions are compared over the whole run, in metres.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb import decide_effects
from iapb.compiled import block
from iapb.contact.laws import Penalty
from iapb.errors import IapbError
from iapb.haptics.coupling import NoCoupling
from iapb.recorder import Recorder
from iapb.scene import Scene
from iapb.simulation import Simulation
from reference.worlds import World, find_world
from verification.finding import Failure, attempt

Floats = NDArray[np.float64]

PAIRS = 7  # timed runs with and without, in turn; the least disturbed of each are compared
SAMPLES = 400  # instants at which positions are compared


@dataclass(frozen=True)
class Variant:
    """A way to run a scene: values changed, impulses and coupling or not, switches off, kinds of pairs left out."""

    values: tuple[tuple[str, Any], ...] = ()
    impulses: bool = True
    coupled: bool = True
    switches: tuple[str, ...] = ()
    untouched: str = ""


LEFT_OUT: dict[str, Variant] = {
    "gravity": Variant((("gravity", None),)),
    "varying_inertia": Variant(switches=("varying_inertia",)),
    "velocity_terms": Variant(switches=("velocity_terms",)),
    "hand_force": Variant((("hand.force", None),)),
    "wall_contacts": Variant(untouched="wall"),
    "body_contacts": Variant(untouched="body"),
    "self_collisions": Variant((("contact.self_collisions", False),)),
    "impulses": Variant(impulses=False),
    "unequal_restitution": Variant(switches=("unequal_restitution",)),
    "penalty_stiffness": Variant((("contact.stiffness", 0.0),)),
    "contact_damping": Variant((("contact.damping", 0.0),)),
    "friction": Variant((("contact.friction", 0.0),)),
    "clustering": Variant((("contact.cluster_distance", 0.0),)),
    "coherence": Variant((("contact.coherence_distance", 0.0),)),
    "coupling": Variant(coupled=False),
    "delay": Variant((("device.delay", 0),)),
    "quantisation": Variant((("device.position_resolution", None),)),
    "device_damping": Variant((("device.damping", None),)),
}


@dataclass(frozen=True)
class EffectMeasure:
    """One effect of one scene; NaN where the run without it could not be finished, and `note` says why.

    seconds, without : per step, with the effect and without it [s]
    position, device : largest distance of the tool (of any body, without a hand) and of the device from where they
        are with the effect [m]; device NaN where there is none in both
    energy : largest change of the kinetic energy, in largest kinetic energies with the effect
    """

    effect: str
    seconds: float
    without: float
    position: float
    device: float
    energy: float
    note: str = ""

    @property
    def saved(self) -> float:
        """Share of the step's time that leaving it out saves; negative where it costs."""
        return 1.0 - self.without / self.seconds


def measure_effects(
    scene: Scene, world: str = "IAPB", pairs: int = PAIRS, progress: Callable[[int, int], None] | None = None,
    failures: list[Failure] | None = None,
) -> tuple[EffectMeasure, ...]:
    """Measure every effect that is on in a world of the compiled engine and that can be left out.

    `failures` receives the effects that raise anything but an `IapbError`; without it that passes through.
    """
    chosen = find_world(world)
    on = [effect.name for effect in decide_effects(scene, chosen.law, chosen.coupling_in(scene))
          if effect.active and effect.name in LEFT_OUT]  # fmt: skip
    whole = _Loop(scene, chosen, Variant())
    whole.sample()
    found = []
    for done, name in enumerate(on, start=1):
        measured = attempt(f"{scene.name}, {name}", partial(_measure, scene, chosen, whole, name, pairs), failures)
        if measured is not None:
            found.append(measured)
        if progress is not None:
            progress(done, len(on))
    return tuple(found)


def _measure(scene: Scene, world: World, whole: _Loop, name: str, pairs: int) -> EffectMeasure:
    nothing = (np.nan,) * 4
    try:
        other = _Loop(scene, world, LEFT_OUT[name])
        other.sample()
        times = [(whole.sample(), other.sample()) for _ in range(pairs)]
    except IapbError as error:
        return EffectMeasure(name, np.nan, *nothing, f"without it no run: {error}")
    ours, theirs = (min(column) for column in zip(*times, strict=True))
    kinetic = whole.kinetic()
    return EffectMeasure(
        name, ours, theirs, _farthest(whole.places(), other.places()),
        _farthest(whole.device_places(), other.device_places()),
        float(np.abs(other.kinetic() - kinetic).max() / max(float(kinetic.max()), np.finfo(float).tiny)),
    )  # fmt: skip


def _farthest(one: Floats, other: Floats) -> float:
    return float(np.linalg.norm(one - other, axis=-1).max()) if one.shape == other.shape and one.size else np.nan


class _Loop:
    """A scene in the compiled loop, started anew for every sample; keeps the states of the last one."""

    def __init__(self, scene: Scene, world: World, variant: Variant) -> None:
        changed = scene.with_values(_values(scene, variant)) if variant.values else scene
        law = world.law if variant.impulses else Penalty()
        coupling = world.coupling_in(changed) if variant.coupled else NoCoupling()
        self.simulation = Simulation(changed, law, coupling)
        if variant.untouched:
            _leave_out_pairs(self.simulation, variant.untouched)
        if variant.switches:
            self.simulation.world = _switched_off(self.simulation.world, variant.switches)
        self.steps = scene.steps
        self.q = self.v = self.device_q = np.zeros((0, 0))

    def sample(self) -> float:
        """Seconds per step of one whole run, its record included."""
        simulation, system = self.simulation, self.simulation.system
        simulation.state, simulation.steps_done = system.make_state(), 0
        simulation.port = system.make_port(simulation.coupling)
        recording, seconds = Recorder(simulation), 0.0
        while recording.steps < self.steps:
            started = time.thread_time()
            stop = recording.chunk(self.steps)
            seconds += time.thread_time() - started
            if stop is not None:
                raise stop
        every = slice(None, None, max(1, self.steps // SAMPLES))
        self.q, self.v, self.device_q = (
            np.concatenate([getattr(record, name) for record in recording.records])[every]
            for name in ("q", "v", "device_q")
        )
        return seconds / self.steps

    def places(self) -> Floats:
        """(n, k, 3) of the held body, of all bodies without a hand [m]."""
        system = self.simulation.system
        bodies = slice(None) if system.tool_tree < 0 else slice(system._held_body(), system._held_body() + 1)
        return np.array([_points(system.mechanism, q, bodies) for q in self.q])

    def device_places(self) -> Floats:
        """(n, k, 3) of the device's bodies [m]; empty without a device."""
        if self.simulation.coupling.name == "none":
            return np.zeros((0, 0, 3))
        device = self.simulation.system.device_mechanism()
        return np.array([device.placements(q)[1] for q in self.device_q])

    def kinetic(self) -> Floats:
        """(n,) [J]."""
        mechanism = self.simulation.system.mechanism
        return np.array([mechanism.kinetic_energy(q, v) for q, v in zip(self.q, self.v, strict=True)])


def _points(mechanism: Any, q: Floats, bodies: slice) -> Floats:
    """Four points of each body [m]: its centre of mass, and a radius of gyration from there along each of its axes.

    The origin alone would not do: that of a hinged body lies in the hinge and never moves.
    """
    found = []
    rotation, position = mechanism.placements(q)
    for body, R, p in zip(mechanism.bodies[bodies], rotation[bodies], position[bodies], strict=True):
        radius = float(np.sqrt(np.trace(body.inertia) / (2.0 * body.mass))) if body.mass > 0.0 else 0.0
        center = p + R @ np.asarray(body.center_of_mass)
        found += [center, *(center + radius * R.T)]
    return np.array(found)


def _values(scene: Scene, variant: Variant) -> dict[str, Any]:
    """The values of a variant; a hand's force keeps its length."""
    force = [0.0] * len(scene.hand.force) if scene.hand is not None else None
    return {name: force if name == "hand.force" else value for name, value in variant.values}


def _switched_off(world: Any, names: tuple[str, ...]) -> Any:
    """The same world with switches of the compiled step off."""
    switches = world.switches._content._replace(**dict.fromkeys(names, False))
    return block(world._content._replace(switches=switches))


def _leave_out_pairs(simulation: Any, kind: str) -> None:
    """Let pairs with a wall, or pairs of two trees, pass through each other."""
    system = simulation.system
    bodies, tree = system.shapes.body, system.mechanism.tree_of_body
    a, b = bodies[system.pairs[:, 0]], bodies[system.pairs[:, 1]]
    walls = b < 0
    gone = walls if kind == "wall" else ~walls & (tree[a] != tree[np.maximum(b, 0)])
    system.pairs = np.ascontiguousarray(system.pairs[~gone])
    system._worlds.clear()
    simulation.world = system.world_under(simulation.law)


def in_words(measure: EffectMeasure) -> tuple[str, str]:
    """Cost per step, and what changes without the effect."""
    if measure.note:
        return "", measure.note
    cost = f"{100.0 * measure.saved:+.0f} % of the step ({measure.seconds * 1e6:.2f} µs with it)"
    moved = f"up to {_length(measure.position)} elsewhere"
    if np.isfinite(measure.device):
        moved += f", the device {_length(measure.device)}"
    return cost, f"{moved}; kinetic energy up to {100.0 * measure.energy:.3g} % of its largest off"


def _length(metres: float) -> str:
    if metres == 0.0:
        return "0 mm"
    return f"{metres * 1e3:.3g} mm" if metres < 1.0 else f"{metres:.3g} m"
