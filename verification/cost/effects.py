"""Which effects a scene calls for, what each costs per step, and what changes without it.

The same scene is run with an effect and without it, in turn.

An effect is left out by the scene's own values, by another law or coupling, by a switch of the compiled step, or by
the pairs of shapes that may touch; `LEFT_OUT` says which. The least times of loops in turn are compared, and positions
over the whole run, in metres.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb import decide_effects, find_scene, load_scene
from iapb.compiled import block
from iapb.contact.laws import Penalty
from iapb.errors import IapbError
from iapb.haptics.coupling import NoCoupling
from iapb.scene import Scene
from iapb.simulation import Simulation
from reference.worlds import World, find_world
from verification.clock import take_turns
from verification.cost.loop import RecordedLoop
from verification.finding import Column, Failure, Row, Table, attempt, table_of

Floats = NDArray[np.float64]

SCENES = ("peg_corner", "arm_pushing", "arm_obstacles")
PAIRS = 7  # timed runs with and without, in turn; the least disturbed of each are compared
SAMPLES = 400  # instants at which positions are compared
_TINY = np.finfo(float).tiny


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
    "hand_force": Variant((("hand.force", None), ("hand.force_table", ()), ("hand.force_function", ()))),
    "joint_damping": Variant(switches=("joint_damping",)),
    "joint_limits": Variant(switches=("joint_limits",)),
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
    "device_limits": Variant((("device.force_limit", None),)),
    "waveform": Variant((("device.waveform", "step"),)),
}
NOTHING = "nothing in this run"  # how the words begin on an effect that is on and changes nothing
# What acts through contacts alone, and what it asks of the run: pairs of the first kind, or any contact at all.
_THROUGH_CONTACTS = {
    "wall_contacts": ("wall", "no body touches a wall"),
    "body_contacts": ("body", "no two separate bodies touch"),
    "self_collisions": ("tree", "no two links of one tree touch"),
} | dict.fromkeys(
    ("impulses", "unequal_restitution", "penalty_stiffness", "contact_damping", "friction", "clustering", "coherence"),
    ("", "nothing touches"),
)


# One effect: on or off, why, and what leaving it out would change in any scene; then as measured in this one. What is
# off, cannot be left out, or has no run without it has no numbers, and `change` says why there is no run.
COLUMNS = (
    Column("effect", condition=True),
    Column("active"),
    Column("reason", prose=True),
    Column("left out", prose=True),
    Column("step", "µs", timed=True),  # with the effect
    Column("time saved", "%", timed=True),  # of the step, by leaving it out; negative where it costs
    Column("position", "mm"),  # largest distance of the tool (of any body, without a hand) from where it is with it
    Column("device", "mm"),  # the same of the device
    Column("energy", "%"),  # largest change of the kinetic energy, in its largest value with the effect
    Column("cost", prose=True, timed=True),
    Column("change", prose=True),
)


def effects_of_scenes(
    progress: Callable[[int, int], None] | None = None, failures: list[Failure] | None = None
) -> dict[str, Table]:
    """The effects of each of SCENES in the IAPB world, measured."""
    found = {}
    for done, name in enumerate(SCENES, start=1):
        found[name] = attempt(name, lambda name=name: effects_of(_scene(name), failures=failures), failures)  # type: ignore[misc]
        if progress is not None:
            progress(done, len(SCENES))
    return {name: effects for name, effects in found.items() if effects is not None}


def _scene(name: str) -> Scene:
    return load_scene(find_scene(name))


def effects_of(
    scene: Scene, world: str = "IAPB", progress: Callable[[int, int], None] | None = None,
    failures: list[Failure] | None = None, pairs: int = PAIRS,
) -> Table:
    """Every effect of a scene in a world of the compiled engine, measured where it is on and can be left out.

    `failures` receives the effects that raise anything but an `IapbError`; without it that passes through.
    """
    chosen = find_world(world)
    effects = decide_effects(scene, chosen.law, chosen.coupling_in(scene))
    on = [effect.name for effect in effects if effect.active and effect.name in LEFT_OUT]
    whole, measured = Loop(scene, chosen, Variant()), dict[str, dict[str, Any]]()
    for done, name in enumerate(on, start=1):
        found = attempt(f"{scene.name}, {name}", partial(measure, scene, chosen, whole, name, pairs), failures)
        measured[name] = found or {}
        if progress is not None:
            progress(done, len(on))
    return table_of(COLUMNS, (
        {"effect": effect.name, "active": effect.active, "reason": effect.reason, "left out": effect.left_out,
         **measured.get(effect.name, {})} for effect in effects), digits=3)  # fmt: skip


def summary(effects: Mapping[str, Table]) -> Table:
    """The table behind the figure: a row per scene and measured effect."""
    columns = (Column("scene", condition=True), Column("effect", condition=True), Column("time saved", "%", timed=True),
               Column("error", "mm"), Column("best of its error", timed=True))  # fmt: skip
    rows = []
    for scene, table in effects.items():
        measured = [row for row in table.records() if row["time saved"] is not None and row["position"] is not None]
        front = {row["effect"] for row in measured if not any(_beats(other, row) for other in measured)}
        rows += [(scene, row["effect"], row["time saved"], row["position"], "yes" if row["effect"] in front else "no")
                 for row in measured]  # fmt: skip
    return Table(columns, tuple(rows), digits=3,
                 note="Best of its error: no other effect saves more time at the cost of no larger error.")  # fmt: skip


def _beats(other: Row, row: Row) -> bool:
    """Whether leaving out another effect saves no less time at no larger error, and is better in one of them."""
    one, two = ((each["time saved"], -each["position"]) for each in (other, row))
    return one[0] >= two[0] and one[1] >= two[1] and one != two


def measure(scene: Scene, world: World, whole: Loop, name: str, pairs: int) -> dict[str, Any]:
    """The measured cells of one effect."""
    try:
        other = Loop(scene, world, LEFT_OUT[name])
        times = take_turns({"with": whole.sample, "without": other.sample}, pairs)
    except IapbError as error:
        return {"change": f"without it no run: {error}"}
    kinetic = whole.kinetic()
    found = {
        "step": 1e6 * times["with"].least,
        "time saved": 100.0 * (1.0 - times["without"].least / times["with"].least),
        "position": _farthest(whole.places(), other.places()),
        "device": _farthest(whole.device_places(), other.device_places()),
        "energy": 100.0 * float(np.abs(other.kinetic() - kinetic).max() / max(float(kinetic.max()), _TINY)),
    }
    words = in_words(found)
    if whole.same_motion(other):
        words["change"] = f"{NOTHING}: {_why_nothing(name, whole.touching())}"
    return found | words


def _why_nothing(name: str, touching: frozenset[str]) -> str:
    """Why leaving the effect out changed nothing, as far as the contacts of the run tell."""
    kind, absent = _THROUGH_CONTACTS.get(name, ("", ""))
    if absent and not (touching if not kind else touching & {kind}):
        return absent
    return "all states are the same to the last bit"


def in_words(found: Row) -> dict[str, str]:
    """Cost per step, and what changes without the effect."""
    moved = f"up to {_length(found['position'])} elsewhere"
    if found["device"] is not None:
        moved += f", the device {_length(found['device'])}"
    return {"cost": f"{found['time saved']:+.0f} % of the step ({found['step']:.2f} µs with it)",
            "change": f"{moved}; kinetic energy up to {found['energy']:.3g} % of its largest off"}  # fmt: skip


def _length(millimetres: float) -> str:
    return f"{millimetres:.3g} mm" if millimetres < 1e3 else f"{millimetres / 1e3:.3g} m"


def _farthest(one: Floats, other: Floats) -> float | None:
    """[mm]; None where there is nothing to compare."""
    return 1e3 * float(np.linalg.norm(one - other, axis=-1).max()) if one.shape == other.shape and one.size else None


class Loop(RecordedLoop):
    """A variant of a scene in its loop; keeps the states of the last sample."""

    def __init__(self, scene: Scene, world: World, variant: Variant) -> None:
        changed = scene.with_values(_values(scene, variant)) if variant.values else scene
        law = world.law if variant.impulses else Penalty()
        coupling = world.coupling_in(changed) if variant.coupled else NoCoupling()
        super().__init__(Simulation(changed, law, coupling), scene.steps)
        if variant.untouched:
            _leave_out_pairs(self.simulation, variant.untouched)
        if variant.switches:
            self.simulation.world = _switched_off(self.simulation.world, variant.switches)
        self.q = self.v = self.device_q = np.zeros((0, 0))

    def same_motion(self, other: Loop) -> bool:
        """Whether tool and device were at the same places with the same velocities, to the last bit, in all steps."""
        ours, theirs = (each.recording.joined("steps") for each in (self, other))
        return all(np.array_equal(ours[name], theirs[name]) for name in ("q", "v", "device_q", "device_v"))

    def touching(self) -> frozenset[str]:
        """Kinds of the contacts of the last sample: "wall", "body" (of two trees) and "tree" (of one)."""
        contacts = self.recording.joined("contacts")
        a, b = contacts["body_a"], contacts["body_b"]
        tree = self.simulation.system.mechanism.tree_of_body
        kinds = np.where(b < 0, "wall", np.where(tree[a] == tree[np.maximum(b, 0)], "tree", "body"))
        return frozenset(np.unique(kinds).tolist())

    def sample(self) -> float:
        """Seconds per step of one whole run."""
        seconds, every = super().sample(), slice(None, None, max(1, self.steps // SAMPLES))
        self.q, self.v, self.device_q = (
            np.concatenate([getattr(record.steps, name) for record in self.recording.records])[every]
            for name in ("q", "v", "device_q")
        )
        return seconds

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
